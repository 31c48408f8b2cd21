// zimg as a peer of resizing: four planes of floats, which is its layout; the frame's pixels are dealt to
// planes and gathered from them outside the measured time. Two threads take two planes each.
#include "contestant.h"

#if defined(TESSERA_BENCH_ZIMG)

#include <zimg.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tessera/error.h"
#include "workers.h"

namespace tessera::bench {
namespace {

constexpr size_t kPlanes = 4;

[[noreturn]] void Fail() {
  char text[256] = "";
  zimg_get_last_error(text, sizeof text);
  throw Error("zimg", text);
}

zimg_image_format FormatOf(const Roi& roi) {
  zimg_image_format format;
  zimg_image_format_default(&format, ZIMG_API_VERSION);
  format.width = static_cast<unsigned>(roi.width());
  format.height = static_cast<unsigned>(roi.height());
  format.pixel_type = ZIMG_PIXEL_FLOAT;
  return format;
}

// Rows begin at multiples of 64 bytes, as zimg wants them.
struct Planes {
  explicit Planes(const Roi& roi)
      : width(static_cast<size_t>(roi.width())),
        height(static_cast<size_t>(roi.height())),
        stride((width + 15) / 16 * 16) {
    for (Image& plane : data) plane = Image(ImageSpec(static_cast<int>(stride), roi.height(), 1));
  }
  float* Row(size_t plane, size_t y) const {
    return reinterpret_cast<float*>(data[plane].view().data) + y * stride;
  }
  size_t width, height, stride;
  std::array<Image, kPlanes> data;
};

class Zimg final : public Contestant {
 public:
  Zimg(const Setting& setting, const zimg_graph_builder_params& params)
      : output_(setting.frame.output),
        from_(setting.frame.inputs[0].spec().data_window),
        to_(output_.spec().data_window),
        workers_(setting.threads) {
    const ConstImageView in = setting.frame.inputs[0].view();
    for (size_t y = 0; y < from_.height; ++y) {
      const auto* row = reinterpret_cast<const float*>(in.data + static_cast<ptrdiff_t>(y) * in.row_stride);
      for (size_t x = 0; x < from_.width * kPlanes; ++x) from_.Row(x % kPlanes, y)[x / kPlanes] = row[x];
    }
    const zimg_image_format source = FormatOf(setting.frame.inputs[0].spec().data_window),
                            sink = FormatOf(output_.spec().data_window);
    for (int i = 0; i < setting.threads; ++i) {
      graphs_.emplace_back(zimg_filter_graph_build(&source, &sink, &params), zimg_filter_graph_free);
      size_t bytes = 0;
      if (!graphs_.back() ||
          zimg_filter_graph_get_tmp_size(graphs_.back().get(), &bytes) != ZIMG_ERROR_SUCCESS)
        Fail();
      scratch_.emplace_back(ImageSpec(static_cast<int>(bytes / sizeof(float)) + 16, 1, 1));
    }
  }
  std::string Name() const override {
    unsigned version[3];
    zimg_get_version_info(version, version + 1, version + 2);
    return "zimg " + std::to_string(version[0]) + "." + std::to_string(version[1]) + "." +
           std::to_string(version[2]) + " planar";
  }
  void Run() override {
    workers_.Run([this](int i) {
      const auto thread = static_cast<size_t>(i), threads = static_cast<size_t>(workers_.count());
      for (size_t p = thread; p < kPlanes; p += threads) {
        zimg_image_buffer_const source = {ZIMG_API_VERSION, {}};
        zimg_image_buffer sink = {ZIMG_API_VERSION, {}};
        source.plane[0] = {from_.Row(p, 0), static_cast<ptrdiff_t>(from_.stride * sizeof(float)),
                           ZIMG_BUFFER_MAX};
        sink.plane[0] = {to_.Row(p, 0), static_cast<ptrdiff_t>(to_.stride * sizeof(float)), ZIMG_BUFFER_MAX};
        if (zimg_filter_graph_process(graphs_[thread].get(), &source, &sink, scratch_[thread].view().data,
                                      nullptr, nullptr, nullptr, nullptr) != ZIMG_ERROR_SUCCESS)
          Fail();
      }
    });
  }
  void Finish() override {
    const ImageView out = output_.view();
    for (size_t y = 0; y < to_.height; ++y) {
      auto* row = reinterpret_cast<float*>(out.data + static_cast<ptrdiff_t>(y) * out.row_stride);
      for (size_t x = 0; x < to_.width * kPlanes; ++x) row[x] = to_.Row(x % kPlanes, y)[x / kPlanes];
    }
  }

 private:
  Image output_;
  Planes from_, to_;
  std::vector<std::unique_ptr<zimg_filter_graph, void (*)(zimg_filter_graph*)>> graphs_;
  std::vector<Image> scratch_;
  Workers workers_;
};

std::optional<zimg_graph_builder_params> ParamsOf(const std::string& filter) {
  zimg_graph_builder_params params;
  zimg_graph_builder_params_default(&params, ZIMG_API_VERSION);
  if (filter == "lanczos3") {
    params.resample_filter = ZIMG_RESIZE_LANCZOS;
    params.filter_param_a = 3;
  } else if (filter == "mitchell") {
    params.resample_filter = ZIMG_RESIZE_BICUBIC;
    params.filter_param_a = params.filter_param_b = 1.0 / 3;
  } else if (filter == "triangle") {
    params.resample_filter = ZIMG_RESIZE_BILINEAR;
  } else {
    return std::nullopt;
  }
  return params;
}

}  // namespace

std::unique_ptr<Contestant> MakeZimg(const Setting& setting) {
  if (setting.frame.type != PixelType::kFloat || setting.task.steps.size() != 1) return nullptr;
  const Step& step = setting.task.steps[0];
  if (step.op() != "resize") return nullptr;
  const auto params = ParamsOf(step.arguments.Text("filter"));
  return params ? std::make_unique<Zimg>(setting, *params) : nullptr;
}

}  // namespace tessera::bench

#else

namespace tessera::bench {
std::unique_ptr<Contestant> MakeZimg(const Setting&) { return nullptr; }
}  // namespace tessera::bench

#endif
