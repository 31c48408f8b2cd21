// Line integral convolution by lines that pixels share: every line's running sums go to the pixels that it
// crosses; a pixel is the mean of what it gets, weighted by how near to its centre the lines pass.
#include <algorithm>
#include <array>
#include <cmath>

#include "ops/flow/lines.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/flow/shared_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/flow/means-inl.h"
#include "ops/flow/texture-inl.h"
#include "ops/flow/walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// The weight of a line that just touches its pixel, before squaring, where one through the centre weighs 1.
constexpr float kLeastNearness = 0.02f;
// Values that a pixel gets, about.
constexpr double kValues = 3.25;

// Sixteen lines: where they start, relative to the first one, and how far each serves other pixels.
struct Bundle {
  int x = 0, y = 0;
  Starts starts[kParts];
  int served = 0;  // taps each way
  double far = 0;  // how far they lead from the first one's start
};

// The texture's pixel at each index, and the one right of it.
HWY_INLINE void LoadNeighbours(const float* from, VI at, V& left, V& right) {
  const D d;
  const hn::Repartition<uint64_t, D> pairs;
  const hn::Repartition<int64_t, D> offsets;
  const hn::Half<DI> half;
  const auto load = [&](auto indices) HWY_ATTR {
    const auto bytes = hn::ShiftLeft<2>(hn::PromoteTo(offsets, indices));
    return hn::BitCast(d, hn::GatherOffset(pairs, reinterpret_cast<const uint64_t*>(from), bytes));
  };
  const V low = load(hn::LowerHalf(half, at)), high = load(hn::UpperHalf(half, at));
  left = hn::ConcatEven(d, high, low), right = hn::ConcatOdd(d, high, low);
}

// The texture at positions that have all four pixels around them.
template <bool kLinear>
HWY_INLINE V TextureInside(const Lines& lines, const Place& place, const Starts& start, const V2& p) {
  if constexpr (kLinear) {
    const D d;
    const DI di;
    const DU du;
    const V floor_x = hn::Floor(p.x), floor_y = hn::Floor(p.y);
    const V tx = hn::Sub(p.x, floor_x), ty = hn::Sub(p.y, floor_y);
    const VU x = hn::Add(WholeBits(floor_x), WholeBaseOf(start.x));
    const VU y = hn::Add(WholeBits(floor_y), WholeBaseOf(start.y));
    const VU row = hn::Mul(y, hn::Set(du, static_cast<uint32_t>(lines.texture_row)));
    const auto between = [&](V a, V b, V low_a, V low_b) HWY_ATTR {
      const V top = hn::MulAdd(tx, hn::Sub(b, a), a), low = hn::MulAdd(tx, hn::Sub(low_b, low_a), low_a);
      return hn::MulAdd(ty, hn::Sub(low, top), top);
    };
    if (place.codes != nullptr) {
      const VU at = hn::Add(hn::Add(row, hn::Add(x, x)), hn::Set(du, place.first_code));
      const VU four = LoadBytes(place.codes, at);
      const auto value = [&](VU code) HWY_ATTR { return hn::ConvertTo(d, hn::BitCast(di, code)); };
      const VU byte = hn::Set(du, 255);
      return between(value(hn::And(four, byte)), value(hn::And(hn::ShiftRight<16>(four), byte)),
                     value(hn::And(hn::ShiftRight<8>(four), byte)), value(hn::ShiftRight<24>(four)));
    }
    if (lines.texture_step == 1) {
      const VI at = hn::BitCast(di, hn::Add(row, x));
      V a, b, low_a, low_b;
      LoadNeighbours(place.texture, at, a, b);
      LoadNeighbours(place.texture + lines.texture_row, at, low_a, low_b);
      // Weight 0 takes nothing; what is not finite is left to the careful form.
      const V mean = between(a, b, low_a, low_b);
      if (hn::AllTrue(d, hn::IsFinite(mean))) return mean;
    }
  }
  return FindTexels<false, kLinear>(lines, place, start, p).Value(place, 0);
}

