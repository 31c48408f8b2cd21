// Convolutions and blurs beside OpenCV and OpenImageIO, and the ways to a Gaussian: error against time.
#include <string>

#include "harness.h"

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](Options options) {
    // Peers differ in what they do with other types; the comparison is of float pixels.
    options.types = {tessera::PixelType::kFloat};
    const auto add = [&](const std::string& name, const std::string& op, const std::string& example) {
      RegisterTask("filter", MakeTask(name, {{op, example}}), options, /*with_unfolded=*/false);
    };
    add("3x3", "convolve", "kernel=highpass3");
    add("5x5", "convolve", "kernel=smooth5_course");
    add("7x7", "convolve", "kernel=radial-lanczos3 size=7x7");
    add("15x15 Gaussian", "blur", "15x15");
    add("31x31 Gaussian", "blur", "31x31");
    add("31x31", "convolve", "kernel=radial-lanczos3 size=31x31");
    add("box 41x41", "blur", "41x41 kernel=box");
    for (const char* sigma : {"1", "2", "5", "10", "20", "50", "200"}) {
      add(std::string("Gaussian sigma ") + sigma, "blur", std::string("method=direct sigma=") + sigma);
    }
  });
}
