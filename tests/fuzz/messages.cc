// Messages: whatever they hold, what is printed is one short line of text without controls.
#include "cli/messages.h"

#include "fuzz/fuzz.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  return {"shot.exr: no such file", "a\x1b[31mb\n\tc\r",
          "\xc2\x9b"
          "2J \xe2\x80\xa6 \xf0\x9f\x98\x80 \xed\xa0\x80",
          std::string(2500, 'x') + "\xe2\x80\xa6",
          std::string(1399, 'a') + "\xf0\x9f\x98\x80" + std::string(900, 'b')};
}
std::vector<std::string> Words() {
  return {"\xc2\x85", "\xf4\x90\x80\x80", "\xff", "\x1b", "\xe2\x80\xae", "\x7f"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string line = cli::Printable(text);
  fuzz::Require(line.size() <= 4 * 2100, "a long line");
  for (size_t i = 0; i < line.size(); ++i) {
    const auto c = static_cast<unsigned char>(line[i]);
    fuzz::Require(c >= 0x20 && c != 0x7F, "a control character");
    if (c == 0xC2 && i + 1 < line.size())
      fuzz::Require(static_cast<unsigned char>(line[i + 1]) >= 0xA0, "a C1 control character");
    fuzz::Require(c < 0xF8, "a byte that is no UTF-8");
  }
  return 0;
}
