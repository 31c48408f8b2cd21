// Order statistics of a window: median, largest, smallest sample. Pixels beyond the image take no part.
#include "ops/filter/rank.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "base/tile.h"
#include "graph/op.h"
#include "ops/filter/filter_ops.h"
#include "tessera/error.h"
#include "tessera/ops/filter.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/rank.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::DI;
using s::V;
using s::VI;

constexpr int kLanes = s::kLanes;
constexpr int32_t kLast = std::numeric_limits<int32_t>::max();  // key of NaN, and of pixels that do not exist

// Integers in the order of the floats.
HWY_INLINE VI KeyOf(V v) {
  const DI di;
  const VI bits = hn::BitCast(di, v);
  const VI flipped = hn::Xor(bits, hn::And(hn::BroadcastSignBit(bits), hn::Set(di, kLast)));
  return hn::IfThenElse(hn::RebindMask(di, hn::IsNaN(v)), hn::Set(di, kLast), flipped);
}
HWY_INLINE V FloatOf(VI key) {
  const DI di;
  return hn::BitCast(D(), hn::Xor(key, hn::And(hn::BroadcastSignBit(key), hn::Set(di, kLast))));
}

HWY_INLINE void StorePart(V v, float* p, int count) {
  if (count >= kLanes) return hn::StoreU(v, D(), p);
  HWY_ALIGN float lanes[kLanes];
  hn::Store(v, D(), lanes);
  std::copy_n(lanes, count, p);
}

HWY_INLINE void Sort(VI& a, VI& b) {
  const VI low = hn::Min(a, b);
  b = hn::Max(a, b);
  a = low;
}

// The middle of nine by the well-known 19 exchanges (Paeth, Graphics Gems I).
HWY_INLINE VI MedianOfNine(VI (&p)[9]) {
  Sort(p[1], p[2]), Sort(p[4], p[5]), Sort(p[7], p[8]);
  Sort(p[0], p[1]), Sort(p[3], p[4]), Sort(p[6], p[7]);
  Sort(p[1], p[2]), Sort(p[4], p[5]), Sort(p[7], p[8]);
  Sort(p[0], p[3]), Sort(p[5], p[8]), Sort(p[4], p[7]);
  Sort(p[3], p[6]), Sort(p[1], p[4]), Sort(p[2], p[5]);
  Sort(p[4], p[7]), Sort(p[4], p[2]), Sort(p[6], p[4]);
  Sort(p[4], p[2]);
  return p[4];
}

// The sample of the wanted rank, bit by bit from the top: the largest key that no more than `rank` keys are
// below.
HWY_INLINE VI Select(const float* in, ptrdiff_t stride, int width, int height, int channels, VI rank) {
  const DI di;
  const VI sign = hn::Set(di, std::numeric_limits<int32_t>::min());
  VI found = hn::Zero(di);
  for (int bit = 31; bit >= 0; --bit) {
    const VI trial = hn::Or(found, hn::Set(di, static_cast<int32_t>(uint32_t{1} << bit)));
    const VI limit = hn::Xor(trial, sign);
    VI below = hn::Zero(di);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const VI key = hn::LoadU(di, reinterpret_cast<const int32_t*>(in + y * stride + x * channels));
        below = hn::Sub(below, hn::VecFromMask(di, hn::Lt(key, limit)));
      }
    }
    // VecFromMask is -1 where true.
    found = hn::IfThenElse(hn::Gt(below, rank), found, trial);
  }
  return hn::Xor(found, sign);
}

void Median(const RankTile& t, int width, int height) {
  const DI di;
  for (int y = 0; y < t.rows; ++y) {
    for (int x = 0; x < t.samples; x += kLanes) {
      const float* in = t.in + y * t.in_stride + x;
      const VI inside = hn::Mul(hn::LoadU(di, t.columns_inside + x), hn::Set(di, t.rows_inside[y]));
      VI key;
      if (width == 3 && height == 3 && hn::AllTrue(di, hn::Eq(inside, hn::Set(di, 9)))) {
        VI p[9];
        for (int i = 0; i < 9; ++i) {
          p[i] =
              hn::LoadU(di, reinterpret_cast<const int32_t*>(in + i / 3 * t.in_stride + i % 3 * t.channels));
        }
        key = MedianOfNine(p);
      } else {
        key = Select(in, t.in_stride, width, height, t.channels, hn::ShiftRight<1>(inside));
      }
      const V v =
          hn::IfThenElse(hn::RebindMask(D(), hn::Eq(key, hn::Set(di, kLast))), hn::NaN(D()), FloatOf(key));
      StorePart(v, t.out + y * t.out_stride + x, t.samples - x);
    }
  }
}

