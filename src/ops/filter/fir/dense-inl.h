// Direct sums over small square windows without holes: loops without ends, few loads across cache lines.
#if defined(TESSERA_OPS_FILTER_FIR_DENSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_FIR_DENSE_INL_H_
#undef TESSERA_OPS_FILTER_FIR_DENSE_INL_H_
#else
#define TESSERA_OPS_FILTER_FIR_DENSE_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "base/prefetch.h"
#include "ops/filter/fir/direct-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Rows of results that are made together. What is read and written at once is as many streams of memory, of
// which few are faster: more rows only where it is the sums that take the time.
constexpr int DenseRows(int width) { return kLanes == 16 && width > 3 ? 4 : 2; }

// ---- Small dense kernels on RGBA with 16 lanes: aligned loads, shifted in registers ----
// Where a window's first tap lies in the line of its first load: a whole number of pixels from the line's
// begin. Loads across lines take twice as long, and that is more than all else that is done with them.
constexpr int kPerTap = -1;  // wherever it lies: a load for every tap, none beyond a vector from the last one

// The vectors that begin at taps 4 * kM to 4 * kM + kCount - 1 of a row.
template <int kPhase, int kM, int kCount>
HWY_INLINE void LoadPixels(const float* p, V (&v)[4]) {
  if constexpr (kPhase == kPerTap) {
    for (int g = 0; g < kCount; ++g) v[g] = Load(p + 16 * kM + 4 * g);
  } else {
    constexpr int kLast = kPhase + kCount - 1;
    constexpr int kLines = kLast / 4 + (kLast % 4 != 0 ? 2 : 1);
    V line[kLines];  // as floats, which the shifts would load once more as integers
    for (int i = 0; i < kLines; ++i) line[i] = s::Held(Load(p + 16 * kM + i * kLanes));
    HWY_UNROLL(4)
    for (int g = 0; g < kCount; ++g) {
      const int i = (kPhase + g) / 4;
      switch ((kPhase + g) % 4) {
        case 0:
          v[g] = line[i];
          break;
        case 1:
          v[g] = s::ShiftBlocks<1>(line[i], line[i + 1]);
          break;
        case 2:
          v[g] = s::ShiftBlocks<2>(line[i], line[i + 1]);
          break;
        default:
          v[g] = s::ShiftBlocks<3>(line[i], line[i + 1]);
      }
    }
  }
}

template <int kW, int kH, bool kDense_, bool kCentered_>
struct DenseKind {
  static constexpr int kWidth = kW, kHeight = kH, kGroups = kW < 4 ? kW : 4;
  static constexpr bool kDense = kDense_, kCentered = kCentered_;
  static constexpr int kRows = DenseRows(kW);
  static constexpr bool kHeld = kW * kH <= 9;  // all weights in registers
  static constexpr bool kChecked = kCentered || !kDense;
};

// One vector of kR rows that share the loads of an input row and its shifts. Group g takes the columns
// 4 * m + g of the window, row by row as in DirectBlock; the sums of all groups of kR rows fit the registers.
template <class Kind, int kPhase, int kR, int kM = 0>
HWY_INLINE void AddPixels(const float* p, ptrdiff_t stride, const float* HWY_RESTRICT w, const V* held,
                          const V (&centre)[kR][1], bool ahead, V (&a)[kR][4]) {
  constexpr int kW = Kind::kWidth, kH = Kind::kHeight, kCount = kW - 4 * kM < 4 ? kW - 4 * kM : 4;
  HWY_UNROLL(16)
  for (int yi = 0; yi < kH + kR - 1; ++yi) {
    V v[4];
    LoadPixels<kPhase, kM, kCount>(p + yi * stride, v);
    // Rows that the next block of results reads first: the hardware follows fewer streams than there
    // are rows.
    if (kM == 0 && yi >= kH - 1 && ahead) hwy::Prefetch(p + (yi + kR) * stride);
    HWY_UNROLL(4)
    for (int g = 0; g < kCount; ++g) {
      HWY_UNROLL(8)
      for (int r = 0; r < kR; ++r) {
        if (yi < r || yi - r >= kH) continue;
        const int tap = (yi - r) * kW + 4 * kM + g;
        const V weight = Kind::kHeld ? held[tap] : hn::Set(D(), w[tap]);
        a[r][g] = hn::MulAdd(Kind::kCentered ? hn::Sub(v[g], centre[r][0]) : v[g], weight, a[r][g]);
      }
    }
  }
  if constexpr (4 * (kM + 1) < kW) AddPixels<Kind, kPhase, kR, kM + 1>(p, stride, w, held, centre, ahead, a);
}

