// Weighted sums of rows: every image is read once, the sum stays in registers, in double.
#include "ops/accumulate/sum_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/accumulate/sum_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// How a sum is kept between two images.
struct Exact {
  template <class V>
  HWY_INLINE V operator()(V sum) const {
    return sum;
  }
};
struct Fixed {
  double one, over;
  template <class V>
  HWY_INLINE V operator()(V sum) const {
    const hn::DFromV<V> d;
    const V code = hn::Round(hn::Mul(sum, hn::Set(d, one)));
    const V limited = hn::Min(hn::Max(code, hn::Set(d, -one)), hn::Set(d, one));
    return hn::IfThenElse(hn::IsNaN(sum), hn::Zero(d), hn::Mul(limited, hn::Set(d, over)));
  }
};

// Samples whose sums stay in L1 while the images pass: every image is read in runs that its prefetcher sees, four at
// a time, for more would compete for the same cache sets (large images lie at equal offsets within their pages).
constexpr int64_t kBlock = 256;
constexpr size_t kTogether = 4;

// Adds images [k, k + kCount) to the sums of `count` samples; the first of all images starts them.
template <class D, size_t kCount, class Keep>
HWY_INLINE void AddImages(D d, const SumJob& job, size_t k, int64_t begin, int64_t count, double* sums, const Keep& keep) {
  const hn::Rebind<float, D> f;
  const float* row[kCount];
  hn::Vec<D> weight[kCount];
  for (size_t j = 0; j < kCount; ++j) row[j] = job.rows[k + j] + begin, weight[j] = hn::Set(d, job.weights[k + j]);
  const auto step = static_cast<int64_t>(hn::Lanes(d));
  for (int64_t i = 0; i + step <= count; i += step) {
    // The run that follows when the other images have had theirs.
    for (size_t j = 0; j < kCount && i % 16 == 0; ++j) hwy::Prefetch(row[j] + i + kBlock);
    const auto value = [&](size_t j) HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(f, row[j] + i)); };
    hn::Vec<D> sum = keep(k == 0 ? hn::Mul(value(0), weight[0]) : hn::MulAdd(value(0), weight[0], hn::LoadU(d, sums + i)));
    for (size_t j = 1; j < kCount; ++j) sum = keep(hn::MulAdd(value(j), weight[j], sum));
    hn::StoreU(sum, d, sums + i);
  }
}

// Sums of one block, `count` a multiple of D's lanes.
template <class D, class Keep>
HWY_INLINE void SumBlock(D d, const SumJob& job, int64_t begin, int64_t count, double* sums, const Keep& keep) {
  size_t k = 0;
  for (; k + kTogether <= job.rows.size(); k += kTogether) {
    AddImages<D, kTogether>(d, job, k, begin, count, sums, keep);
  }
  for (; k < job.rows.size(); ++k) AddImages<D, 1>(d, job, k, begin, count, sums, keep);
}

// Rounds sums to floats. Every NaN becomes the same one: which of several a sum passes on depends on the compiler.
template <class D>
HWY_INLINE hn::Vec<hn::Rebind<float, D>> Rounded(D d, const double* sum, double factor) {
  const hn::Rebind<float, D> f;
  const auto scaled = hn::Mul(hn::LoadU(d, sum), hn::Set(d, factor));
#if HWY_TARGET == HWY_SCALAR
  const auto value = hn::Set(f, static_cast<float>(hn::GetLane(scaled)));  // DemoteTo would make infinity finite
#else
  const auto value = hn::DemoteTo(f, scaled);
#endif
  const auto nan = hn::BitCast(f, hn::Set(hn::RebindToUnsigned<decltype(f)>(), 0x7FC00000u));
  return hn::IfThenElse(hn::IsNaN(value), nan, value);
}

template <class Keep>
void SumRow(const SumJob& job, const Keep& keep) {
  alignas(64) double sums[kBlock];
  const hn::CappedTag<double, 8> d;
  const hn::CappedTag<double, 1> one;
  const auto n = static_cast<int64_t>(hn::Lanes(d));
  for (int64_t begin = 0; begin < job.count; begin += kBlock) {
    const int64_t count = std::min(kBlock, job.count - begin), whole = count / (2 * n) * (2 * n);
    float* const out = job.out + begin;
    int64_t i = 0;
    SumBlock(d, job, begin, whole, sums, keep);
#if HWY_TARGET != HWY_SCALAR
    const hn::Twice<hn::Rebind<float, decltype(d)>> pair;
    const bool stream = job.stream && reinterpret_cast<uintptr_t>(out) % (2 * sizeof(float) * hn::Lanes(d)) == 0;
    for (; i < whole; i += 2 * n) {
      const auto both = hn::Combine(pair, Rounded(d, sums + i + n, job.factor), Rounded(d, sums + i, job.factor));
      if (stream) {
        hn::Stream(both, pair, out + i);
      } else {
        hn::StoreU(both, pair, out + i);
      }
    }
#else
    for (; i < whole; ++i) hn::StoreU(Rounded(one, sums + i, job.factor), hn::CappedTag<float, 1>(), out + i);
#endif
    SumBlock(one, job, begin + i, count - i, sums, keep);
    for (int64_t k = 0; i < count; ++i, ++k) {
      hn::StoreU(Rounded(one, sums + k, job.factor), hn::Rebind<float, decltype(one)>(), out + i);
    }
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
