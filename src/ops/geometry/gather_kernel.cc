// Look-ups in two passes over short runs of pixels: first positions, in double, to indices and fractions; then pixels.
#include <algorithm>
#include <cmath>
#include <vector>

#include "ops/geometry/gather.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/geometry/gather_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/floats-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using F4 = s::Floats<4>;
using F8 = s::Floats<8>;

constexpr int kRun = 64;
using DD = hn::CappedTag<double, 8>;
using DF = hn::Rebind<float, DD>;
using DI = hn::Rebind<int32_t, DD>;
using VD = hn::Vec<DD>;

// Positions further out than this, and NaN, are nowhere.
constexpr double kFarthest = 0x1p40;
// Nearer to a pixel's centre or edge than this is there: whole shifts keep bits, and filters that end abruptly end alike
// on both sides.
constexpr double kSnap = 0x1p-17;

// A run of positions in source indices (pixel i's centre is i) and, where the filter widens, by how much.
struct Positions {
  alignas(64) double x[kRun], y[kRun];
  alignas(64) double wide_x[kRun], wide_y[kRun];
};

// The first tap and the fraction of every pixel of a run.
struct Indices {
  alignas(64) int32_t x[kRun], y[kRun];
  alignas(64) float fx[kRun], fy[kRun];
};

void MatrixPositions(const GatherMap& map, int x0, int y, int count, Positions& p) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const double* const m = map.m;
  const double row = y + 0.5;
  const VD half = hn::Set(d, 0.5), one = hn::Set(d, 1.0);
  // Rows of the matrix are taken once per run: what remains is a multiple of x.
  const VD ax = hn::Set(d, m[0]), bx = hn::Set(d, row * m[3] + m[6]);
  const VD ay = hn::Set(d, m[1]), by = hn::Set(d, row * m[4] + m[7]);
  const VD aq = hn::Set(d, m[2]), bq = hn::Set(d, row * m[5] + m[8]);
  const VD nowhere = hn::Set(d, 2 * kFarthest);
  for (int i = 0; i < count; i += step) {
    const VD x = hn::Add(hn::Iota(d, 0), hn::Set(d, x0 + i + 0.5));
    VD sx = hn::MulAdd(ax, x, bx), sy = hn::MulAdd(ay, x, by);
    VD wide_x = one, wide_y = one;
    if (map.projective) {
      const VD q = hn::MulAdd(aq, x, bq);
      const auto visible = hn::Gt(q, hn::Zero(d));
      const VD over = hn::Div(one, q);
      sx = hn::IfThenElse(visible, hn::Div(sx, q), nowhere);
      sy = hn::IfThenElse(visible, hn::Div(sy, q), nowhere);
      if (map.reduce) {
        const auto steepest = [&](int column, VD at) HWY_ATTR {
          const VD dx = hn::Mul(hn::NegMulAdd(at, aq, hn::Set(d, m[column])), over);
          const VD dy = hn::Mul(hn::NegMulAdd(at, hn::Set(d, m[5]), hn::Set(d, m[3 + column])), over);
          return hn::Max(one, hn::Max(hn::Abs(dx), hn::Abs(dy)));
        };
        wide_x = steepest(0, sx);
        wide_y = steepest(1, sy);
      }
    } else if (map.reduce) {
      wide_x = hn::Set(d, std::max({1.0, std::fabs(m[0]), std::fabs(m[3])}));
      wide_y = hn::Set(d, std::max({1.0, std::fabs(m[1]), std::fabs(m[4])}));
    }
    hn::Store(hn::Sub(sx, half), d, p.x + i);
    hn::Store(hn::Sub(sy, half), d, p.y + i);
    hn::Store(wide_x, d, p.wide_x + i);
    hn::Store(wide_y, d, p.wide_y + i);
  }
}

void ImagePositions(const GatherJob& job, int x0, int y, int count, Positions& p) {
  const GatherMap& map = job.map;
  const auto* at = reinterpret_cast<const float*>(job.coordinates.At(x0, y));
  const double row = map.y_per_pixel * (y + 0.5) + (map.y_offset - 0.5);
  for (int i = 0; i < count; ++i, at += job.coordinates.channels) {
    p.x[i] = map.x_scale * static_cast<double>(at[job.channel_x]) +
             (map.x_per_pixel * (x0 + i + 0.5) + (map.x_offset - 0.5));
    p.y[i] = map.y_scale * static_cast<double>(at[job.channel_y]) + row;
    p.wide_x[i] = p.wide_y[i] = 1;
  }
  for (int i = count; i < (count + 7) / 8 * 8; ++i) p.x[i] = p.y[i] = 0;
}

