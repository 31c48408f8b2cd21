// Tables of --table: lists of numbers, and text files of columns.
#include "fuzz/fuzz.h"
#include "fuzz/operations.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds = {"f\n0 0 0\n0.5 0.4 0.3\n1 1 1\n", "f\n# a curve\n0\n.25 # more\n\n1\n",
                                    "fall\n0,1\n1,0\n", "tcolor\n0,0.25,1", "tR,G\n1,0"};
  for (const std::string& value : ExamplesOf("TABLE")) seeds.push_back("tall\n" + value);
  return seeds;
}
std::vector<std::string> Words() {
  return {",",    " ",      "\n", "\t", "\r\n", "#",   "nan",   "inf",
          "1e39", "-1e-46", "+",  ".",  "e",    "all", "color", "A"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File file("table.txt");
  fuzz::Input in(data, size);
  const bool from_file = in.Take<char>() == 'f';
  const std::string channels(in.Until('\n'));
  const std::string text = from_file ? file.Put(in.Rest()) : std::string(in.Rest());
  if (!from_file && text.find('/') != std::string::npos) return 0;  // some other file
  fuzz::Try([&] { fuzz::ApplyTo("table", {text}, {{"channels", channels.empty() ? "color" : channels}}); });
  return 0;
}
