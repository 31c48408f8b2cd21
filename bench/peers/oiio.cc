// OpenImageIO's ImageBufAlgo as a peer: one call per operation into a destination that is already there,
// which is how its users chain operations today.
#include <OpenImageIO/Imath.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <functional>
#include <map>

#include "contestant.h"
#include "peers/peers.h"
#include "tessera/error.h"

namespace tessera::bench {
namespace {

using OIIO::ImageBuf;
namespace iba = OIIO::ImageBufAlgo;

OIIO::TypeDesc TypeOf(PixelType type) {
  switch (type) {
    case PixelType::kUint8:
      return OIIO::TypeUInt8;
    case PixelType::kUint16:
      return OIIO::TypeUInt16;
    case PixelType::kHalf:
      return OIIO::TypeHalf;
    default:
      return OIIO::TypeFloat;
  }
}

// The frame's own pixels, not a copy of them.
ImageBuf Wrap(const Image& image) {
  const ImageView view = image.view();
  OIIO::ImageSpec spec(view.roi.width(), view.roi.height(), view.channels, TypeOf(view.type));
  spec.alpha_channel = 3;
  return ImageBuf(spec, view.data);
}

// One call: reads `in` (input 0 is the chain's value so far), writes `dst`, which may be in[0].
using Call = std::function<bool(ImageBuf& dst, const std::vector<const ImageBuf*>& in, int threads)>;

std::vector<float> Floats(const std::vector<double>& v) { return {v.begin(), v.end()}; }

// One number means every channel, as in the library.
std::vector<float> PerChannel(const std::vector<double>& v) {
  return v.size() == 1 ? std::vector<float>(4, static_cast<float>(v[0])) : Floats(v);
}

std::vector<Call> AffineCalls(const Step::Affine& affine) {
  std::vector<Call> calls;
  if (affine.diagonal()) {
    std::vector<float> scale, bias;
    bool scales = false;
    for (int c = 0; c < 4; ++c) {
      scale.push_back(static_cast<float>(affine.m[c][c]));
      bias.push_back(static_cast<float>(affine.m[c][4]));
      scales |= affine.m[c][c] != 1;
    }
    if (scales && affine.has_bias()) {
      calls.push_back(
          [=](ImageBuf& dst, const auto& in, int n) { return iba::mad(dst, *in[0], scale, bias, {}, n); });
    } else if (scales) {
      calls.push_back(
          [=](ImageBuf& dst, const auto& in, int n) { return iba::mul(dst, *in[0], scale, {}, n); });
    } else {
      calls.push_back(
          [=](ImageBuf& dst, const auto& in, int n) { return iba::add(dst, *in[0], bias, {}, n); });
    }
    return calls;
  }
  // OpenImageIO multiplies row vectors.
  Imath::M44f m;
  std::vector<float> bias;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) m[c][r] = static_cast<float>(affine.m[r][c]);
    bias.push_back(static_cast<float>(affine.m[r][4]));
  }
  calls.push_back([m](ImageBuf& dst, const auto& in, int n) {
    return iba::colormatrixtransform(dst, *in[0], m, /*unpremult=*/false, {}, n);
  });
  if (affine.has_bias()) {
    calls.push_back(
        [bias](ImageBuf& dst, const auto& in, int n) { return iba::add(dst, *in[0], bias, {}, n); });
  }
  return calls;
}