void ToKeys(float* samples, int count) {
  for (int i = 0; i < count; i += kLanes) {
    hn::StoreU(hn::BitCast(D(), KeyOf(hn::LoadU(D(), samples + i))), D(), samples + i);
  }
}

// In place: sample i becomes the extreme of itself and the one `step` further, over `count` samples.
template <bool kLargest>
HWY_INLINE void Spread(float* p, ptrdiff_t step, ptrdiff_t count) {
  for (ptrdiff_t i = 0; i < count; i += kLanes) {
    const V a = hn::LoadU(D(), p + i), b = hn::LoadU(D(), p + i + step);
    hn::StoreU(kLargest ? s::MaxNumber(a, b) : s::MinNumber(a, b), D(), p + i);
  }
}

// Windows of 1, 2, 4, ... and at last `size` samples, `unit` apart.
template <bool kLargest>
void Grow(float* p, int size, ptrdiff_t unit, ptrdiff_t count) {
  int have = 1;
  for (; 2 * have <= size; have *= 2) Spread<kLargest>(p, have * unit, count - have * unit);
  if (have < size) Spread<kLargest>(p, (size - have) * unit, count - (size - have) * unit);
}

template <bool kLargest>
void Extreme(const RankTile& t, int width, int height, float* work) {
  // Rows first, each on its own, then all columns at once.
  const ptrdiff_t rows = t.rows + height - 1;
  for (ptrdiff_t y = 0; y < rows; ++y) {
    Grow<kLargest>(work + y * t.in_stride, width, t.channels, t.samples + ptrdiff_t{width - 1} * t.channels);
  }
  for (ptrdiff_t x = 0; x < t.samples; x += kLanes) {
    int have = 1;
    const auto spread = [&](int step) HWY_ATTR {
      for (ptrdiff_t y = 0; y + step < rows; ++y) {
        float* p = work + y * t.in_stride + x;
        const V a = hn::LoadU(D(), p), b = hn::LoadU(D(), p + step * t.in_stride);
        hn::StoreU(kLargest ? s::MaxNumber(a, b) : s::MinNumber(a, b), D(), p);
      }
    };
    for (; 2 * have <= height; have *= 2) spread(have);
    if (have < height) spread(height - have);
    for (int y = 0; y < t.rows; ++y) {
      StorePart(hn::LoadU(D(), work + y * t.in_stride + x), t.out + y * t.out_stride + x,
                static_cast<int>(t.samples - x));
    }
  }
}

void RunRank(RankKind kind, const RankTile& t, int width, int height, float* work, int work_samples) {
  if (kind == RankKind::kMedian) {
    ToKeys(work, work_samples);
    return Median(t, width, height);
  }
  return kind == RankKind::kDilate ? Extreme<true>(t, width, height, work)
                                   : Extreme<false>(t, width, height, work);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(RunRank);

constexpr int kLargestWindow = 255;

class RankStage final : public graph::TileStage {
 public:
  RankStage(RankKind kind, const RankParams& p, const Roi& window)
      : run_(&HWY_DYNAMIC_DISPATCH(RunRank)), kind_(kind), params_(p), window_(window) {}
  Roi InputRoi(int, const Roi& out) const override { return Intersection(Footprint(out), window_); }
  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    const Roi needed = Footprint(o), inside = Intersection(needed, window_);
    const int channels = args.out.channels;
    // Room for whole vectors behind the last sample of every row.
    const ptrdiff_t stride = (static_cast<ptrdiff_t>(needed.width()) * channels + 47) / 16 * 16;
    const ptrdiff_t count = stride * needed.height();
    float* work = args.scratch.Allocate<float>(static_cast<size_t>(count) + 16);
    std::fill_n(work, count + 16, std::numeric_limits<float>::quiet_NaN());
    for (int y = inside.y0; y < inside.y1; ++y) {
      std::copy_n(reinterpret_cast<const float*>(args.in[0].At(inside.x0, y)),
                  static_cast<ptrdiff_t>(inside.width()) * channels,
                  work + (y - needed.y0) * stride + static_cast<ptrdiff_t>(inside.x0 - needed.x0) * channels);
    }
    int32_t* columns = args.scratch.Allocate<int32_t>(static_cast<size_t>(o.width() * channels) + 16);
    int32_t* rows = args.scratch.Allocate<int32_t>(static_cast<size_t>(o.height()));
    std::fill_n(columns, o.width() * channels + 16, params_.width);
    for (int x = o.x0; x < o.x1; ++x) {
      const Roi f = Intersection(Footprint({x, o.y0, x + 1, o.y0 + 1}), window_);
      std::fill_n(columns + (x - o.x0) * channels, channels, f.width());
    }
    for (int y = o.y0; y < o.y1; ++y) {
      rows[y - o.y0] = Intersection(Footprint({o.x0, y, o.x0 + 1, y + 1}), window_).height();
    }
    const RankTile tile{work,
                        stride,
                        reinterpret_cast<float*>(args.out.data),
                        args.out.row_stride / 4,
                        o.width() * channels,
                        o.height(),
                        channels,
                        columns,
                        rows};
    run_(kind_, tile, params_.width, params_.height, work, static_cast<int>(count));
  }

 private:
  Roi Footprint(const Roi& out) const {
    const int left = params_.width / 2, top = params_.height / 2;
    return {out.x0 - left, out.y0 - top, out.x1 - left + params_.width - 1,
            out.y1 - top + params_.height - 1};
  }
  void (*run_)(RankKind, const RankTile&, int, int, float*, int);
  RankKind kind_;
  RankParams params_;
  Roi window_;
};

