// Compositing of two premultiplied pictures beside OpenImageIO, pixman and OpenCV, and beside what memory
// allows: two images read, one written.
#include <string>

#include "harness.h"
#include "tessera/ops/color.h"
#include "tessera/render.h"

namespace {

// Noise whose colours are at most alpha.
tessera::Image Premultiplied(int width, int height, tessera::PixelType type, size_t index) {
  const tessera::Image noise = tessera::bench::MakeInput(width, height, type, index + 1);
  return tessera::Render(tessera::Premultiply(tessera::FromImage(noise)), type);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](const Options& options) {
    const auto add = [&](const std::string& name, const std::string& op, const std::string& example) {
      Task task = MakeTask(name, {{op, example}});
      task.make_input = Premultiplied;
      RegisterTask("composite", task, options, /*with_unfolded=*/false);
    };
    add("over", "over", "");
    add("zover", "zover", "depth=2");
    for (const char* mode : {"in", "xor", "atop", "plus", "multiply", "soft-light", "luminosity"})
      add(mode, "blend", mode);
    add("zcomposite", "zcomposite", "depth=2");
    add("dissolve", "dissolve", "0.4");
    add("add", "add", "");
    add("mul", "mul", "");
    // Noise of depths: no two neighbours are spread alike.
    for (const char* method : {"layers", "gather"}) {
      for (const char* radius : {"8", "32"}) {
        add(std::string("dof-") + method + "-" + radius, "dof",
            std::string("0.8 aperture=1e3 max=") + radius + " method=" + method);
      }
    }
  });
}