// Samples, places and weights of the lines' taps; whether all samples are finite.
template <bool kChecked, bool kLinear>
class Sampler {
 public:
  HWY_INLINE Sampler(const Lines& lines, const Roi& roi, const Bundle& bundle, const Place& place,
                     SharedScratch& scratch)
      : lines_(lines),
        bundle_(bundle),
        place_(place),
        scratch_(scratch),
        all_(bundle.served + lines.taps),
        width_(roi.width()),
        height_(roi.height()) {
    const DI di;
    const DU du;
    for (int part = 0; part < kParts; ++part) {
      const Starts& start = bundle.starts[part];
      base_[part] = CodeBaseOf(lines, place, start);
      in_x_[part] = hn::Add(WholeBaseOf(start.x), hn::Set(du, static_cast<uint32_t>(bundle.x - roi.x0)));
      in_y_[part] = hn::Add(WholeBaseOf(start.y), hn::Set(du, static_cast<uint32_t>(bundle.y - roi.y0)));
      // A place for each line: sums of one place would wait for each other.
      nowhere_[part] = hn::Iota(di, static_cast<int>(roi.pixels()) + part * kLanes);
    }
    for (int c = 0; c < kChains; ++c) alive_[c] = hn::Set(D(), 1.0f), whole_[c] = true;
    watch_ = hn::Zero(D());
  }
  // A tap of lines of which none has ended or does so here.
  HWY_INLINE void Take(int c, int number, const V2& p) {
    const D d;
    const int at = At(c, number);
    V value;
    if (!kLinear && place_.codes != nullptr) {
      value = hn::ConvertTo(d, NearestCodes(lines_, place_, base_[c % kParts], p));
    } else {
      value = TextureInside<kLinear>(lines_, place_, bundle_.starts[c % kParts], p);
      watch_ = hn::MulAdd(value, hn::Zero(d), watch_);
    }
    if constexpr (kChecked) hn::StoreU(hn::Set(d, 1.0f), d, scratch_.there.data() + at);
    hn::StoreU(value, d, scratch_.samples.data() + at);
    if (number <= bundle_.served) Serve(c, at, p, hn::Set(d, 1.0f));
  }
  // Any tap.
  HWY_NOINLINE void TakeAnywhere(int c, int number, const V2& p) {
    const D d;
    const int at = At(c, number);
    V value = hn::Zero(d);
    if (!hn::AllFalse(d, hn::Gt(alive_[c], hn::Zero(d)))) {
      const Texels<kLinear> texels = FindTexels<true, kLinear>(lines_, place_, bundle_.starts[c % kParts], p);
      alive_[c] = hn::And(alive_[c], texels.inside);
      const auto there = hn::Gt(alive_[c], hn::Zero(d));
      whole_[c] = hn::AllTrue(d, there);
      value = hn::IfThenElseZero(there, texels.Value(place_, 0));
      watch_ = hn::MulAdd(value, hn::Zero(d), watch_);
    }
    hn::StoreU(alive_[c], d, scratch_.there.data() + at);
    hn::StoreU(value, d, scratch_.samples.data() + at);
    if (number <= bundle_.served) Serve(c, at, p, alive_[c]);
  }
  HWY_INLINE void Run() {
    const V2 here{hn::Zero(D()), hn::Zero(D())};
    for (int c = 0; c < kParts; ++c) {
      if constexpr (kChecked) {
        TakeAnywhere(c, 0, here);
      } else {
        Take(c, 0, here);
      }
      alive_[c + kParts] = alive_[c], whole_[c + kParts] = whole_[c];
    }
    const Tap tap{this};
    if (IsLow(lines_.integrator)) {
      Walker<kChecked, Orders::kLow>(lines_, place_, bundle_.starts).Run(all_, tap);
    } else {
      Walker<kChecked, Orders::kHigh>(lines_, place_, bundle_.starts).Run(all_, tap);
    }
  }
  // What a lambda would be, but inlined for certain.
  struct Tap {
    HWY_INLINE void operator()(int c, int number, const V2& p, bool inside) const {
      if (!kChecked || (inside && sampler->whole_[c] && sampler->lines_.mask == nullptr)) {
        sampler->Take(c, number, p);
      } else {
        sampler->TakeAnywhere(c, number, p);
      }
    }
    Sampler* sampler;
  };
  HWY_INLINE bool finite() const { return hn::AllTrue(D(), hn::Eq(watch_, hn::Zero(D()))); }
  // No line has ended.
  HWY_INLINE bool whole() const {
    return std::all_of(whole_, whole_ + kChains, [](bool whole) { return whole; });
  }

