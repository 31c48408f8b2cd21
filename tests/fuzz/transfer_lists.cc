// Lists and tables of --transfer, and transfer functions of --volume, as text and as files.
#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "tessera/ops/volume.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds = {"f0 1 1 1 0\n0.5 1 .5 0 0.2 # half\n1 0 0 0 1\n", "f", "f-1e3 0 0 0 0\n",
                                    "v0,1,1,1,0,1,1,0,0,1"};
  for (const char* name : {"scale", "bias", "table1", "kernel", "kernelsize", "matrix", "map", "transfer"}) {
    for (const std::string& value : ExamplesOf(name))
      seeds.push_back(name == std::string("transfer") ? "v" + value : "t" + std::string(name) + "=" + value);
  }
  seeds.push_back("ttable1=0,0.25,1:interpolate=1:format=rgb:scale=2,2,2,1:clamp=stages");
  return seeds;
}
std::vector<std::string> Words() {
  std::vector<std::string> words = {",",     ":",   "=",  "\n",          " ",       "#",
                                    "1e300", "nan", "-0", ":quantize=8", ":count=1"};
  for (const ops::ParamInfo& p : ops::FindOp("transfer")->modifiers) words.push_back(":" + p.name + "=");
  return words;
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File file("transfer.txt");
  fuzz::Input in(data, size);
  const char kind = in.Take<char>();
  if (kind == 'f') {
    const std::string name = file.Put(in.Rest());
    fuzz::Try([&] { ReadVolumeTransferFunction(name); });
  } else if (kind == 'v') {
    fuzz::Try([&] {
      fuzz::ApplyTo("volume", {},
                    {{"solid", "sphere(0,0,0,.5)"},
                     {"dims", "6"},
                     {"size", "5x4"},
                     {"mode", "over"},
                     {"transfer", std::string(in.Rest())}});
    });
  } else {
    fuzz::Modifiers modifiers;
    while (!in.empty()) {
      const std::string_view word = in.Until(':');
      const size_t equals = std::min(word.find('='), word.size());
      modifiers.emplace_back(word.substr(0, equals), word.substr(std::min(equals + 1, word.size())));
    }
    fuzz::Try([&] { fuzz::ApplyTo("transfer", {}, modifiers); });
  }
  return 0;
}