class RankOp final : public graph::OpWith<RankParams> {
 public:
  RankOp(const char* name, RankKind kind, const RankParams& p) : OpWith(p), name_(name), kind_(kind) {
    if (p.width < 1 || p.height < 1 || p.width > kLargestWindow || p.height > kLargestWindow) {
      throw Error(name, "found a window of " + std::to_string(p.width) + "x" + std::to_string(p.height) +
                            ", expected 1x1 to 255x255");
    }
  }
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  std::string Describe() const override {
    return std::string(name_) + " " + std::to_string(params().width) + "x" + std::to_string(params().height);
  }
  bool IsIdentity() const override { return params().width == 1 && params().height == 1; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<RankStage>(kind_, params(), context.inputs[0].data_window);
  }

 private:
  const char* name_;
  RankKind kind_;
};

Node Ranked(const char* name, RankKind kind, const Node& image, const RankParams& p) {
  return graph::MakeNode(std::make_shared<const RankOp>(name, kind, p), {image});
}

OpInfo RankRow(const char* name, const char* summary, const char* help,
               Node (*make)(std::span<const Node>, const Arguments&, const ImageSpec*)) {
  OpInfo info;
  info.name = name;
  info.family = "filter";
  info.summary = summary;
  info.help = std::string(help) +
              " SIZE is WxH, up to 255x255, each channel for itself; an even window begins half "
              "its size before the pixel. Pixels beyond the image take no part, as oiiotool.";
  info.bound = "exact";
  info.arguments = {{.name = "SIZE", .type = ParamType::kText, .default_value = "", .help = "WxH in pixels"}};
  info.make = make;
  info.examples = {"3x3", "5x2", "9x7"};
  info.identity = "1x1";
  return info;
}
RankParams SizeOf(const char* name, const Arguments& a) {
  const auto [width, height] = ParseSize(name, a.Text("SIZE"));
  if (width != static_cast<int>(width) || height != static_cast<int>(height)) {
    throw Error(name, "found the size '" + a.Text("SIZE") + "', expected whole numbers");
  }
  return {static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace

OpInfo MedianInfo() {
  return RankRow(
      "median", "The middle sample of a window",
      "Of an even number of samples the upper one of the middle two; NaN ranks above every number.",
      [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
        return Median(in[0], SizeOf("median", a));
      });
}
OpInfo DilateInfo() {
  return RankRow("dilate", "The largest sample of a window", "Numbers win over NaN.",
                 [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
                   return Dilate(in[0], SizeOf("dilate", a));
                 });
}
OpInfo ErodeInfo() {
  return RankRow("erode", "The smallest sample of a window", "Numbers win over NaN.",
                 [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
                   return Erode(in[0], SizeOf("erode", a));
                 });
}

}  // namespace tessera::ops

namespace tessera {

Node Median(const Node& image, const RankParams& p) {
  return ops::Ranked("median", ops::RankKind::kMedian, image, p);
}
Node Dilate(const Node& image, const RankParams& p) {
  return ops::Ranked("dilate", ops::RankKind::kDilate, image, p);
}
Node Erode(const Node& image, const RankParams& p) {
  return ops::Ranked("erode", ops::RankKind::kErode, image, p);
}

}  // namespace tessera
#endif  // HWY_ONCE