 private:
  HWY_INLINE int At(int c, int number) const {
    return (c < kParts ? all_ + number : all_ - number) * kPacket + c % kParts * kLanes;
  }
  // The pixel of a tap, and what the tap weighs there.
  HWY_INLINE void Serve(int c, int at, const V2& p, V alive) {
    const D d;
    const DI di;
    const DU du;
    const V whole = hn::Set(d, kWholeUnit), one = hn::Set(d, 1.0f);
    const V far_x = hn::Add(p.x, whole), far_y = hn::Add(p.y, whole);
    const VU x = hn::Add(hn::BitCast(du, far_x), in_x_[c % kParts]);
    const VU y = hn::Add(hn::BitCast(du, far_y), in_y_[c % kParts]);
    const V off_x = hn::Sub(p.x, hn::Sub(far_x, whole)), off_y = hn::Sub(p.y, hn::Sub(far_y, whole));
    const V nearness =
        hn::Max(hn::NegMulAdd(hn::Add(off_x, off_x), off_x, hn::NegMulAdd(hn::Add(off_y, off_y), off_y, one)),
                hn::Set(d, kLeastNearness));
    const V weight = hn::Mul(nearness, nearness);
    if (kLinear && lines_.smooth) {
      hn::StoreU(off_x, d, scratch_.beside_x.data() + at);
      hn::StoreU(off_y, d, scratch_.beside_y.data() + at);
    }
    // Where not, a large number takes the place of one below 0.
    const VU width = hn::Set(du, static_cast<uint32_t>(width_));
    const auto in_x = hn::Eq(hn::Min(x, hn::Set(du, static_cast<uint32_t>(width_ - 1))), x);
    const auto in_y = hn::Eq(hn::Min(y, hn::Set(du, static_cast<uint32_t>(height_ - 1))), y);
    auto here = hn::RebindMask(di, hn::And(in_x, in_y));
    if constexpr (kChecked) here = hn::And(here, hn::RebindMask(di, hn::Gt(alive, hn::Zero(d))));
    const VI index = hn::BitCast(di, hn::Add(hn::Mul(y, width), x));
    hn::StoreU(weight, d, scratch_.weights.data() + at);
    hn::StoreU(hn::IfThenElse(here, index, nowhere_[c % kParts]), di, scratch_.places.data() + at);
  }

  const Lines& lines_;
  const Bundle& bundle_;
  const Place& place_;
  SharedScratch& scratch_;
  const int all_, width_, height_;
  CodeBase base_[kParts];
  VU in_x_[kParts], in_y_[kParts];
  VI nowhere_[kParts];
  V alive_[kChains], watch_;
  bool whole_[kChains];  // no line of the chain has ended
};
// Of the lines of a bundle: all samples are finite; none has ended.
struct Found {
  bool finite, whole;
};
template <bool kChecked, bool kLinear>
Found Sample(const Lines& lines, const Roi& roi, const Bundle& bundle, SharedScratch& scratch) {
  const Place place = PlaceOf(lines, bundle.x, bundle.y, bundle.far);
  Sampler<kChecked, kLinear> sampler(lines, roi, bundle, place, scratch);
  sampler.Run();
  return {sampler.finite(), sampler.whole()};
}

