// Weighted sums of rows: every image is read once, the sum stays in registers, in double.
#include "ops/accumulate/sum_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/accumulate/sum_kernel.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr bool kWide = hn::MaxLanes(hn::CappedTag<double, 8>()) == 8;

// How a sum is kept between two images.
struct Exact {
  static constexpr int kVectors = kWide ? 2 : 4;  // of sums at a time: a line of floats
  template <class V>
  HWY_INLINE V operator()(V sum) const {
    return sum;
  }
};
struct Fixed {
  static constexpr int kVectors = kWide ? 8 : 4;  // each waits for its last rounding
  double one, over;
  template <class V>
  HWY_INLINE V operator()(V sum) const {
    const hn::DFromV<V> d;
    const V code = hn::Round(hn::Mul(sum, hn::Set(d, one)));
    const V limited = hn::Min(hn::Max(code, hn::Set(d, -one)), hn::Set(d, one));
    return hn::IfThenElse(hn::IsNaN(sum), hn::Zero(d), hn::Mul(limited, hn::Set(d, over)));
  }
};

// Images that are added in registers, before their sum rests in L1. So many streams the prefetchers follow,
// given that every stream has load instructions of its own and its next few lines are asked for.
constexpr size_t kTogether = 16;
// More images are added by eights, which leaves room in L1 for the sums.
constexpr size_t kPart = 8;
constexpr int64_t kBlock = 128;  // samples whose sums rest there

// Rounds a sum to floats. Every NaN becomes the same one: which of several a sum passes on depends on the
// compiler.
template <class D>
HWY_INLINE hn::Vec<hn::Rebind<float, D>> Rounded(D d, hn::Vec<D> sum, double factor) {
  const hn::Rebind<float, D> f;
  const auto scaled = hn::Mul(sum, hn::Set(d, factor));
  const auto value = hn::DemoteTo(f, scaled);
  const auto nan = hn::BitCast(f, hn::Set(hn::RebindToUnsigned<decltype(f)>(), 0x7FC00000u));
  return hn::IfThenElse(hn::IsNaN(value), nan, value);
}

// Adds images [k, k + kCount) to kN vectors of sums from sample `at` on; the first of all images starts them.
template <size_t kCount, bool kFirst, int kN, class D, class Keep>
HWY_INLINE void AddSome(D d, const SumJob& job, size_t k, int64_t at, hn::Vec<D> (&sum)[kN],
                        const Keep& keep) {
  const hn::Rebind<float, D> f;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(d)), kLine = 16, kAhead = 6 * kLine;
  const float* const* const rows = job.rows.data() + k;
  const double* const weights = job.weights.data() + k;
  HWY_UNROLL(16)
  for (size_t i = 0; i < kCount; ++i) {
    const auto w = hn::Set(d, weights[i]);
    // The processor alone falls behind with so many streams. No further ahead than this, or they evict each
    // other: large images often lie at equal offsets within their pages and compete for the same sets.
    for (int j = 0; kN > 1 && j < kN * kLanes; j += kLine) hwy::Prefetch(rows[i] + at + j + kAhead);
    HWY_UNROLL(8)
    for (int j = 0; j < kN; ++j) {
      const auto value = hn::PromoteTo(d, hn::LoadU(f, rows[i] + at + j * kLanes));
      sum[j] = keep(kFirst && i == 0 ? hn::Mul(value, w) : hn::MulAdd(value, w, sum[j]));
    }
  }
}

template <int kN, class D, class Keep>
HWY_INLINE void AddImages(D d, const SumJob& job, size_t k, size_t end, int64_t at, hn::Vec<D> (&sum)[kN],
                          const Keep& keep) {
  if (k == 0) {
    if (end >= 16) {
      AddSome<16, true>(d, job, k, at, sum, keep), k += 16;
    } else if (end >= 8) {
      AddSome<8, true>(d, job, k, at, sum, keep), k += 8;
    } else {
      AddSome<1, true>(d, job, k, at, sum, keep), k += 1;
    }
  }
  if (k + 16 <= end) AddSome<16, false>(d, job, k, at, sum, keep), k += 16;
  if (k + 8 <= end) AddSome<8, false>(d, job, k, at, sum, keep), k += 8;
  if (k + 4 <= end) AddSome<4, false>(d, job, k, at, sum, keep), k += 4;
  if (k + 2 <= end) AddSome<2, false>(d, job, k, at, sum, keep), k += 2;
  if (k < end) AddSome<1, false>(d, job, k, at, sum, keep);
}

template <int kVectors, class D>
HWY_INLINE void StoreRounded(D d, const hn::Vec<D> (&sum)[kVectors], double factor, float* out, bool stream) {
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(d));
  const hn::Twice<hn::Rebind<float, D>> pair;
  for (int j = 0; j < kVectors; j += 2) {
    const auto both = hn::Combine(pair, Rounded(d, sum[j + 1], factor), Rounded(d, sum[j], factor));
    if (stream) {
      hn::Stream(both, pair, out + j * kLanes);
    } else {
      hn::StoreU(both, pair, out + j * kLanes);
    }
  }
}

template <class Keep>
void SumRow(const SumJob& job, const Keep& keep) {
  alignas(64) double sums[kBlock];
  const hn::CappedTag<double, 8> d;
  const hn::CappedTag<double, 1> one;
  constexpr int kVectors = Keep::kVectors, kLanes = static_cast<int>(hn::MaxLanes(d)),
                kStep = kVectors * kLanes;
  const size_t images = job.rows.size(), together = images <= kTogether ? kTogether : kPart;
  const bool stream = job.stream && reinterpret_cast<uintptr_t>(job.out) % (2 * sizeof(float) * kLanes) == 0;
  const int64_t whole = job.count / kStep * kStep;
  for (int64_t begin = 0; begin < whole; begin += kBlock) {
    const int64_t end = std::min(begin + kBlock, whole);
    for (size_t k = 0; k < images; k += together) {
      const size_t last = std::min(k + together, images);
      for (int64_t i = begin; i < end; i += kStep) {
        double* const resting = sums + (i - begin);
        hn::Vec<decltype(d)> sum[kVectors];
        for (int j = 0; j < kVectors; ++j) sum[j] = k == 0 ? hn::Zero(d) : hn::Load(d, resting + j * kLanes);
        AddImages(d, job, k, last, i, sum, keep);
        if (last == images) {
          StoreRounded(d, sum, job.factor, job.out + i, stream);
        } else {
          for (int j = 0; j < kVectors; ++j) hn::Store(sum[j], d, resting + j * kLanes);
        }
      }
    }
  }
  for (int64_t i = whole; i < job.count; ++i) {
    hn::Vec<decltype(one)> sum[1] = {hn::Zero(one)};
    for (size_t k = 0; k < images; k += kTogether)
      AddImages(one, job, k, std::min(k + kTogether, images), i, sum, keep);
    hn::StoreU(Rounded(one, sum[0], job.factor), hn::Rebind<float, decltype(one)>(), job.out + i);
  }
}

void Sum(const SumJob& job) {
  if (job.rows.empty()) {
    std::fill_n(job.out, job.count, 0.0f);
  } else if (job.bits == 0) {
    SumRow(job, Exact());
  } else {
    const double one = std::ldexp(1.0, job.bits);
    SumRow(job, Fixed{one, 1 / one});
  }
}

SumFunction SumOfTarget() { return &Sum; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(SumOfTarget);

SumFunction ChooseSum() { return HWY_DYNAMIC_DISPATCH(SumOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
