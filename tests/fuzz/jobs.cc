// Lines of --batch: words as a shell has them, JSON arrays and objects.
#include "cli/arguments.h"
#include "cli/batch_job.h"
#include "fuzz/fuzz.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  return {R"(a.exr --hue 30 -o "b c.exr")",
          R"(["a.exr", "--hue", "30", "-o", "b.exr"])",
          "# a remark",
          R"({"id": 7, "words": ["a.exr", "-o", "b\u00e9.exr"]})",
          R"({"id": {"a": [1, null]}, "words": []})",
          R"('it'\''s' a\ b "q\"q" $HOME `x`)"};
}
std::vector<std::string> Words() {
  return {"{\"id\": ", "\"words\": [", "[",  "]", "{",    "}",     "\\u0000", "\\ud800",
          "'",         "\"",           "\\", " ", "null", "1e999", "#",       "[[[[[[[["};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view line(reinterpret_cast<const char*>(data), size);
  if (!cli::IsJob(line)) return 0;
  try {
    const cli::Job job = cli::ParseJob(line);
    fuzz::Require(job.id.find('\n') == std::string::npos, "an id of two lines");
    for (const std::string& word : job.words)
      fuzz::Require(word.size() <= 4 * size + 4, "a word that has grown");
  } catch (const cli::UsageError& e) {
    fuzz::Require(*e.what() != 0, "a refusal without a reason");
  }
  return 0;
}
