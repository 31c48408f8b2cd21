// Codes are whole numbers below 2^16: sums of their products with weights in double are exact to 1e-9 of a
// code, where floats would leave every twentieth result of a 16-bit image to be summed anew.
#include "ops/filter/codes/codes.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/codes/codes.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/codes/codes-inl.h"

#ifndef TESSERA_OPS_FILTER_CODES_CODES_CC_
#define TESSERA_OPS_FILTER_CODES_CODES_CC_
namespace tessera::ops {
constexpr int kCodeRows = CodesWindow::kPadding + 1;  // output rows that share their loads
}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_CODES_CODES_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

constexpr int kVectors = kCodeBlock / kDoubles;

// The codes of `count` samples, what is no code as 0; whether all are. Both may be read and written in whole
// blocks.
bool ToCodes(const float* samples, int count, int largest, float* codes) {
  const DD d;
  const DF f;
  const VD scale = hn::Set(d, static_cast<double>(largest));
  auto all = hn::Eq(scale, scale);
  HWY_ALIGN float tail[kDoubles] = {};
  for (int i = 0; i < count; i += kDoubles) {
    const float* from = samples + i;
    if (count - i < kDoubles) {
      std::memcpy(tail, from, static_cast<size_t>(count - i) * sizeof(float));
      from = tail;
    }
    const VD code = hn::Mul(hn::PromoteTo(d, hn::LoadU(f, from)), scale), nearest = hn::Round(code);
    const auto whole = hn::Lt(hn::Abs(hn::Sub(code, nearest)), hn::Set(d, kWholeCode));
    all = hn::And(all, whole);
    if (codes != nullptr) hn::StoreU(ToFloats(d, hn::IfThenElseZero(whole, nearest)), f, codes + i);
  }
  return hn::AllTrue(d, all);
}

// sum[r] += the products of a padded column of weights with `rows` rows of samples from `in` on.
template <int kR>
HWY_INLINE void AddColumn(VD (&sum)[kR][kVectors], const double* HWY_RESTRICT weights, const float* in,
                          ptrdiff_t stride, int height) {
  const DD d;
  weights += kCodeRows - 1;
  for (int i = 0; i < height + kR - 1; ++i, in += stride) {
    VD v[kVectors];
    for (int j = 0; j < kVectors; ++j) v[j] = hn::PromoteTo(d, hn::LoadU(DF(), in + j * kDoubles));
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) {
      const VD w = hn::Set(d, weights[i - r]);
      for (int j = 0; j < kVectors; ++j) sum[r][j] = hn::MulAdd(v[j], w, sum[r][j]);
    }
  }
}

template <int kR>
HWY_INLINE void Clear(VD (&sum)[kR][kVectors]) {
  for (auto& row : sum) {
    for (VD& v : row) v = hn::Zero(DD());
  }
}

HWY_INLINE void StoreSettled(const VD (&sum)[kVectors], VD unit, float* to, int count) {
  const DD d;
  HWY_ALIGN float tail[kCodeBlock];
  float* const at = count < kCodeBlock ? tail : to;
  for (int j = 0; j < kVectors; ++j)
    hn::StoreU(ToFloats(d, hn::Mul(Settled(d, sum[j]), unit)), DF(), at + j * kDoubles);
  if (count < kCodeBlock) std::memcpy(to, tail, static_cast<size_t>(count) * sizeof(float));
}

template <int kR>
void DirectCodes(const CodesWindow& w, VD unit, const FloatTile& t, int y) {
  for (int x = 0; x < t.samples; x += kCodeBlock) {
    VD sum[kR][kVectors];
    Clear(sum);
    const double* column = w.columns.data();
    for (int dx = 0; dx < w.width; ++dx, column += w.height + 2 * (kCodeRows - 1)) {
      AddColumn(sum, column, t.in + y * t.in_stride + x + dx * t.channels, t.in_stride, w.height);
    }
    for (int r = 0; r < kR; ++r)
      StoreSettled(sum[r], unit, t.out + (y + r) * t.out_stride + x, t.samples - x);
  }
}