// Results of Kind::kRows rows; `ahead`: large images, whose rows are fetched before they are used. Weights of
// 0 add their zeros here and centres are taken as they are; true if that has made a NaN of infinities and
// NaN.
template <class Kind, int kPhase>
HWY_INLINE bool DenseBlock(const DirectWindow& window, const float* in, ptrdiff_t stride, ptrdiff_t centre_at,
                           const V* held, bool ahead, V (&total)[Kind::kRows][1]) {
  constexpr int kR = Kind::kRows;
  V centre[kR][1], a[kR][4];
  for (int r = 0; r < kR; ++r) {
    centre[r][0] = Kind::kCentered ? Load(in + centre_at + r * stride) : Nothing();
    for (V& v : a[r]) v = Nothing();
  }
  AddPixels<Kind, kPhase>(in - (kPhase > 0 ? 4 * kPhase : 0), stride, window.weights.data(), held, centre,
                          ahead, a);
  V all = hn::Zero(D());
  for (int r = 0; r < kR; ++r) {
    total[r][0] = a[r][0];
    HWY_UNROLL(4)
    for (int g = 1; g < Kind::kGroups; ++g) total[r][0] = hn::Add(total[r][0], a[r][g]);
    all = r == 0 ? total[r][0] : hn::Add(all, total[r][0]);
  }
  if constexpr (!Kind::kDense) UnsignedZeros(total);
  return Kind::kChecked && !hn::AllFalse(D(), hn::IsNaN(all));
}

// The same block as it should be, wherever NaN and infinities are.
template <class Kind>
HWY_NOINLINE void DenseBlockAnew(const DirectWindow& window, const float* in, ptrdiff_t stride, float* out,
                                 ptrdiff_t out_stride, int count) {
  V total[Kind::kRows][1];
  DirectBlock<Kind::kCentered>(window, in, stride, 4, total);
  if constexpr (!Kind::kDense) UnsignedZeros(total);
  for (int r = 0; r < Kind::kRows; ++r) StorePart(total[r][0], out + r * out_stride, count, false);
}

template <class Kind, int kPhase>
void DirectDenseRgba(const DirectWindow& window, const FloatTile& t, int begin, int end) {
  constexpr int kR = Kind::kRows;
  V held[Kind::kHeld ? 9 : 1];
  if constexpr (Kind::kHeld) {
    for (int i = 0; i < Kind::kWidth * Kind::kHeight; ++i)
      held[i] = hn::Set(D(), window.weights[static_cast<size_t>(i)]);
  }
  const ptrdiff_t stride = t.in_stride, out_stride = t.out_stride;
  const bool stream =
      t.stream && reinterpret_cast<uintptr_t>(t.out + begin) % 64 == 0 && out_stride % 16 == 0;
  const int rows = t.rows, floats = t.samples;
  const ptrdiff_t centre_at = window.center_y * stride + window.center_x * 4;
  for (int y = 0; y + kR <= rows; y += kR) {
    const float* const in = t.in + y * stride;
    float* const out = t.out + y * out_stride;
    const auto edge = [&](int first, int last) HWY_ATTR {
      for (int x = first; x < last; x += kLanes) {
        V total[kR][1];
        const int count = std::min(kLanes, last - x);
        const bool anew =
            DenseBlock<Kind, kPerTap>(window, in + x, stride, centre_at, held, /*ahead=*/false, total);
        for (int r = 0; r < kR; ++r) StorePart(total[r][0], out + r * out_stride + x, count, t.stream);
        if (HWY_UNLIKELY(anew)) DenseBlockAnew<Kind>(window, in + x, stride, out + x, out_stride, count);
      }
    };
    edge(0, begin);
    for (int x = begin; x < end; x += kLanes) {
      V total[kR][1];
      const bool anew =
          DenseBlock<Kind, kPhase>(window, in + x, stride, centre_at, held, /*ahead=*/t.stream, total);
      for (int r = 0; r < kR; ++r) Store(total[r][0], out + r * out_stride + x, stream);
      if (HWY_UNLIKELY(anew)) DenseBlockAnew<Kind>(window, in + x, stride, out + x, out_stride, kLanes);
    }
    edge(end, floats);
  }
}

// ---- Small dense kernels with shorter vectors: a load for every tap, loops without ends ----

// Where the first tap of a vector of results lies: in front of a whole vector of memory, half a vector before
// one, or anywhere. RGBA pixels half a vector off are put together from whole vectors: loads across cache
// lines take several times as long.
enum class Aligned { kWhole, kHalf, kAny };