// Floats that a pixel's sums have.
constexpr int SumsOf(bool smooth) { return smooth ? 4 : 2; }

// Adds what kPacket lines give, kSums floats each, to the pixels where they are.
template <int kSums>
HWY_INLINE void Deposit(const float* parts, const int32_t* places, float* sums) {
  const hn::CappedTag<float, kSums> few;
  HWY_UNROLL(4)
  for (int lane = 0; lane < kPacket; ++lane) {
    float* const to = sums + kSums * ptrdiff_t{places[lane]};
    hn::StoreU(hn::Add(hn::LoadU(few, to), hn::LoadU(few, parts + kSums * lane)), few, to);
  }
}

// The convolution at every tap that serves pixels. kRunning: of a box, by sums that go along.
template <bool kChecked, bool kRunning, bool kSmooth>
void Convolve(const Lines& lines, const Bundle& bundle, SharedScratch& scratch) {
  const D d;
  const int taps = lines.taps, all = bundle.served + taps;
  const V zero = hn::Zero(d);
  const auto sample = [&](int at, int part) HWY_ATTR {
    return hn::LoadU(d, scratch.samples.data() + at * kPacket + part * kLanes);
  };
  const auto there = [&](int at, int part) HWY_ATTR {
    return hn::LoadU(d, scratch.there.data() + at * kPacket + part * kLanes);
  };
  const V unit = hn::Set(d, lines.unit), whole = hn::Set(d, lines.unit / lines.sum);
  constexpr int kSums = SumsOf(kSmooth);
  alignas(64) float parts[kSums * kPacket];
  V sum[kParts], count[kParts];
  for (int part = 0; part < kParts; ++part) sum[part] = count[part] = zero;
  if constexpr (kRunning) {
    for (int i = 0; i < 2 * taps; ++i) {
      for (int part = 0; part < kParts; ++part) {
        sum[part] = hn::Add(sum[part], sample(i, part));
        if constexpr (kChecked) count[part] = hn::Add(count[part], there(i, part));
      }
    }
  }
  for (int at = taps; at <= 2 * all - taps; ++at) {
    for (int part = 0; part < kParts; ++part) {
      if constexpr (kRunning) {
        sum[part] = hn::Add(sum[part], sample(at + taps, part));
        if constexpr (kChecked) count[part] = hn::Add(count[part], there(at + taps, part));
      } else {
        const auto take = [&](float weight, int from) HWY_ATTR {
          if (weight == 0) return;
          const V w = hn::Set(d, weight);
          sum[part] = hn::MulAdd(w, sample(from, part), sum[part]);
          if constexpr (kChecked) count[part] = hn::MulAdd(w, there(from, part), count[part]);
        };
        sum[part] = count[part] = zero;
        take(lines.centre, at);
        for (int t = 1; t <= taps; ++t) {
          take(lines.forward[static_cast<size_t>(t - 1)], at + t);
          take(lines.backward[static_cast<size_t>(t - 1)], at - t);
        }
      }
      const V weight = hn::LoadU(d, scratch.weights.data() + at * kPacket + part * kLanes);
      V mean;
      if constexpr (kChecked) {
        mean = hn::IfThenElseZero(hn::Gt(count[part], zero), hn::Div(hn::Mul(sum[part], unit), count[part]));
      } else {
        mean = hn::Mul(sum[part], whole);
      }
      float* const to = parts + kSums * part * kLanes;
      if constexpr (kSmooth) {
        const V x = hn::LoadU(d, scratch.beside_x.data() + at * kPacket + part * kLanes);
        const V y = hn::LoadU(d, scratch.beside_y.data() + at * kPacket + part * kLanes);
        hn::StoreInterleaved4(hn::Mul(mean, weight), weight, hn::Mul(x, weight), hn::Mul(y, weight), d, to);
      } else {
        hn::StoreInterleaved2(hn::Mul(mean, weight), weight, d, to);
      }
    }
    Deposit<kSums>(parts, scratch.places.data() + at * kPacket, scratch.sums.data());
    if constexpr (!kRunning) continue;
    for (int part = 0; part < kParts; ++part) {
      sum[part] = hn::Sub(sum[part], sample(at - taps, part));
      if constexpr (kChecked) count[part] = hn::Sub(count[part], there(at - taps, part));
    }
  }
}

