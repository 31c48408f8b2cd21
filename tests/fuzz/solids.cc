// Solids and chains of density modulation functions from words (solid= and dmf= of --volume).
#include <cmath>

#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "tessera/ops/hypertexture.h"
#include "tessera/volume.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds = {
      "storus(0,0,0,.6,.2) |.1 (sphere(0,.5,0,.3) - box(0,0,0,.1,.1,.1)) &.2 body",
      "dbias(.3), noise(.4,6), turbulence(.8,2), gain(.7), warp(.05,3), lift(.2,1), "
      "swell(.3,1), threshold(.3,.1)",
      "dtable(0,0,.5,.9,1,1)*height(-1,1)*~sphere(0,0,0,.4,.2),gain(.7)*half(0,1,0,.1,.2)*band(0,.5,.1),"
      "bias(.4)*light(-1,0,0,.5,1,1)*eye(0,1)*gradient(0,2)*density(.1,.9)"};
  for (const std::string& value : ExamplesOf("solid")) seeds.push_back("s" + value);
  for (const std::string& value : ExamplesOf("dmf"))
    seeds.push_back("d" + value), seeds.push_back("r" + value);
  return seeds;
}
std::vector<std::string> Words() {
  return {"sphere(",    "ellipsoid(", "box(",  "torus(", "capsule(", "cone(",     "plane(",
          "body",       "knot",       "|",     "&",      "-",        "|.1",       "&.1",
          "(",          ")",          ",",     "bias(",  "gain(",    "noise(",    "turbulence(",
          "threshold(", "warp(",      "lift(", "swell(", "table(",   "*",         "~",
          "height(",    "half(",      "band(", "light(", "eye(",     "gradient(", "density(",
          "1e308",      "nan",        "inf",   "1e-320", "0",        " "};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const char kind = in.Take<char>();
  const std::string words(in.Rest());
  fuzz::Try([&] {
    if (kind == 's') {
      const Solid solid = Solid::Parse(words);
      for (const double at : {0.0, 0.3, -1.0}) solid.Distance({at, 0.1, -at});
    } else if (kind == 'd') {
      for (const Dmf& step : ParseDmf(words))
        fuzz::Require(std::isfinite(step.amount) && step.frequency >= 0,
                      "a step of numbers that are refused");
    } else {
      fuzz::ApplyTo(
          "volume", {},
          {{"solid", "sphere(0,0,0,.5)"}, {"dims", "6"}, {"size", "4x3"}, {"mode", "hyper"}, {"dmf", words}});
    }
  });
  return 0;
}
