// The stage of boxes over codes: what lies beyond the image, and pixels as they are or as floats.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <tuple>
#include <vector>

#include "base/border.h"
#include "base/tile.h"
#include "graph/op.h"
#include "ops/codes.h"
#include "ops/filter/box/codes.h"
#include "ops/filter/codes/integer_sums.h"
#include "ops/filter/lines/extend.h"
#include "ops/filter/window/window.h"

namespace tessera::ops {
namespace {

class BoxOfCodesStage final : public graph::TileStage {
 public:
  BoxOfCodesStage(const BoxParams& p, PixelType codes, const ImageSpec& in)
      : params_(p),
        type_(codes),
        window_(in.data_window),
        x_(p.wrap, 0, in.data_window.width()),
        y_(p.wrap, 0, in.data_window.height()) {}

  Roi InputRoi(int, const Roi& out) const override {
    return base::BorderSource(Footprint(out), window_, params_.wrap);
  }
  graph::TileSize Preferred() const override {
    // Every tile sums the rows of its first window anew.
    return {1024, std::clamp(8 * params_.height, 128, 512)};
  }
  bool Accepts(PixelType type) const override { return type == PixelType::kFloat || type == type_; }
  void Run(const graph::TileArgs& args) const override {
    if (args.out.roi.empty()) return;
    type_ == PixelType::kUint8 ? RunOn<uint8_t>(args) : RunOn<uint16_t>(args);
  }

 private:
  Roi Footprint(const Roi& out) const {
    const int left = (params_.width - 1) / 2, top = (params_.height - 1) / 2;
    return {out.x0 - left, out.y0 - top, out.x1 - left + params_.width - 1,
            out.y1 - top + params_.height - 1};
  }

  // Codes in place of floats, of the result's channels.
  template <class T>
  ConstImageView CodesOf(const graph::TileArgs& args) const {
    const ConstImageView& in = args.in[0];
    const ImageView codes = base::NewTile(args.scratch, in.roi, args.out.channels, type_);
    const std::span<ptrdiff_t> from(args.scratch.Allocate<ptrdiff_t>(args.channels.size()),
                                    args.channels.size());
    const auto& held = args.in_channels[0];
    std::transform(args.channels.begin(), args.channels.end(), from.begin(),
                   [&](int c) { return std::find(held.begin(), held.end(), c) - held.begin(); });
    const bool same =
        from.size() == static_cast<size_t>(in.channels) && std::is_sorted(from.begin(), from.end());
    const auto largest = static_cast<float>(IntegerSums::Largest(type_));
    // Floats of codes are so near to them that one half more and the whole part is the code.
    const auto code = [largest](float v) { return static_cast<T>(static_cast<int>(v * largest + 0.5f)); };
    for (int y = in.roi.y0; y < in.roi.y1; ++y) {
      const auto* p = reinterpret_cast<const float*>(in.At(in.roi.x0, y));
      auto* const to = reinterpret_cast<T*>(codes.At(in.roi.x0, y));
      if (same) {
        const ptrdiff_t count = ptrdiff_t{in.roi.width()} * in.channels;
        for (ptrdiff_t i = 0; i < count; ++i) to[i] = code(p[i]);
        continue;
      }
      for (int x = 0; x < in.roi.width(); ++x, p += in.channels) {
        for (size_t c = 0; c < from.size(); ++c)
          to[static_cast<size_t>(x) * from.size() + c] = code(p[from[c]]);
      }
    }
    return codes;
  }