// One axis of a run: positions are brought back into the image where it repeats, and snapped.
void FindTaps(int origin, int size, Wrap wrap, int taps, int count, double* position, int32_t* first, float* fraction) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const VD low = hn::Set(d, static_cast<double>(origin)), half = hn::Set(d, 0.5);
  const VD farthest = hn::Set(d, kFarthest);
  const double period = wrap == Wrap::kMirror ? 2.0 * size : static_cast<double>(size);
  for (int i = 0; i < count; i += step) {
    VD v = hn::Sub(hn::Load(d, position + i), low);
    const auto somewhere = hn::Lt(hn::Abs(v), farthest);
    if (wrap == Wrap::kRepeat || wrap == Wrap::kMirror) {
      VD edge = hn::Add(v, half);  // distance from the image's edge
      edge = hn::NegMulAdd(hn::Set(d, period), hn::Floor(hn::Mul(edge, hn::Set(d, 1 / period))), edge);
      if (wrap == Wrap::kMirror) edge = hn::Min(edge, hn::Sub(hn::Set(d, period), edge));
      v = hn::Sub(edge, half);
    }
    const VD near = hn::Mul(hn::Round(hn::Add(v, v)), half);
    v = hn::IfThenElse(hn::Lt(hn::Abs(hn::Sub(v, near)), hn::Set(d, kSnap)), near, v);
    // Out of reach of every filter is out of reach, however far.
    const VD reach = hn::Set(d, 0x1p29);
    v = hn::IfThenElse(somewhere, hn::Min(hn::Max(v, hn::Neg(reach)), reach), reach);
    hn::Store(hn::Add(v, low), d, position + i);
    const VD counted = taps % 2 == 1 ? hn::Add(v, half) : v;
    const VD base = hn::Floor(counted);
    const auto f = hn::Min(hn::DemoteTo(DF(), hn::Sub(counted, base)), hn::Set(DF(), 1 - 0x1p-24f));
    hn::Store(f, DF(), fraction + i);
    const auto index = hn::DemoteTo(DI(), hn::Sub(base, hn::Set(d, (taps - 1) / 2)));
    hn::Store(index, DI(), first + i);
  }
}

// An index beyond the image by its wrap mode; -1 for black.
int Wrapped(int64_t i, int size, Wrap wrap) {
  if (i >= 0 && i < size) return static_cast<int>(i);
  switch (wrap) {
    case Wrap::kClamp:
      return i < 0 ? 0 : size - 1;
    case Wrap::kRepeat:
      return static_cast<int>((i % size + size) % size);
    case Wrap::kMirror: {
      const int64_t m = (i % (2 * int64_t{size}) + 2 * int64_t{size}) % (2 * int64_t{size});
      return static_cast<int>(m < size ? m : 2 * int64_t{size} - 1 - m);
    }
    default:
      return -1;
  }
}

// The pixels with weight along one axis, for what the short paths leave: edges, whole positions, reductions.
struct AxisWeights {
  std::vector<int> index;
  std::vector<float> weight;

  // `position` in indices of the image.
  void Find(const GatherSource& source, double position, double wide, int size, Wrap wrap) {
    index.clear(), weight.clear(), exact_.clear();
    wide = std::min(wide, GatherSource::kWidest / source.filter->width);
    const double radius = source.filter->width / 2 * wide;
    const double from = std::ceil(position - radius), to = std::floor(position + radius);
    if (!(std::fabs(position) < 0x1p28) || size == 0) return;
    const bool beyond = to < 0 || from > size - 1;
    if (beyond && wrap == Wrap::kBlack) return;
    // Nearest, where a position half-way between two pixels takes the right one; or nothing but the edge's pixel.
    if ((source.taps == 1 && wide == 1) || (beyond && wrap == Wrap::kClamp)) {
      const int at = Wrapped(static_cast<int64_t>(std::floor(position + 0.5)), size, wrap);
      if (at >= 0) index.push_back(at), weight.push_back(1);
      return;
    }
    double sum = 0;
    const bool fold = to - from >= size;  // pixels are seen more than once: their weights are added
    if (fold) exact_.assign(static_cast<size_t>(size), 0);
    for (double j = from; j <= to; ++j) {
      const double w = wide == 1 ? source.filter->value(j - position) : source.Value((j - position) / wide);
      const int at = Wrapped(static_cast<int64_t>(j), size, wrap);
      if (at >= 0 || !source.renormalize) sum += w;
      if (w == 0 || at < 0) continue;
      if (fold) {
        exact_[static_cast<size_t>(at)] += w;
      } else {
        index.push_back(at), exact_.push_back(w);
      }
    }
    if (sum == 0) {
      index.clear();
      return;
    }
    if (fold) {
      for (int at = 0; at < size; ++at) {
        if (exact_[static_cast<size_t>(at)] != 0) index.push_back(at);
      }
    }
    for (const double w : exact_) {
      if (w != 0) weight.push_back(static_cast<float>(w / sum));
    }
  }