// The vectors that begin at taps kTap, kTap + 2, ... of RGBA pixels, two to a vector.
template <Aligned kAligned, int kTap, int kCount>
HWY_INLINE void LoadTaps(const float* in, V (&v)[kCount]) {
  constexpr bool kIsWhole = (kTap % 2 == 0) == (kAligned == Aligned::kWhole);
  if constexpr (kLanes == 8 && !kIsWhole) {
    V last = Load(in + 4 * (kTap + 1));
    if constexpr (kTap == 0) {
      v[0] = s::Held(hn::Combine(D(), hn::LowerHalf(last), hn::LoadU(hn::Half<D>(), in)));
    } else {
      v[0] = s::Held(hn::ConcatLowerUpper(D(), last, Load(in + 4 * (kTap - 1))));
    }
    for (int i = 1; i < kCount; ++i) {
      const V next = Load(in + 4 * (kTap + 1 + 2 * i));
      v[i] = s::Held(hn::ConcatLowerUpper(D(), next, last));
      last = next;
    }
    return;
  }
  for (int i = 0; i < kCount; ++i) v[i] = s::Held(Load(in + 4 * kTap + i * kLanes));
}

// The sums of two groups of columns, kTap and kTap + 2 modulo 4, for kR rows of two vectors: enough sums
// at once that none waits for its own last product.
template <int kW, int kH, bool kCentered, Aligned kAligned, int kTap, int kR>
HWY_INLINE void AddGroups(const float* w, const float* in, ptrdiff_t stride, int channels,
                          const V (&centre)[kR][2], V (&acc)[2][kR][2]) {
  if constexpr (kTap < kW) {
    constexpr int kGroups = kTap + 2 < kW ? 2 : 1;
    constexpr bool kRgba = kAligned != Aligned::kAny && kLanes == 8;
#pragma GCC unroll 16
    for (int yi = 0; yi < kH + kR - 1; ++yi) {
      const float* const row = in + yi * stride;
      if (kTap == 0 && yi >= kH - 1) base::PrefetchSecond(row + kR * stride);
      V v[kGroups + 1];
      if constexpr (kRgba) LoadTaps<kAligned, kTap>(row, v);
#pragma GCC unroll 2
      for (int g = 0; g < kGroups; ++g) {
#pragma GCC unroll 2
        for (int j = 0; j < 2; ++j) {
          const V sample = kRgba ? v[g + j] : Load(row + (kTap + 2 * g) * channels + j * kLanes);
#pragma GCC unroll 4
          for (int r = 0; r < kR; ++r) {
            if (yi < r || yi - r >= kH) continue;
            const V weight = hn::Set(D(), w[(yi - r) * kW + kTap + 2 * g]);
            acc[g][r][j] =
                hn::MulAdd(kCentered ? hn::Sub(sample, centre[r][j]) : sample, weight, acc[g][r][j]);
          }
        }
      }
    }
    AddGroups<kW, kH, kCentered, kAligned, kTap + 4>(w, in, stride, channels, centre, acc);
  }
}

// The sums of DenseRows() rows of kJ vectors, group by group as in DirectBlock, in registers. Without kDense
// some weights are 0 and add their zeros, but where they have made a NaN of an infinity or another NaN the
// sums are taken again without them.
template <int kW, int kH, bool kDense, bool kCentered, Aligned kAligned>
void DirectDenseWindow(const DirectWindow& window, const FloatTile& t, int x_end) {
  constexpr int kR = DenseRows(kW), kJ = 2;
  const float* HWY_RESTRICT w = window.weights.data();
  const ptrdiff_t stride = t.in_stride;
  for (int y = 0; y + kR <= t.rows; y += kR) {
    for (int x = 0; x < x_end; x += kJ * kLanes) {
      const float* const in = t.in + y * stride + x;
      V total[kR][kJ], centre[kR][kJ];
      LoadCentres<kCentered>(window, in, stride, t.channels, centre);
      V even[2][kR][kJ], odd[2][kR][kJ];
      for (auto* groups : {&even, &odd}) {
        for (auto& group : *groups) {
          for (auto& row : group) {
            for (V& a : row) a = Nothing();
          }
        }
      }
      AddGroups<kW, kH, kCentered, kAligned, 0>(w, in, stride, t.channels, centre, even);
      AddGroups<kW, kH, kCentered, kAligned, 1>(w, in, stride, t.channels, centre, odd);
      for (int r = 0; r < kR; ++r) {
        for (int j = 0; j < kJ; ++j) {
          V sum = hn::Add(even[0][r][j], odd[0][r][j]);
          if (kW > 2) sum = hn::Add(sum, even[1][r][j]);
          if (kW > 3) sum = hn::Add(sum, odd[1][r][j]);
          total[r][j] = sum;
        }
      }
      if constexpr (!kDense) {
        V sum = Nothing();
        for (const auto& row : total) {
          for (const V v : row) sum = hn::Add(sum, v);
        }
        if (HWY_UNLIKELY(!hn::AllFalse(D(), hn::IsNaN(sum)))) {
          DirectBlock<kCentered>(window, in, stride, t.channels, total);
        }
        UnsignedZeros(total);
      }
      for (int r = 0; r < kR; ++r) {
        float* const out = t.out + (y + r) * t.out_stride + x;
        for (int j = 0; j < kJ; ++j) Store(total[r][j], out + j * kLanes, t.stream);
      }
    }
  }
}

