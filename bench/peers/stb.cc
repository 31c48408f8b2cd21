// stb_image_resize2 as a peer of resizing, compiled for AVX2 and FMA, its samplers built beforehand, its own
// splits on the threads.
#include "contestant.h"

#if defined(TESSERA_BENCH_STB)

#include <stb/stb_image_resize2.h>

#include <memory>
#include <optional>
#include <string>

#include "tessera/error.h"
#include "workers.h"

namespace tessera::bench {
namespace {

class Stb final : public Contestant {
 public:
  Stb(const Setting& setting, stbir_filter filter)
      : input_(setting.frame.inputs[0]), output_(setting.frame.output), workers_(setting.threads) {
    const ImageView in = input_.view(), out = output_.view();
    stbir_resize_init(&resize_, in.data, in.roi.width(), in.roi.height(), static_cast<int>(in.row_stride),
                      out.data, out.roi.width(), out.roi.height(), static_cast<int>(out.row_stride),
                      STBIR_4CHANNEL, STBIR_TYPE_FLOAT);
    stbir_set_filters(&resize_, filter, filter);
    splits_ = stbir_build_samplers_with_splits(&resize_, setting.threads);
    if (splits_ < 1) throw Error("stb_image_resize2", "refuses to resize");
  }
  ~Stb() override { stbir_free_samplers(&resize_); }
  std::string Name() const override { return "stb_image_resize2"; }
  void Run() override {
    workers_.Run([this](int i) {
      if (i < splits_) stbir_resize_extended_split(&resize_, i, 1);
    });
  }

 private:
  Image input_, output_;
  STBIR_RESIZE resize_;
  int splits_ = 0;
  Workers workers_;
};

std::optional<stbir_filter> FilterOf(const std::string& name) {
  if (name == "box") return STBIR_FILTER_BOX;
  if (name == "triangle") return STBIR_FILTER_TRIANGLE;
  if (name == "mitchell") return STBIR_FILTER_MITCHELL;
  return std::nullopt;
}

}  // namespace

std::unique_ptr<Contestant> MakeStb(const Setting& setting) {
  if (setting.frame.type != PixelType::kFloat || setting.task.steps.size() != 1) return nullptr;
  const Step& step = setting.task.steps[0];
  if (step.op() != "resize" || !__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    return nullptr;
  const auto filter = FilterOf(step.arguments.Text("filter"));
  return filter ? std::make_unique<Stb>(setting, *filter) : nullptr;
}

}  // namespace tessera::bench

#else

namespace tessera::bench {
std::unique_ptr<Contestant> MakeStb(const Setting&) { return nullptr; }
}  // namespace tessera::bench

#endif