template <int kR>
void SeparableCodes(const CodesWindow& w, VD unit, const FloatTile& t, int y, double* HWY_RESTRICT sums,
                    ptrdiff_t stride) {
  const DD d;
  const int wide = t.samples + (w.width - 1) * t.channels;
  for (int x = 0; x < wide; x += kCodeBlock) {
    VD sum[kR][kVectors];
    Clear(sum);
    AddColumn(sum, w.columns.data(), t.in + y * t.in_stride + x, t.in_stride, w.height);
    for (int r = 0; r < kR; ++r) {
      for (int j = 0; j < kVectors; ++j) hn::Store(sum[r][j], d, sums + r * stride + x + j * kDoubles);
    }
  }
  for (int x = 0; x < t.samples; x += kCodeBlock) {
    VD sum[kR][kVectors];
    Clear(sum);
    for (int k = 0; k < w.width; ++k) {
      const VD weight = hn::Set(d, w.row[static_cast<size_t>(k)]);
      const double* const p = sums + x + k * t.channels;
      HWY_UNROLL(4)
      for (int r = 0; r < kR; ++r) {
        for (int j = 0; j < kVectors; ++j)
          sum[r][j] = hn::MulAdd(hn::LoadU(d, p + r * stride + j * kDoubles), weight, sum[r][j]);
      }
    }
    for (int r = 0; r < kR; ++r)
      StoreSettled(sum[r], unit, t.out + (y + r) * t.out_stride + x, t.samples - x);
  }
}

// `t.in` holds codes, with whole blocks to read at the ends of rows; `sums` is kCodeRows rows of `stride`.
void SumCodes(const CodesWindow& w, int largest, const FloatTile& t, double* sums, ptrdiff_t stride) {
  const VD unit = hn::Set(DD(), 1.0 / largest);
  int y = 0;
  if (!w.row.empty()) {
    for (; y + kCodeRows <= t.rows; y += kCodeRows) SeparableCodes<kCodeRows>(w, unit, t, y, sums, stride);
    for (; y < t.rows; ++y) SeparableCodes<1>(w, unit, t, y, sums, stride);
  } else if (w.height <= kCodeRows) {
    // Rows of zeros beside a short column cost more than sharing loads saves.
    for (; y + 2 <= t.rows; y += 2) DirectCodes<2>(w, unit, t, y);
  } else {
    for (; y + kCodeRows <= t.rows; y += kCodeRows) DirectCodes<kCodeRows>(w, unit, t, y);
  }
  if (w.row.empty()) {
    for (; y < t.rows; ++y) DirectCodes<1>(w, unit, t, y);
  }
}

CodesFunctions CodesOfTarget() { return {ToCodes, SumCodes}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(CodesOfTarget);

// Appends column `x` of weights of `width` columns, between zeros.
void AppendColumn(const double* weights, int x, int width, int height, std::vector<double>& columns) {
  columns.insert(columns.end(), kCodeRows - 1, 0.0);
  for (int y = 0; y < height; ++y) columns.push_back(weights[ptrdiff_t{y} * width + x]);
  columns.insert(columns.end(), kCodeRows - 1, 0.0);
}

}  // namespace

CodesWindow MakeCodesWindow(int width, int height, const std::vector<double>& weights) {
  CodesWindow w{width, height, {}, {}};
  for (int x = 0; x < width; ++x) AppendColumn(weights.data(), x, width, height, w.columns);
  return w;
}

CodesWindow MakeCodesWindow(const std::vector<double>& column, const std::vector<double>& row) {
  CodesWindow w{static_cast<int>(row.size()), static_cast<int>(column.size()), {}, row};
  AppendColumn(column.data(), 0, 1, w.height, w.columns);
  return w;
}

CodesFunctions ChooseCodes() { return HWY_DYNAMIC_DISPATCH(CodesOfTarget)(); }

float SettledSample(double exact, double largest) {
  // The sink's product is exact.
  double code = std::floor(exact + 0.5);
  if (std::fabs(exact + 0.5 - std::nearbyint(exact + 0.5)) < kTieOfCodes)
    code = 2 * std::floor((exact + 0.5 + kTieOfCodes) / 2);
  const double margin = (std::fabs(code) + 0.5) * 0x1.2p-24;  // more than the float's own rounding
  return static_cast<float>(std::clamp(exact, code - 0.5 + margin, code + 0.5 - margin) / largest);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