template <bool kChecked>
void ConvolveWith(const Lines& lines, const Bundle& bundle, bool finite, SharedScratch& scratch) {
  // A running sum would keep what is not finite to its line's end.
  const bool running = lines.box && finite;
  if (lines.smooth) {
    const auto convolve = running ? Convolve<kChecked, true, true> : Convolve<kChecked, false, true>;
    convolve(lines, bundle, scratch);
  } else if (running) {
    Convolve<kChecked, true, false>(lines, bundle, scratch);
  } else {
    Convolve<kChecked, false, false>(lines, bundle, scratch);
  }
}

template <bool kChecked>
void Serve(const Lines& lines, const Roi& roi, const Bundle& bundle, SharedScratch& scratch) {
  const Found found = lines.linear ? Sample<kChecked, true>(lines, roi, bundle, scratch)
                                   : Sample<kChecked, false>(lines, roi, bundle, scratch);
  // Most lines that might leave the picture do not.
  if (!kChecked || found.whole) return ConvolveWith<false>(lines, bundle, found.finite, scratch);
  ConvolveWith<true>(lines, bundle, found.finite, scratch);
}

// The lines of a bundle whose starts lie within `spread` pixels right of and below its first one.
void Run(const Lines& lines, const Roi& roi, Bundle bundle, const Roi& starts, SharedScratch& scratch) {
  const auto rows = static_cast<size_t>(2 * (bundle.served + lines.taps) + 1);
  if (scratch.samples.size() < rows * kPacket) {
    for (std::vector<float>* v : {&scratch.samples, &scratch.there, &scratch.weights})
      v->resize(rows * kPacket);
    if (lines.smooth) scratch.beside_x.resize(rows * kPacket), scratch.beside_y.resize(rows * kPacket);
    scratch.places.resize(rows * kPacket);
  }
  const int far = static_cast<int>(static_cast<float>(bundle.served + lines.taps) * lines.step) + 2;
  const Roi reach = Inflate(starts, far, far);
  bundle.far = far + std::max(starts.width(), starts.height());
  if (lines.mask == nullptr && Roi{0, 0, lines.width, lines.height}.Contains(reach) &&
      IsNear(lines, bundle.far)) {
    Serve<false>(lines, roi, bundle, scratch);
  } else {
    Serve<true>(lines, roi, bundle, scratch);
  }
}

// Pixels that no line of the grid crossed, sixteen at a time; lines from them serve their neighbours too.
void FillHoles(const Lines& lines, const Roi& roi, SharedScratch& scratch) {
  const D d;
  const DI di;
  const auto sums = static_cast<size_t>(SumsOf(lines.smooth));
  std::array<int32_t, kPacket> xs{}, ys{};
  size_t found = 0;
  const auto flush = [&]() HWY_ATTR {
    if (found == 0) return;
    const int left = *std::min_element(xs.begin(), xs.begin() + found), top = ys[0];
    const Roi starts{left, top, *std::max_element(xs.begin(), xs.begin() + found) + 1, ys[found - 1] + 1};
    for (size_t i = 0; i < kPacket; ++i) {
      const size_t from = std::min(i, found - 1);
      xs[i] = i < found ? xs[i] - left : xs[from], ys[i] = i < found ? ys[i] - top : ys[from];
    }
    Bundle bundle{left, top, {}, std::max(8, lines.taps / 2)};
    for (int part = 0; part < kParts; ++part) {
      bundle.starts[part] = {hn::LoadU(di, xs.data() + part * kLanes),
                             hn::LoadU(di, ys.data() + part * kLanes)};
    }
    Run(lines, roi, bundle, starts, scratch);
    found = 0;
  };
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      const size_t pixel = static_cast<size_t>(y - roi.y0) * static_cast<size_t>(roi.width()) +
                           static_cast<size_t>(x - roi.x0);
      // Mostly there is none for long.
      if (x + kLanes <= roi.x1) {
        V value, weight;
        if (lines.smooth) {
          weight = MeansAt(scratch.sums.data() + 4 * pixel).weight;
        } else {
          hn::LoadInterleaved2(d, scratch.sums.data() + 2 * pixel, value, weight);
        }
        if (hn::AllTrue(d, hn::Gt(weight, hn::Zero(d)))) {
          x += kLanes - 1;
          continue;
        }
      }
      if (scratch.sums[sums * pixel + 1] > 0 || Masked(lines, x, y)) continue;
      xs[found] = x, ys[found] = y;
      if (++found == kPacket) flush();
    }
  }
  flush();
}