  template <class T>
  void RunOn(const graph::TileArgs& args) const {
    const Roi& o = args.out.roi;
    const ConstImageView in = args.out.type == type_ ? args.in[0] : CodesOf<T>(args);
    const auto value = static_cast<T>(std::lround(params_.border_value * IntegerSums::Largest(type_)));
    // What lies beyond the image where that is one value.
    const ptrdiff_t samples = ptrdiff_t{Footprint(o).width()} * in.channels + base::kReadMargin;
    T* const beyond = args.scratch.Allocate<T>(static_cast<size_t>(samples));
    std::fill_n(beyond, samples, value);
    const int before = (params_.width - 1) / 2, after = params_.width - 1 - before;
    const int inner0 = std::clamp(window_.x0 + before, o.x0, o.x1),
              inner1 = std::clamp(window_.x1 - after, inner0, o.x1);
    for (const auto& [x0, x1] : {std::pair{o.x0, inner0}, {inner0, inner1}, {inner1, o.x1}}) {
      if (x0 == x1) continue;
      RunPart<T>(args, in, {x0, o.y0, x1, o.y1}, beyond, value);
    }
  }

  template <class T>
  void RunPart(const graph::TileArgs& args, const ConstImageView& in, const Roi& part, const T* beyond,
               T value) const {
    const Roi seen = Footprint(part);
    const bool inside = seen.x0 >= window_.x0 && seen.x1 <= window_.x1;
    const ConstImageView from = inside ? in : Extended(args.scratch, in, seen, value);
    const T** const lines = args.scratch.Allocate<const T*>(static_cast<size_t>(seen.height()));
    for (int y = seen.y0; y < seen.y1; ++y) {
      const int n = y_.Shown(y - window_.y0);
      lines[y - seen.y0] =
          n < 0 ? beyond
                : reinterpret_cast<const T*>(from.At(inside ? seen.x0 : from.roi.x0, window_.y0 + n));
    }
    const BoxTile<T> tile{.lines = lines,
                          .samples = part.width() * in.channels,
                          .rows = part.height(),
                          .channels = in.channels,
                          .width = params_.width,
                          .height = params_.height};
    std::byte* const out = args.out.At(part.x0, part.y0);
    const auto& functions = std::get<BoxFunctions<T>>(functions_);
    if (args.out.type == type_) {
      BoxMeans(functions, tile, reinterpret_cast<T*>(out), args.out.row_stride / ptrdiff_t{sizeof(T)},
               args.scratch);
    } else {
      BoxMeans(functions, tile, reinterpret_cast<float*>(out), args.out.row_stride / ptrdiff_t{sizeof(float)},
               args.scratch);
    }
  }

  // Lines that reach beyond the image's sides.
  template <class T>
  ConstImageView Extended(base::Arena& scratch, const ConstImageView& in, const Roi& seen, T value) const {
    const ImageView extended =
        base::NewTile(scratch, {seen.x0, in.roi.y0, seen.x1, in.roi.y1}, in.channels, type_);
    const auto channels = static_cast<size_t>(in.channels);
    for (int x = seen.x0; x < seen.x1; ++x) {
      const int n = x_.Shown(x - window_.x0);
      for (int y = in.roi.y0; y < in.roi.y1; ++y) {
        auto* const to = reinterpret_cast<T*>(extended.At(x, y));
        if (n < 0) {
          std::fill_n(to, channels, value);
        } else {
          std::memcpy(to, in.At(window_.x0 + n, y), channels * sizeof(T));
        }
      }
    }
    return extended;
  }

  BoxParams params_;
  PixelType type_;
  Roi window_;
  AxisBorder x_, y_;
  std::tuple<BoxFunctions<uint8_t>, BoxFunctions<uint16_t>> functions_{ChooseByteBoxes(), ChooseWordBoxes()};
};

}  // namespace

bool SumsBoxOfCodes(const BoxParams& p, PixelType type) {
  return IntegerSums::Applies(type) && p.width <= kLargestCodesBox && p.height <= kLargestCodesBox &&
         p.wrap != Wrap::kRenormalize && (p.wrap != Wrap::kBlack || IsCode(p.border_value, type));
}

std::unique_ptr<graph::TileStage> MakeBoxOfCodesStage(const BoxParams& params, PixelType codes,
                                                      const ImageSpec& in) {
  return std::make_unique<BoxOfCodesStage>(params, codes, in);
}

}  // namespace tessera::ops