// The calls of one step; empty when there are none.
std::vector<Call> CallsOf(const Step& step) {
  const std::string& op = step.op();
  if (op == "saturate" && IsRec709(step)) {
    const float s = static_cast<float>(step.Positional(0).at(0));
    return {[s](ImageBuf& dst, const auto& in, int n) { return iba::saturate(dst, *in[0], s, 0, {}, n); }};
  }
  if (step.affine) return AffineCalls(*step.affine);
  static const std::map<std::string, Call> kImages = {
      {"add", [](ImageBuf& d, const auto& in, int n) { return iba::add(d, *in[0], *in[1], {}, n); }},
      {"sub", [](ImageBuf& d, const auto& in, int n) { return iba::sub(d, *in[0], *in[1], {}, n); }},
      {"mul", [](ImageBuf& d, const auto& in, int n) { return iba::mul(d, *in[0], *in[1], {}, n); }},
      {"mad", [](ImageBuf& d, const auto& in, int n) { return iba::mad(d, *in[0], *in[1], *in[2], {}, n); }},
      {"min", [](ImageBuf& d, const auto& in, int n) { return iba::min(d, *in[0], *in[1], {}, n); }},
      {"max", [](ImageBuf& d, const auto& in, int n) { return iba::max(d, *in[0], *in[1], {}, n); }},
      {"absdiff", [](ImageBuf& d, const auto& in, int n) { return iba::absdiff(d, *in[0], *in[1], {}, n); }},
      {"over", [](ImageBuf& d, const auto& in, int n) { return iba::over(d, *in[0], *in[1], {}, n); }},
      {"zover",
       [](ImageBuf& d, const auto& in, int n) {
         // The channel that the task calls depth.
         for (const ImageBuf* image : {in[0], in[1], static_cast<const ImageBuf*>(&d)}) {
           const_cast<ImageBuf*>(image)->specmod().z_channel = 2;
         }
         return iba::zover(d, *in[0], *in[1], false, {}, n);
       }},
      {"abs", [](ImageBuf& d, const auto& in, int n) { return iba::abs(d, *in[0], {}, n); }},
      {"premult", [](ImageBuf& d, const auto& in, int n) { return iba::premult(d, *in[0], {}, n); }},
      {"unpremult", [](ImageBuf& d, const auto& in, int n) { return iba::unpremult(d, *in[0], {}, n); }},
  };
  if (const auto found = kImages.find(op); found != kImages.end()) return {found->second};
  if (op == "clamp") {
    if (const auto range = ClampRange(step)) {
      const std::vector<float> lo = Floats(range->first), hi = Floats(range->second);
      return {
          [=](ImageBuf& d, const auto& in, int n) { return iba::clamp(d, *in[0], lo, hi, false, {}, n); }};
    }
  }
  if (op == "powc") {
    const std::vector<float> exponent = PerChannel(step.Positional(0));
    return {[=](ImageBuf& d, const auto& in, int n) { return iba::pow(d, *in[0], exponent, {}, n); }};
  }
  if (op == "constant") {
    const std::vector<float> color = PerChannel(step.Numbers("color"));
    return {[=](ImageBuf& d, const auto&, int n) { return iba::fill(d, color, {}, n); }};
  }
  if (op == "checker") {
    const std::vector<float> a = PerChannel(step.Numbers("color1")), b = PerChannel(step.Numbers("color2"));
    const std::vector<double> w = step.Numbers("width"), h = step.Numbers("height");
    if (w.empty() || h.empty() || a.size() != 4 || b.size() != 4) return {};
    const int width = static_cast<int>(w[0]), height = static_cast<int>(h[0]);
    return {[=](ImageBuf& d, const auto&, int n) {
      return iba::checker(d, width, height, 1, a, b, 0, 0, 0, {}, n);
    }};
  }
  return {};
}

class Oiio final : public Contestant {
 public:
  Oiio(const Setting& setting, std::vector<Call> calls)
      : threads_(setting.threads), calls_(std::move(calls)), output_(Wrap(setting.frame.output)) {
    for (const Image& image : setting.frame.inputs) inputs_.push_back(Wrap(image));
  }
  std::string Name() const override { return "OpenImageIO"; }
  void Prepare() override { OIIO::attribute("threads", threads_); }
  void Run() override {
    std::vector<const ImageBuf*> in;
    for (const ImageBuf& buffer : inputs_) in.push_back(&buffer);
    for (const Call& call : calls_) {
      if (!call(output_, in, threads_)) throw Error("OpenImageIO", output_.geterror());
      in = {&output_};
    }
  }

 private:
  int threads_;
  std::vector<Call> calls_;
  std::vector<ImageBuf> inputs_;
  ImageBuf output_;
};

}  // namespace

std::unique_ptr<Contestant> MakeOiio(const Setting& setting) {
  if (!setting.frame.plain()) return nullptr;
  std::vector<Call> calls;
  for (const Step& step : setting.task.steps) {
    const std::vector<Call> more = CallsOf(step);
    if (more.empty()) return nullptr;
    calls.insert(calls.end(), more.begin(), more.end());
  }
  return std::make_unique<Oiio>(setting, std::move(calls));
}

}  // namespace tessera::bench
