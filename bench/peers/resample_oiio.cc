// OpenImageIO as a peer of resampling: resize, warp and st_warp into a destination that is already there.
#include <OpenImageIO/Imath.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <functional>

#include "contestant.h"
#include "tessera/error.h"

namespace tessera::bench {
namespace {

using OIIO::ImageBuf;
namespace iba = OIIO::ImageBufAlgo;

ImageBuf Wrap(const Image& image) {
  const ImageView view = image.view();
  return ImageBuf(OIIO::ImageSpec(view.roi.width(), view.roi.height(), view.channels, OIIO::TypeFloat),
                  view.data);
}

class OiioResample final : public Contestant {
 public:
  using Call = std::function<bool(ImageBuf& dst, const std::vector<ImageBuf>& in, int threads)>;
  OiioResample(const Setting& setting, Call call)
      : threads_(setting.threads), call_(std::move(call)), output_(Wrap(setting.frame.output)) {
    for (const Image& image : setting.frame.inputs) inputs_.push_back(Wrap(image));
  }
  std::string Name() const override { return "OpenImageIO"; }
  void Prepare() override { OIIO::attribute("threads", threads_); }
  void Run() override {
    if (!call_(output_, inputs_, threads_)) throw Error("OpenImageIO", output_.geterror());
  }

 private:
  int threads_;
  Call call_;
  std::vector<ImageBuf> inputs_;
  ImageBuf output_;
};

}  // namespace

std::unique_ptr<Contestant> MakeOiioResample(const Setting& setting) {
  if (setting.frame.type != PixelType::kFloat || setting.task.steps.size() != 1) return nullptr;
  const Step& step = setting.task.steps[0];
  const auto make = [&](OiioResample::Call call) {
    return std::make_unique<OiioResample>(setting, std::move(call));
  };
  if (step.op() != "resize" && step.op() != "warp" && step.op() != "st_warp") return nullptr;
  const std::string filter = step.arguments.Text("filter");
  if (step.op() == "resize") {
    return make(
        [filter](ImageBuf& d, const auto& in, int n) { return iba::resize(d, in[0], filter, 0, {}, n); });
  }
  if (step.op() == "st_warp") {
    return make([filter](ImageBuf& d, const auto& in, int n) {
      return iba::st_warp(d, in[0], in[1], filter, 0, 0, 1, false, false, {}, n);
    });
  }
  const std::vector<double> v = step.Positional(0);
  Imath::M33f m;
  for (int i = 0; i < 9; ++i) m[i / 3][i % 3] = static_cast<float>(v[static_cast<size_t>(i)]);
  return make([filter, m](ImageBuf& d, const auto& in, int n) {
    return iba::warp(d, in[0], m, filter, 0, false, ImageBuf::WrapBlack, {}, n);
  });
}

}  // namespace tessera::bench
