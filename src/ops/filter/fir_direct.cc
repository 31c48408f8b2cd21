// Direct window sums on every target. Sums are grouped by the tap's column modulo 4, in the same order for
// every vector length: with four channels and 16 lanes the groups are what one aligned load serves, and only
// the four group sums have to be shifted.
#include <algorithm>
#include <utility>

#include "base/prefetch.h"
#include "ops/filter/fir.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/fir_direct.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/fir-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Output rows that share their loads, as far as the registers go.
constexpr int kRows = kLanes == 16 ? 4 : 2;
constexpr int kDenseRows = kLanes == 16 ? 4 : 2;

// What differences are taken from: the samples of the centre's tap, as far as they are finite.
template <bool kCentered, int kR, int kJ>
HWY_INLINE void LoadCentres(const DirectWindow& window, const float* in, ptrdiff_t stride, int channels,
                            V (&centre)[kR][kJ]) {
  for (int r = 0; r < kR; ++r) {
    for (int j = 0; j < kJ; ++j) {
      centre[r][j] = Nothing();
      if constexpr (kCentered) {
        const V c = Load(in + (r + window.center_y) * stride + window.center_x * channels + j * kLanes);
        centre[r][j] = hn::IfThenElseZero(hn::IsFinite(c), c);
      }
    }
  }
}

// kR rows of kJ vectors; `in` is the window's first tap of the first sample.
template <bool kCentered, int kR, int kJ>
HWY_INLINE void DirectBlock(const DirectWindow& window, const float* in, ptrdiff_t stride, int channels,
                            V (&total)[kR][kJ]) {
  V centre[kR][kJ];
  LoadCentres<kCentered>(window, in, stride, channels, centre);
  for (auto& row : total) {
    for (V& v : row) v = Nothing();
  }
  for (const auto& group : window.runs) {
    if (group.empty()) continue;
    V acc[kR][kJ];
    for (auto& row : acc) {
      for (V& a : row) a = Nothing();
    }
    for (const DirectWindow::Run& run : group) {
      AddRun<kCentered>(acc, centre, in + run.dx * channels, stride, window.weights.data() + run.dx,
                        window.width, run.dy_begin, run.dy_end);
    }
    for (int r = 0; r < kR; ++r) {
      for (int j = 0; j < kJ; ++j) total[r][j] = hn::Add(total[r][j], acc[r][j]);
    }
  }
}

// Taps of weight 0 may add zeros or not, as is faster: the sign of a sum that is 0 does not tell.
template <int kR, int kJ>
HWY_INLINE void UnsignedZeros(V (&total)[kR][kJ]) {
  for (auto& row : total) {
    for (V& v : row) v = hn::Add(v, hn::Zero(D()));
  }
}

template <bool kCentered, int kR, int kJ>
HWY_INLINE void DirectStrip(const DirectWindow& window, const FirTile& t, int x, int y_begin, int y_end) {
  const int count = std::min(kJ * kLanes, t.floats - x);
  for (int y = y_begin; y + kR <= y_end; y += kR) {
    V total[kR][kJ];
    DirectBlock<kCentered>(window, t.in + y * t.in_stride + x, t.in_stride, t.channels, total);
    if (!window.dense) UnsignedZeros(total);
    for (int r = 0; r < kR; ++r) {
      float* out = t.out + (y + r) * t.out_stride + x;
      for (int j = 0; j < kJ; ++j) StorePart(total[r][j], out + j * kLanes, count - j * kLanes, t.stream);
    }
  }
}

template <bool kCentered>
void DirectColumns(const DirectWindow& window, const FirTile& t, int x_begin) {
  const int whole = t.rows / kRows * kRows;
  int x = x_begin;
  for (; x + kLanes < t.floats; x += 2 * kLanes) {
    DirectStrip<kCentered, kRows, 2>(window, t, x, 0, whole);
    DirectStrip<kCentered, 1, 2>(window, t, x, whole, t.rows);
  }
  for (; x < t.floats; x += kLanes) DirectStrip<kCentered, 1, 1>(window, t, x, 0, t.rows);
}

// ---- Small dense kernels on RGBA with 16 lanes: one aligned load per register ----
#if TESSERA_FIR_RGBA