 private:
  std::vector<double> exact_;
};

// Sum over the pixels of both axes, in parts so that very wide filters keep their accuracy.
F4 WeightedPixels(const AxisWeights& x, const AxisWeights& y, const ConstImageView& group) {
  constexpr size_t kPart = 32;
  const auto* const pixels = reinterpret_cast<const float*>(group.data);
  const ptrdiff_t stride = group.row_stride / 4;
  const bool single_x = x.index.size() == 1 && x.weight[0] == 1, single_y = y.index.size() == 1 && y.weight[0] == 1;
  F4 total = F4::Zero();
  for (size_t j0 = 0; j0 < y.index.size(); j0 += kPart) {
    F4 part = F4::Zero();
    for (size_t j = j0; j < std::min(y.index.size(), j0 + kPart); ++j) {
      const float* const row = pixels + stride * y.index[j];
      F4 line = F4::Zero();
      for (size_t i0 = 0; i0 < x.index.size(); i0 += kPart) {
        F4 piece = F4::Scaled(row + ptrdiff_t{4} * x.index[i0], x.weight[i0]);
        for (size_t i = i0 + 1; i < std::min(x.index.size(), i0 + kPart); ++i) {
          piece.AddScaled(row + ptrdiff_t{4} * x.index[i], x.weight[i]);
        }
        line = i0 == 0 ? piece : line + piece;
      }
      if (single_x && single_y) return line;  // the pixel's own bits, -0 too
      if (j == j0) {
        part = line * y.weight[j];
      } else {
        part.AddScaled(line, y.weight[j]);
      }
    }
    total = j0 == 0 ? part : total + part;
  }
  return total;
}

// Weights at a fraction, from the table.
HWY_INLINE void TableWeights(const GatherSource& source, float fraction, float* w) {
  const float at = fraction * GatherSource::kPhases;
  const int i = static_cast<int>(at);
  const float f = at - static_cast<float>(i);
  const float* const row = &source.phase_weights[static_cast<size_t>(i) * source.taps];
  for (int k = 0; k < source.taps; ++k) w[k] = row[k] + f * (row[k + source.taps] - row[k]);
}

// (1 - f) * first pixel + f * second pixel.
template <class Pair>
HWY_INLINE F4 Blend(const Pair& pair, float f) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (Pair::kVectors == 1) {
    const F4::Tag half;
    F4 r;
    r.v[0] = hn::MulAdd(hn::UpperHalf(half, pair.v[0]), hn::Set(half, f),
                        hn::Mul(hn::LowerHalf(half, pair.v[0]), hn::Set(half, 1 - f)));
    return r;
  } else
#endif
  {
    F4 r;
    for (int i = 0; i < F4::kVectors; ++i) {
      const F4::Tag d;
      r.v[i] = hn::MulAdd(pair.v[i + F4::kVectors], hn::Set(d, f), hn::Mul(pair.v[i], hn::Set(d, 1 - f)));
    }
    return r;
  }
}

// Two by two pixels: along y, then along x.
HWY_INLINE F4 Bilinear(const float* p, ptrdiff_t stride, float fx, float fy) {
  F8 rows = F8::Scaled(p, 1 - fy);
  rows.AddScaled(p + stride, fy);
  return Blend(rows, fx);
}

template <int kTaps>
HWY_INLINE F4 Filtered(const GatherSource& source, const float* p, ptrdiff_t stride, float fx, float fy) {
  float wx[kTaps], wy[kTaps];
  TableWeights(source, fx, wx);
  TableWeights(source, fy, wy);
  F4 sum;
  for (int j = 0; j < kTaps; ++j, p += stride) {
    F4 line = F4::Scaled(p, wx[0]);
    for (int i = 1; i < kTaps; ++i) line.AddScaled(p + 4 * i, wx[i]);
    if (j == 0) {
      sum = line * wy[0];
    } else {
      sum.AddScaled(line, wy[j]);
    }
  }
  return sum;
}

class Gatherer {
 public:
  explicit Gatherer(const GatherJob& job) : job_(job), source_(job.source) {
    linear_ = source_.taps == 2 && source_.filter->value(0.25) == 0.75;
    direct_ = job.channels.size() == 4 && job.channels[0] == 0 && job.channels[1] == 1 && job.channels[2] == 2 &&
              job.channels[3] == 3;
  }