// f with the side of a window, and whether it has no holes and is of differences, as constants; false for
// windows that loops without ends do not suit.
template <class F>
bool WithDenseKind(const DirectWindow& window, const F& f) {
  // They are worth some taps that are not needed.
  const auto holes = std::count(window.weights.begin(), window.weights.end(), 0.0f);
  if (window.width != window.height || 2 * holes >= std::ssize(window.weights)) return false;
  const auto with = [&]<int kSide, bool kCentered>() {
    window.dense ? f.template operator()<kSide, true, kCentered>()
                 : f.template operator()<kSide, false, kCentered>();
    return true;
  };
  const int side = window.width;
  if (side == 3)
    return window.centered ? with.template operator()<3, true>() : with.template operator()<3, false>();
  if (side == 5)
    return window.centered ? with.template operator()<5, true>() : with.template operator()<5, false>();
  if (window.centered) return false;
  if (side == 7) return with.template operator()<7, false>();
  if constexpr (kFourPixels && sizeof(F) > 0) {
    if (side == 9) return with.template operator()<9, false>();
  }
  return false;
}

// How many floats of each row are done. Templates, of which a target compiles one.
template <class Tile>
int DenseOfFours(const DirectWindow& window, const Tile& t) {
  if (t.channels != 4) return 0;
  const bool done = WithDenseKind(window, [&]<int kSide, bool kDense, bool kCentered>() {
    // Whole lines of results, whose taps then mostly begin a known number of pixels into a line. Of larger
    // windows more lines would have to be loaded than loads across lines are saved.
    constexpr int kPhase = kSide == 3 ? 3 : 0;
    const auto to_line = [](const float* p) {
      return static_cast<int>(-reinterpret_cast<uintptr_t>(p) % 64 / sizeof(float));
    };
    int begin = to_line(t.out);
    const bool known = (to_line(t.in) + 4 * kPhase - begin) % kLanes == 0 && t.in_stride % kLanes == 0;
    // In front of the first tap there may be no memory.
    if (known && begin < 4 * kPhase) begin += kLanes;
    begin = std::min(begin, t.samples);
    const int end = begin + (t.samples - begin) / kLanes * kLanes;
    using Kind = DenseKind<kSide, kSide, kDense, kCentered>;
    known ? DirectDenseRgba<Kind, kPhase>(window, t, begin, end)
          : DirectDenseRgba<Kind, 0>(window, t, begin, end);
  });
  return done ? t.samples : 0;
}
template <class Tile>
int DenseOfLess(const DirectWindow& window, const Tile& t) {
  const int x_end = t.samples / (2 * kLanes) * (2 * kLanes);
  if (x_end == 0) return 0;
  const auto offset = reinterpret_cast<uintptr_t>(t.in) % 32;
  const bool halves = kLanes == 8 && t.channels == 4 && t.in_stride % 8 == 0 && offset % 16 == 0;
  const bool done = WithDenseKind(window, [&]<int kSide, bool kDense, bool kCentered>() {
    if (halves && offset == 0) {
      DirectDenseWindow<kSide, kSide, kDense, kCentered, Aligned::kWhole>(window, t, x_end);
    } else if (halves) {
      DirectDenseWindow<kSide, kSide, kDense, kCentered, Aligned::kHalf>(window, t, x_end);
    } else {
      DirectDenseWindow<kSide, kSide, kDense, kCentered, Aligned::kAny>(window, t, x_end);
    }
  });
  return done ? x_end : 0;
}

// Does what suits it and returns how many floats of each row are done; rows beyond a multiple of DenseRows()
// are left.
template <class Tile>
int DirectDense(const DirectWindow& window, const Tile& t) {
  if (t.rows < DenseRows(window.width)) return 0;
  if constexpr (kFourPixels && sizeof(Tile) > 0) {
    return DenseOfFours(window, t);
  } else {
    return DenseOfLess(window, t);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
