// libvips as a peer of reductions: vips_reduce on an image in memory.
#include "contestant.h"

#if defined(TESSERA_BENCH_VIPS)

#include <vips/vips.h>

#include <string>

#include "tessera/error.h"

namespace tessera::bench {
namespace {

class Vips final : public Contestant {
 public:
  Vips(const Setting& setting, VipsKernel kernel) : setting_(setting), kernel_(kernel) {
    static const bool started = VIPS_INIT("bench") == 0;
    if (!started) throw Error("libvips", vips_error_buffer());
  }
  std::string Name() const override { return std::string("libvips ") + vips_version_string(); }
  void Prepare() override {
    vips_concurrency_set(setting_.threads);
    vips_cache_set_max(0);  // every run computes
  }
  void Run() override {
    const ImageView in = setting_.frame.inputs[0].view(), out = setting_.frame.output.view();
    const auto bytes = static_cast<size_t>(in.row_stride) * static_cast<size_t>(in.roi.height());
    VipsImage* const source = vips_image_new_from_memory(in.data, bytes, in.roi.width(), in.roi.height(),
                                                         in.channels, VIPS_FORMAT_FLOAT);
    const size_t wanted = static_cast<size_t>(out.row_stride) * static_cast<size_t>(out.roi.height());
    // Computed into the pixels that are there, without a copy.
    VipsImage* const target = vips_image_new_from_memory(out.data, wanted, out.roi.width(), out.roi.height(),
                                                         out.channels, VIPS_FORMAT_FLOAT);
    VipsImage* reduced = nullptr;
    const double x = static_cast<double>(in.roi.width()) / out.roi.width();
    const double y = static_cast<double>(in.roi.height()) / out.roi.height();
    const bool done = source != nullptr && target != nullptr &&
                      vips_reduce(source, &reduced, x, y, "kernel", kernel_, nullptr) == 0 &&
                      vips_image_write(reduced, target) == 0;
    for (VipsImage* image : {source, reduced, target}) {
      if (image != nullptr) g_object_unref(image);
    }
    if (!done) throw Error("libvips", vips_error_buffer());
  }

 private:
  const Setting setting_;
  VipsKernel kernel_;
};

}  // namespace

std::unique_ptr<Contestant> MakeVips(const Setting& setting) {
  if (setting.frame.type != PixelType::kFloat || setting.task.steps.size() != 1) return nullptr;
  const Step& step = setting.task.steps[0];
  if (step.op() != "resize") return nullptr;
  const std::string& filter = step.arguments.Text("filter");
  if (filter == "lanczos3") return std::make_unique<Vips>(setting, VIPS_KERNEL_LANCZOS3);
  if (filter == "mitchell") return std::make_unique<Vips>(setting, VIPS_KERNEL_MITCHELL);
  return nullptr;
}

}  // namespace tessera::bench

#else

namespace tessera::bench {
std::unique_ptr<Contestant> MakeVips(const Setting&) { return nullptr; }
}  // namespace tessera::bench

#endif