  void Run() {
    const Roi& roi = job_.out.roi;
    if (source_.groups.empty() || source_.window.empty()) return Clear();
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; x += kRun) {
        const int count = std::min(kRun, roi.x1 - x);
        if (job_.map.from_image) {
          ImagePositions(job_, x, y, count, at_);
        } else {
          MatrixPositions(job_.map, x, y, count, at_);
        }
        const Roi& w = source_.window;
        FindTaps(w.x0, w.width(), source_.wrap_x, source_.taps, count, at_.x, index_.x, index_.fx);
        FindTaps(w.y0, w.height(), source_.wrap_y, source_.taps, count, at_.y, index_.y, index_.fy);
        for (size_t g = 0; g < source_.groups.size(); ++g) {
          if (linear_) {
            LookUp<2, true>(g, x, y, count);
          } else if (source_.taps == 4) {
            LookUp<4, false>(g, x, y, count);
          } else if (source_.taps == 6) {
            LookUp<6, false>(g, x, y, count);
          } else if (source_.taps == 3) {
            LookUp<3, false>(g, x, y, count);
          } else if (source_.taps == 2) {
            LookUp<2, false>(g, x, y, count);
          } else {
            LookUp<1, false>(g, x, y, count);
          }
        }
      }
    }
  }

 private:
  void Clear() {
    const Roi& roi = job_.out.roi;
    for (int y = roi.y0; y < roi.y1; ++y) {
      std::fill_n(reinterpret_cast<float*>(job_.out.At(roi.x0, y)),
                  static_cast<size_t>(roi.width()) * static_cast<size_t>(job_.out.channels), 0.0f);
    }
  }

  template <int kTaps, bool kLinear>
  HWY_INLINE void LookUp(size_t g, int x, int y, int count) {
    const ConstImageView& group = source_.groups[g];
    const auto* const pixels = reinterpret_cast<const float*>(group.data);
    const ptrdiff_t stride = group.row_stride / 4;
    const int last_x = source_.window.width() - kTaps, last_y = source_.window.height() - kTaps;
    auto* const out = reinterpret_cast<float*>(job_.out.At(x, y));
    const bool stream = direct_ && job_.stream && reinterpret_cast<uintptr_t>(out) % 16 == 0;
    for (int i = 0; i < count; ++i) {
      const int ix = index_.x[i], iy = index_.y[i];
      const float fx = index_.fx[i], fy = index_.fy[i];
      // Inside, between pixels, not reduced: no pixel needs a second look.
      const bool plain = (ix >= 0) & (ix <= last_x) & (iy >= 0) & (iy <= last_y) &
                         ((kTaps == 1) | ((fx > 0) & (fy > 0))) &
                         ((at_.wide_x[i] <= 1) & (at_.wide_y[i] <= 1));
      F4 value;
      if (HWY_LIKELY(plain)) {
        const float* const p = pixels + stride * iy + ptrdiff_t{4} * ix;
        if constexpr (kTaps == 1) {
          value = F4::Load(p);
        } else if constexpr (kLinear) {
          value = Bilinear(p, stride, fx, fy);
        } else {
          value = Filtered<kTaps>(source_, p, stride, fx, fy);
        }
      } else {
        value = Careful(group, i);
      }
      value = value.OneNaN();
      if (stream) {
        value.Stream(out + ptrdiff_t{4} * i);
      } else if (direct_) {
        value.Store(out + ptrdiff_t{4} * i);
      } else {
        Scatter(value, g, out + ptrdiff_t{job_.out.channels} * i);
      }
    }
  }

  HWY_NOINLINE F4 Careful(const ConstImageView& group, int i) {
    const Roi& w = source_.window;
    x_.Find(source_, at_.x[i] - w.x0, at_.wide_x[i], w.width(), source_.wrap_x);
    if (x_.index.empty()) return F4::Zero();
    y_.Find(source_, at_.y[i] - w.y0, at_.wide_y[i], w.height(), source_.wrap_y);
    if (y_.index.empty()) return F4::Zero();
    return WeightedPixels(x_, y_, group);
  }

  void Scatter(const F4& value, size_t g, float* out) const {
    float pixel[4];
    value.Store(pixel);
    for (size_t c = 0; c < job_.channels.size(); ++c) {
      const auto channel = static_cast<size_t>(job_.channels[c]);
      if (channel / 4 == g) out[c] = pixel[channel % 4];
    }
  }

  const GatherJob& job_;
  const GatherSource& source_;
  bool linear_, direct_;
  Positions at_;
  Indices index_;
  AxisWeights x_, y_;
};

void Gather(const GatherJob& job) { Gatherer(job).Run(); }

GatherFunction GatherOfTarget() { return &Gather; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(GatherOfTarget);

GatherFunction ChooseGather() { return HWY_DYNAMIC_DISPATCH(GatherOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