// kR rows share the loads of an input row and its shifts by one to three pixels. Group g takes the columns
// 4 * m + g of the window, row by row as in DirectBlock; the sums of all groups of kR rows fit the registers.
template <int kW, int kH, int kR>
void DirectDenseRgba(const DirectWindow& window, const FirTile& t, int x_end) {
  constexpr int kGroups = kW < 4 ? kW : 4;
  // Rows that the next block of results reads first: the hardware follows fewer streams than there are rows.
  constexpr ptrdiff_t kAhead = 4 * kLanes;
  const float* HWY_RESTRICT w = window.weights.data();
  const ptrdiff_t stride = t.in_stride;
  for (int y = 0; y + kR <= t.rows; y += kR) {
    const float* const in = t.in + y * stride;
    float* const out = t.out + y * t.out_stride;
    for (int x = 0; x < x_end; x += kLanes) {
      V a[kR][kGroups];
      HWY_UNROLL(8)
      for (int r = 0; r < kR; ++r) {
        HWY_UNROLL(4)
        for (int g = 0; g < kGroups; ++g) a[r][g] = Nothing();
      }
      HWY_UNROLL(3)
      for (int m = 0; 4 * m < kW; ++m) {
        HWY_UNROLL(16)
        for (int yi = 0; yi < kH + kR - 1; ++yi) {
          const float* const p = in + yi * stride + x + m * kLanes;
          V v[4];
          v[0] = Load(p);
          if (4 * m + 1 < kW) {
            const V next = Load(p + kLanes);
            v[1] = ShiftPixels<1>(v[0], next);
            if (4 * m + 2 < kW) v[2] = ShiftPixels<2>(v[0], next);
            if (4 * m + 3 < kW) v[3] = ShiftPixels<3>(v[0], next);
          }
          if (m == 0 && yi >= kH - 1) base::PrefetchSecond(p + kR * stride + kAhead);
          HWY_UNROLL(4)
          for (int g = 0; g < kGroups; ++g) {
            HWY_UNROLL(8)
            for (int r = 0; r < kR; ++r) {
              if (4 * m + g >= kW || yi < r || yi - r >= kH) continue;
              a[r][g] = hn::MulAdd(v[g], hn::Set(D(), w[(yi - r) * kW + 4 * m + g]), a[r][g]);
            }
          }
        }
      }
      HWY_UNROLL(8)
      for (int r = 0; r < kR; ++r) {
        V v = a[r][0];
        HWY_UNROLL(4)
        for (int g = 1; g < kGroups; ++g) v = hn::Add(v, a[r][g]);
        Store(v, out + r * t.out_stride + x, t.stream);
      }
    }
  }
}

// Does what suits it and returns how many floats of each row are done; rows beyond a multiple of kDenseRows
// are left.
int DirectDense(const DirectWindow& window, const FirTile& t) {
  // The last register's neighbour is read too: leave the end of the row to the general form.
  const int x_end = std::max(0, (t.floats - kLanes) / kLanes * kLanes);
  if (t.channels != 4 || !window.dense || window.centered || t.rows < kDenseRows || x_end == 0) return 0;
  if (window.width == 3 && window.height == 3) {
    DirectDenseRgba<3, 3, kDenseRows>(window, t, x_end);
  } else if (window.width == 5 && window.height == 5) {
    DirectDenseRgba<5, 5, kDenseRows>(window, t, x_end);
  } else if (window.width == 7 && window.height == 7) {
    DirectDenseRgba<7, 7, kDenseRows>(window, t, x_end);
  } else if (window.width == 9 && window.height == 9) {
    DirectDenseRgba<9, 9, kDenseRows>(window, t, x_end);
  } else {
    return 0;
  }
  return x_end;
}
#else

// ---- Small dense kernels with shorter vectors: a load for every tap, loops without ends ----

// Where the first tap of a vector of results lies: in front of a whole vector of memory, half a vector before
// one, or anywhere. RGBA pixels half a vector off are put together from whole vectors: loads across cache
// lines take several times as long.
enum class Aligned { kWhole, kHalf, kAny };

// Keeps a value in its register, where the compiler would rather load it again for every use.
HWY_INLINE V Held(V v) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR
  asm("" : "+x"(v.raw));
#endif
  return v;
}