void Share(const Lines& lines, const LineOutput& out, SharedScratch& scratch) {
  const D d;
  const DI di;
  const Roi& roi = out.roi;
  const auto sums = static_cast<size_t>(SumsOf(lines.smooth));
  // Whole vectors are read from the last pixel on.
  scratch.sums.assign(sums * (static_cast<size_t>(roi.pixels()) + 2 * kPacket), 0.0f);
  // About three values for a pixel; lines long enough to earn their ends.
  const int wanted = std::max(40, lines.taps + lines.taps / 2);
  const int grid = static_cast<int>(std::ceil(std::sqrt(2.0 * wanted / kValues) - 0.1));
  const int served = static_cast<int>(std::lround(grid * grid * kValues / 2));
  const int most = (kSide - 1) * grid;
  for (int y = roi.y0 + grid / 2; y < roi.y1; y += kSide * grid) {
    for (int x = roi.x0 + grid / 2; x < roi.x1; x += kSide * grid) {
      Bundle bundle{x, y, {}, served};
      PixelStarts(kSide - 1, kSide - 1, bundle.starts);
      for (Starts& s : bundle.starts) {
        s.x = hn::Min(hn::Mul(s.x, hn::Set(di, grid)), hn::Set(di, roi.x1 - 1 - x));
        s.y = hn::Min(hn::Mul(s.y, hn::Set(di, grid)), hn::Set(di, roi.y1 - 1 - y));
      }
      Run(lines, roi, bundle, {x, y, x + most + 1, y + most + 1}, scratch);
    }
  }
  FillHoles(lines, roi, scratch);
  if (lines.smooth) return Centre(lines, out, scratch);
  for (int y = roi.y0; y < roi.y1; ++y) {
    float* const to = out.data + (y - roi.y0) * out.row;
    const size_t row = static_cast<size_t>(y - roi.y0) * static_cast<size_t>(roi.width());
    int x = roi.x0;
    if (out.step == 1 && lines.mask == nullptr) {
      for (; x + kLanes <= roi.x1; x += kLanes) {
        V value, weight;
        hn::LoadInterleaved2(d, scratch.sums.data() + 2 * (row + static_cast<size_t>(x - roi.x0)), value,
                             weight);
        const auto any = hn::Gt(weight, hn::Zero(d));
        hn::StoreU(hn::IfThenElseZero(any, hn::Div(value, weight)), d, to + (x - roi.x0));
      }
    }
    for (; x < roi.x1; ++x) {
      const size_t pixel = row + static_cast<size_t>(x - roi.x0);
      const float weight = scratch.sums[2 * pixel + 1];
      to[(x - roi.x0) * out.step] =
          weight > 0 && !Masked(lines, x, y) ? scratch.sums[2 * pixel] / weight : 0.0f;
    }
  }
}

ShareLines SharedLinesHere() { return Share; }

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::flow {

HWY_EXPORT(SharedLinesHere);

ShareLines FindSharedLines() { return HWY_DYNAMIC_DISPATCH(SharedLinesHere)(); }

}  // namespace tessera::ops::flow
#endif  // HWY_ONCE
