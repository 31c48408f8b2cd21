// Convolution kernels as text: names, sizes, weights.
#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "tessera/ops/filter.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds = {"w1,2,1,2,4,2,1,2,1\n3x3", "w1,1,1", "w0,0,0,0\n2x2"};
  for (const std::string& name : KernelNames()) seeds.push_back("n" + name + "\n5x3");
  return seeds;
}
std::vector<std::string> Words() {
  std::vector<std::string> words = KernelNames();
  words.insert(words.end(), {"x", ",", "\n", "0", "1e38", "-1", "0.5", "65536", "nan", "1e-320"});
  return words;
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const bool named = in.Take<char>() == 'n';
  const std::string text(in.Until('\n')), window(in.Rest());
  fuzz::Try([&] {
    if (!named) {
      fuzz::Modifiers modifiers = {{"kernel", text}};
      if (!window.empty()) modifiers.emplace_back("size", window);
      return fuzz::ApplyTo("convolve", {}, modifiers);
    }
    const Kernel kernel = NamedKernel(text, window);
    fuzz::Require(
        kernel.weights.size() == static_cast<size_t>(kernel.width) * static_cast<size_t>(kernel.height),
        "a kernel of another size than its weights");
    if (kernel.weights.size() < 400) fuzz::RenderSmall(Convolve(fuzz::SmallPicture(), kernel));
  });
  return 0;
}