// The vectors that begin at taps kTap, kTap + 2, ... of RGBA pixels, two to a vector.
template <Aligned kAligned, int kTap, int kCount>
HWY_INLINE void LoadTaps(const float* in, V (&v)[kCount]) {
#if HWY_TARGET == HWY_AVX2
  constexpr bool kIsWhole = (kTap % 2 == 0) == (kAligned == Aligned::kWhole);
  if constexpr (!kIsWhole) {
    V last = Load(in + 4 * (kTap + 1));
    if constexpr (kTap == 0) {
      v[0] = Held(hn::Combine(D(), hn::LowerHalf(last), hn::LoadU(hn::Half<D>(), in)));
    } else {
      v[0] = Held(hn::ConcatLowerUpper(D(), last, Load(in + 4 * (kTap - 1))));
    }
    for (int i = 1; i < kCount; ++i) {
      const V next = Load(in + 4 * (kTap + 1 + 2 * i));
      v[i] = Held(hn::ConcatLowerUpper(D(), next, last));
      last = next;
    }
    return;
  }
#endif
  for (int i = 0; i < kCount; ++i) v[i] = Held(Load(in + 4 * kTap + i * kLanes));
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

// The sums of kDenseRows rows of kJ vectors, group by group as in DirectBlock, in registers. Without kDense
// some weights are 0 and add their zeros, but where they have made a NaN of an infinity or another NaN the
// sums are taken again without them.
template <int kW, int kH, bool kDense, bool kCentered, Aligned kAligned>
void DirectDenseWindow(const DirectWindow& window, const FirTile& t, int x_end) {
  constexpr int kR = kDenseRows, kJ = 2;
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

int DirectDense(const DirectWindow& window, const FirTile& t) {
  const int x_end = t.floats / (2 * kLanes) * (2 * kLanes);
  if (kLanes == 1 || t.rows < kDenseRows || x_end == 0) return 0;
  if (window.width != window.height) return 0;
  // Loops without ends are worth some taps that are not needed.
  const auto taps = window.weights.size() -
                    static_cast<size_t>(std::count(window.weights.begin(), window.weights.end(), 0.0f));
  if (2 * taps <= window.weights.size()) return 0;
  const auto offset = reinterpret_cast<uintptr_t>(t.in) % 32;
  const bool halves = kLanes == 8 && t.channels == 4 && t.in_stride % 8 == 0 && offset % 16 == 0;
  const auto dense = [&]<int kSide, bool kDense, bool kCentered>() {
    if (halves && offset == 0) {
      DirectDenseWindow<kSide, kSide, kDense, kCentered, Aligned::kWhole>(window, t, x_end);
    } else if (halves) {
      DirectDenseWindow<kSide, kSide, kDense, kCentered, Aligned::kHalf>(window, t, x_end);
    } else {
      DirectDenseWindow<kSide, kSide, kDense, kCentered, Aligned::kAny>(window, t, x_end);
    }
  };
  const auto run = [&]<int kSide, bool kCentered>() {
    window.dense ? dense.template operator()<kSide, true, kCentered>()
                 : dense.template operator()<kSide, false, kCentered>();
  };
  if (window.width == 3) {
    window.centered ? run.template operator()<3, true>() : run.template operator()<3, false>();
  } else if (window.width == 5) {
    window.centered ? run.template operator()<5, true>() : run.template operator()<5, false>();
  } else if (window.width == 7 && !window.centered) {
    run.template operator()<7, false>();
  } else {
    return 0;
  }
  return x_end;
}
#endif

void RunDirectTarget(const DirectWindow& window, const FirTile& t) {
  const auto columns = window.centered ? DirectColumns<true> : DirectColumns<false>;
  const int done = DirectDense(window, t);
  if (done > 0) {
    FirTile rest = t;
    const int rows = t.rows / kDenseRows * kDenseRows;
    rest.in += rows * t.in_stride, rest.out += rows * t.out_stride;
    rest.rows -= rows, rest.floats = done;
    if (rest.rows > 0) columns(window, rest, 0);
  }
  if (done < t.floats) columns(window, t, done);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(RunDirectTarget);

DirectWindow MakeDirectWindow(int width, int height, std::vector<float> weights) {
  DirectWindow window;
  window.width = width, window.height = height, window.weights = std::move(weights);
  window.dense = true;
  for (int dx = 0; dx < width; ++dx) {
    const auto zero = [&](int dy) { return window.weights[static_cast<size_t>(dy * width + dx)] == 0; };
    for (int dy = 0; dy < height;) {
      const int begin = dy;
      while (dy < height && !zero(dy)) ++dy;
      if (dy > begin) window.runs[dx % 4].push_back({dx, begin, dy});
      while (dy < height && zero(dy)) ++dy, window.dense = false;
    }
  }
  return window;
}

void RunDirect(const DirectWindow& window, const FirTile& tile) {
  HWY_DYNAMIC_DISPATCH(RunDirectTarget)(window, tile);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
