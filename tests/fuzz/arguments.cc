// Words of every row of the registry: any text is parsed or refused, and what is parsed makes a picture or
// not.
#include "fuzz/fuzz.h"
#include "fuzz/operations.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  const std::vector<ops::OpInfo>& rows = ops::Registry();
  for (size_t i = 0; i < rows.size(); ++i) {
    for (const std::string& example : rows[i].examples) {
      const ops::Words words = ops::SplitExample(rows[i], example);
      std::string seed = {static_cast<char>(i & 255), static_cast<char>(i >> 8)};
      for (const std::string& word : words.positional) seed += word + "\n";
      for (const auto& [key, value] : words.modifiers) seed += ":" + key + "=" + value + "\n";
      seeds.push_back(seed);
    }
  }
  return seeds;
}
std::vector<std::string> Words() {
  std::vector<std::string> words = RegistryWords();
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const ops::ParamInfo& p : op.modifiers) words.push_back("\n:" + p.name + "=");
  }
  words.insert(words.end(), {"\n", ",", "-", "1e38", "-1e38", "2147483648", "nan", "0"});
  return words;
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const std::vector<ops::OpInfo>& rows = ops::Registry();
  const ops::OpInfo& op = rows[in.Take<uint16_t>() % rows.size()];
  std::vector<std::string> positional;
  fuzz::Modifiers modifiers;
  while (!in.empty()) {
    const std::string word(in.Until('\n'));
    if (word.find('/') != std::string::npos) return 0;  // files that are there
    const size_t equals = std::min(word.find('='), word.size());
    if (word.starts_with(':')) {
      modifiers.emplace_back(word.substr(1, equals - 1), word.substr(std::min(equals + 1, word.size())));
    } else {
      positional.push_back(word);
    }
  }
  fuzz::Try([&] { fuzz::ApplyTo(op.name, positional, modifiers); });
  return 0;
}
