// Frame numbers: signs in names, ranges, expressions in braces.
#include "cli/frames.h"

#include "cli/frame_names.h"
#include "fuzz/fuzz.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  return {"n4 shot.#.exr",
          "n0 a.1-10#.exr",
          "n0 100%_%04d.exr",
          "n2 a%b.@@.exr",
          "n0 %d%d.exr",
          "r1-10",
          "r1-100x2,3,7,10-20",
          "r1-9y3",
          "r0",
          "r1-2147483647x99999",
          "e{FRAME_NUMBER/24}",
          "eclouds:time={FRAME_NUMBER*(1-2)+-3}",
          "e{}{ FRAME_NUMBER",
          "n1 dir.#/a.exr",
          "n0 a.%99999999d.exr",
          "n0 a.1-1000000000x999,5#.exr"};
}
std::vector<std::string> Words() {
  return {"#", "@", "%04d", "%d", "%", "{FRAME_NUMBER}", "FRAME_NUMBER", "{",         "}",     "(", ")",
          "-", "x", "y",    ",",  "/", "2147483647",     "2147483648",   "1-1000000", "1e308", "*", "0"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const char kind = in.Take<char>();
  try {
    if (kind == 'r') {
      const std::vector<int> frames = cli::ParseFrameRange("--frames", std::string(in.Rest()));
      fuzz::Require(!frames.empty() && frames.size() <= 1000000, "an empty range, or too many frames");
      for (const int frame : frames) fuzz::Require(frame >= 0, "a frame below 0");
    } else if (kind == 'e') {
      const std::vector<std::string> words = {std::string(in.Rest())};
      cli::WithFrame(words, 7);
    } else {
      const int padding = static_cast<int>(in.Below(17));
      const std::string name(in.Rest());
      const auto found = cli::FindFrame(name, padding);
      if (!found) return 0;
      for (const int frame : {0, 7, 2147483647}) {
        const std::string file = found->At(frame);
        fuzz::Require(file.size() <= name.size() + 80, "a name that has grown");
        fuzz::Require(file.starts_with(found->before) && file.ends_with(found->behind),
                      "a name that lost its text");
      }
      cli::SequenceFiles(name, {1, 2}, padding);
      if (found->range.size() < 40) cli::SequenceFiles(name, {}, padding);
    }
  } catch (const cli::UsageError&) {
  }
  return 0;
}
