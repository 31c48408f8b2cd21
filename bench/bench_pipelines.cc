// Chains as users write them: one that folds into two matrices and a clamp, one that cannot be folded, and
// the single matrix that every library has.

#include "harness.h"

namespace {

// Alpha is left in [0,1] by all of them, because OpenColorIO's range does not clamp it.
constexpr char kGain[] = "1.3,1.1,0.9,1";
constexpr char kOffset[] = "0.02,-0.03,0.01,0";
constexpr char kWarm[] = "0.80,0.15,0.05,0, 0.10,0.85,0.05,0, 0.05,0.10,0.85,0, 0,0,0,1";
constexpr char kCool[] = "1.20,-0.10,-0.10,0, -0.05,1.10,-0.05,0, 0.02,-0.12,1.10,0, 0,0,0,1";
// All sixteen coefficients count.
constexpr char kFull[] = "0.70,0.20,0.05,0.05, 0.10,0.75,0.10,0.05, 0.05,0.15,0.70,0.10, 0.02,0.03,0.05,0.90";

std::string NoBlanks(std::string text) {
  std::erase(text, ' ');
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](const Options& options) {
    const std::string warm = NoBlanks(kWarm), cool = NoBlanks(kCool), clamp = "min=0 max=1";
    RegisterTask("pipelines",
                 MakeTask("eight folded", {{"mulc", kGain},
                                           {"addc", kOffset},
                                           {"ccmatrix", warm},
                                           {"saturate", "1.2"},
                                           {"clamp", clamp},
                                           {"mulc", "0.9,1.0,1.1,1"},
                                           {"addc", kOffset},
                                           {"ccmatrix", cool}}),
                 options, /*with_unfolded=*/true);
    std::vector<std::pair<std::string, std::string>> stages;
    for (int i = 0; i < 8; ++i) {
      stages.emplace_back("ccmatrix", i % 2 ? warm : cool);
      stages.emplace_back("clamp", clamp);
    }
    RegisterTask("pipelines", MakeTask("eight unfoldable", stages), options, /*with_unfolded=*/false);
    RegisterTask("pipelines", MakeTask("matrix 4x4", {{"ccmatrix", NoBlanks(kFull)}}), options,
                 /*with_unfolded=*/false);
  });
}
