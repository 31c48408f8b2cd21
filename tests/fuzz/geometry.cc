// Geometry words: windows, sizes, and the operations that read them.
#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "tessera/ops/channels.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  const std::vector<std::string> texts = {"640x480", "640x480+10-20", "+3+4", "0,0,639,479",
                                          "50%",     "50%x25%",       "0x480"};
  for (const std::string& text : texts) {
    for (int kind = 0; kind < 6; ++kind) seeds.push_back(static_cast<char>('0' + kind) + text);
  }
  return seeds;
}
std::vector<std::string> Words() {
  return {"x", "+", "-", ",", "%", "+0+0", "2147483647", "-2147483648", "16777216", "0.5", "1e9"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const size_t kind = in.Below(6);
  const std::string text(in.Rest());
  fuzz::Try([&] {
    constexpr const char* kOperations[] = {"crop", "cut", "resize", "erode", "blur"};
    if (kind > 0) return fuzz::ApplyTo(kOperations[kind - 1], {text}, {});
    const Roi base = {-5, 2, 2147483000, 70};
    const Roi window = ParseGeometry(text, base);
    fuzz::Require(!window.empty() && window.x0 < window.x1 && window.y0 < window.y1,
                  "a window without pixels");
  });
  return 0;
}
