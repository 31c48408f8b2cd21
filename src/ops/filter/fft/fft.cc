// Blocks through the transform: mean out, columns, transpose, rows, spectrum, and back.
//
// A block is real: its right half goes as the imaginary part of its left half, so that columns are half as
// many; what belongs to either is told apart between columns and rows, and of the rows, too, half are enough.
#include "ops/filter/fft/fft.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/fft/fft.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fft-inl.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::V;

constexpr int kLanes = s::kLanes;
// The largest deviation, in mean magnitudes, of what is transformed in floats, and the largest sample: sums
// of a block stay far from the ends of float's range.
constexpr float kWidest = 16, kLargest = 1e30f;

// Two planes of numbers, the real and the imaginary parts. Rows are padded so that a column's samples fall
// into different cache sets.
template <class T>
struct Planes {
  T *re, *im;
};
ptrdiff_t HalfStride(int size) { return size / 2 + 16; }  // size rows of size / 2 columns
ptrdiff_t WholeStride(int size) { return size + 16; }     // size / 2 rows of size columns
ptrdiff_t PlaneSize(int size) { return HalfStride(size) * size; }

template <class T>
void TransformColumns(const Planes<T>& p, const FftKernel& k, bool inverse, const T* twiddles) {
  const auto lanes = static_cast<int>(hn::Lanes(s::FftTag<T>()));
  for (int x = 0; x < k.size / 2; x += lanes) {
    const s::Columns<T> columns{p.re + x, p.im + x, HalfStride(k.size)};
    if (inverse) {
      s::InverseColumns(columns, k.size, twiddles);
    } else {
      s::ForwardColumns(columns, k.size, twiddles);
    }
  }
}

// A row of frequencies of both halves.
template <class T>
struct FrequencyRow {
  T *re, *im;
};
// f(row and its negative of the columns' transform, row of the halves' transforms, x) for all but the two
// frequencies that are real.
template <class T, class F>
HWY_INLINE void ForFrequencies(const FftKernel& k, const Planes<T>& packed, const Planes<T>& apart,
                               const F& f) {
  const auto lanes = static_cast<int>(hn::Lanes(s::FftTag<T>()));
  for (int n = 1; n < k.size / 2; ++n) {
    const ptrdiff_t low = k.row_of[static_cast<size_t>(n)] * HalfStride(k.size),
                    high = k.row_of[static_cast<size_t>(k.size - n)] * HalfStride(k.size);
    const FrequencyRow<T> a{packed.re + low, packed.im + low}, b{packed.re + high, packed.im + high},
        to{apart.re + n * WholeStride(k.size), apart.im + n * WholeStride(k.size)};
    for (int x = 0; x < k.size / 2; x += lanes) f(a, b, to, x);
  }
}

// From the columns' transforms, a half in each part, to rows of frequencies, all doubled but the first: that
// holds frequency 0 and, as its imaginary part, frequency size / 2, both of which are real.
template <class T>
void Separate(const FftKernel& k, const Planes<T>& packed, const Planes<T>& apart) {
  const s::FftTag<T> d;
  const int half = k.size / 2;
  const ptrdiff_t last = k.row_of[static_cast<size_t>(half)] * HalfStride(k.size);
  std::copy_n(packed.re, half, apart.re);
  std::copy_n(packed.im, half, apart.re + half);
  std::copy_n(packed.re + last, half, apart.im);
  std::copy_n(packed.im + last, half, apart.im + half);
  ForFrequencies(k, packed, apart, [&](const auto& a, const auto& b, const auto& to, int x) HWY_ATTR {
    const auto are = hn::LoadU(d, a.re + x), aim = hn::LoadU(d, a.im + x), bre = hn::LoadU(d, b.re + x),
               bim = hn::LoadU(d, b.im + x);
    hn::StoreU(hn::Add(are, bre), d, to.re + x);
    hn::StoreU(hn::Sub(aim, bim), d, to.im + x);
    hn::StoreU(hn::Add(aim, bim), d, to.re + half + x);
    hn::StoreU(hn::Sub(bre, are), d, to.im + half + x);
  });
}
// And back, without halves.
template <class T>
void Join(const FftKernel& k, const Planes<T>& apart, const Planes<T>& packed) {
  const s::FftTag<T> d;
  const int half = k.size / 2;
  const ptrdiff_t last = k.row_of[static_cast<size_t>(half)] * HalfStride(k.size);
  std::copy_n(apart.re, half, packed.re);
  std::copy_n(apart.re + half, half, packed.im);
  std::copy_n(apart.im, half, packed.re + last);
  std::copy_n(apart.im + half, half, packed.im + last);
  ForFrequencies(k, packed, apart, [&](const auto& a, const auto& b, const auto& from, int x) HWY_ATTR {
    const auto lre = hn::LoadU(d, from.re + x), lim = hn::LoadU(d, from.im + x),
               rre = hn::LoadU(d, from.re + half + x), rim = hn::LoadU(d, from.im + half + x);
    hn::StoreU(hn::Sub(lre, rim), d, a.re + x);
    hn::StoreU(hn::Add(lim, rre), d, a.im + x);
    hn::StoreU(hn::Add(lre, rim), d, b.re + x);
    hn::StoreU(hn::Sub(rre, lim), d, b.im + x);
  });
}

// The spectrum of a block, of which `p` holds the left and the right half, in `q`, transposed.
template <class T>
void Forward(const FftKernel& k, const T* twiddles, const Planes<T>& p, const Planes<T>& q) {
  TransformColumns(p, k, false, twiddles);
  Separate(k, p, q);
  s::Transpose(q.re, WholeStride(k.size), p.re, HalfStride(k.size), k.size / 2, k.size);
  s::Transpose(q.im, WholeStride(k.size), p.im, HalfStride(k.size), k.size / 2, k.size);
  TransformColumns(p, k, false, twiddles);
}

// The two real frequencies of the columns, whose transforms along rows lie in one complex column.
template <class T>
void MultiplyEdges(const FftKernel& k, const FftKernel::Spectrum<T>& spectrum, const Planes<T>& p) {
  const ptrdiff_t stride = HalfStride(k.size);
  for (int l = 0; l <= k.size / 2; ++l) {
    const ptrdiff_t a = k.row_of[static_cast<size_t>(l)] * stride,
                    b = k.row_of[static_cast<size_t>((k.size - l) % k.size)] * stride;
    // Of frequency 0 and of size / 2; those of -l are their conjugates.
    const T re[2] = {(p.re[a] + p.re[b]) / 2, (p.im[a] + p.im[b]) / 2},
            im[2] = {(p.im[a] - p.im[b]) / 2, (p.re[b] - p.re[a]) / 2};
    const auto& w = spectrum.edges[static_cast<size_t>(l)];
    const T re0 = re[0] * w.re[0] - im[0] * w.im[0], im0 = re[0] * w.im[0] + im[0] * w.re[0];
    const T re1 = re[1] * w.re[1] - im[1] * w.im[1], im1 = re[1] * w.im[1] + im[1] * w.re[1];
    p.re[b] = re0 + im1, p.im[b] = re1 - im0;
    p.re[a] = re0 - im1, p.im[a] = re1 + im0;
  }
}

template <class T>
void Multiply(const FftKernel& k, const FftKernel::Spectrum<T>& spectrum, const Planes<T>& p) {
  const s::FftTag<T> d;
  const int half = k.size / 2;
  const ptrdiff_t stride = HalfStride(k.size);
  MultiplyEdges(k, spectrum, p);
  for (int y = 0; y < k.size; ++y) {
    const T edge_re = p.re[y * stride], edge_im = p.im[y * stride];
    for (int x = 0; x < half; x += static_cast<int>(hn::Lanes(d))) {
      const ptrdiff_t at = y * stride + x, of = static_cast<ptrdiff_t>(y) * half + x;
      const typename s::Columns<T>::Value v{hn::LoadU(d, p.re + at), hn::LoadU(d, p.im + at)};
      const auto r =
          s::Twiddle<false>(v, hn::LoadU(d, spectrum.re.data() + of), hn::LoadU(d, spectrum.im.data() + of));
      hn::StoreU(r.re, d, p.re + at);
      hn::StoreU(r.im, d, p.im + at);
    }
    p.re[y * stride] = edge_re, p.im[y * stride] = edge_im;
  }
}

// A block filtered in place; the other two planes are scratch.
template <class T>
void Filter(const FftKernel& k, const FftKernel::Spectrum<T>& spectrum, const Planes<T>& p,
            const Planes<T>& q) {
  const T* const twiddles = spectrum.twiddles.data();
  Forward(k, twiddles, p, q);
  Multiply(k, spectrum, p);
  TransformColumns(p, k, true, twiddles);
  s::Transpose(p.re, HalfStride(k.size), q.re, WholeStride(k.size), k.size, k.size / 2);
  s::Transpose(p.im, HalfStride(k.size), q.im, WholeStride(k.size), k.size, k.size / 2);
  Join(k, q, p);
  TransformColumns(p, k, true, twiddles);
}

// The same through doubles in `scratch`.
HWY_NOINLINE void FilterInDouble(const FftKernel& k, const Planes<float>& p, double* scratch) {
  const ptrdiff_t plane = PlaneSize(k.size);
  const Planes<double> a{scratch, scratch + plane}, b{scratch + 2 * plane, scratch + 3 * plane};
  std::copy_n(p.re, plane, a.re);
  std::copy_n(p.im, plane, a.im);
  Filter(k, k.precise, a, b);
  std::transform(a.re, a.re + plane, p.re, [](double v) { return static_cast<float>(v); });
  std::transform(a.im, a.im + plane, p.im, [](double v) { return static_cast<float>(v); });
}

// The largest magnitude of a block; not finite where one of them is not: as bits these are in order.
float Largest(const Planes<float>& p, int size) {
  const s::DI di;
  auto largest = hn::Zero(di);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size / 2; x += kLanes) {
      for (const float* part : {p.re, p.im}) {
        const V v = hn::Abs(hn::LoadU(D(), part + y * HalfStride(size) + x));
        largest = hn::Max(largest, hn::BitCast(di, v));
      }
    }
  }
  return std::bit_cast<float>(hn::GetLane(hn::MaxOfLanes(di, largest)));
}

// `count` samples (whole vectors), less `mean`.
HWY_INLINE void LoadRow(const float* p, int step, int count, V mean, float* to) {
  if (step == 4) {
    for (int x = 0; x < count; x += kLanes)
      hn::StoreU(hn::Sub(s::LoadEveryFourth(p + 4 * x), mean), D(), to + x);
    return;
  }
  for (int x = 0; x < count; ++x) to[x] = p[x * step];
  for (int x = 0; x < count; x += kLanes) hn::StoreU(hn::Sub(hn::LoadU(D(), to + x), mean), D(), to + x);
}
void Load(const FftBlock& b, int size, float mean, const Planes<float>& p) {
  for (int y = 0; y < size; ++y) {
    const float* const in = b.in + y * b.in_stride;
    LoadRow(in, b.step, size / 2, hn::Set(D(), mean), p.re + y * HalfStride(size));
    LoadRow(in + ptrdiff_t{b.step} * (size / 2), b.step, size / 2, hn::Set(D(), mean),
            p.im + y * HalfStride(size));
  }
}

bool Channel(const FftKernel& k, const FftBlock& b, int y0, int y1, float* results, float* scratch) {
  const int size = k.size;
  const ptrdiff_t plane = PlaneSize(size);
  const Planes<float> p{scratch, scratch + plane}, q{scratch + 2 * plane, scratch + 3 * plane};
  // Any number near the mean serves: what is transformed is small, and so is its rounding error.
  constexpr int kSparse = 8;
  double sum = 0, magnitude = 0;
  for (int y = 0; y < size; y += kSparse) {
    const float* const in = b.in + y * b.in_stride;
    for (int x = 0; x < size; x += kSparse) sum += in[x * b.step], magnitude += std::fabs(in[x * b.step]);
  }
  const double samples = double{1} * size / kSparse * size / kSparse;
  auto mean = static_cast<float>(sum / samples);
  Load(b, size, mean, p);
  const float largest = Largest(p, size);
  const bool overflows = !(largest < kLargest);
  if (largest == 0) {
    // What is the same everywhere is its mean alone.
  } else if (overflows || largest > kWidest * magnitude / samples) {
    // Not even the mean is taken out: in floats that would round the dark away.
    mean = 0;
    Load(b, size, mean, p);
    if (overflows && !std::isfinite(Largest(p, size))) return false;
    FilterInDouble(k, p, reinterpret_cast<double*>(q.re));
  } else {
    Filter(k, k.single, p, q);
  }
  const V back = hn::Set(D(), static_cast<float>(mean * k.sum));
  for (int y = y0; y < y1; ++y) {
    float* const to = results + ptrdiff_t{y} * size;
    for (int x = 0; x < size / 2; x += kLanes) {
      const ptrdiff_t at = y * HalfStride(size) + x;
      hn::StoreU(hn::Add(hn::LoadU(D(), p.re + at), back), D(), to + x);
      hn::StoreU(hn::Add(hn::LoadU(D(), p.im + at), back), D(), to + size / 2 + x);
    }
  }
  return true;
}

void Interleave(const FftResults& r, int size) {
  for (int y = r.y0; y < r.y1; ++y) {
    float* to = r.out + (y - r.y0) * r.out_stride;
    const ptrdiff_t row = ptrdiff_t{y} * size;
    int x = r.x0;
    if (r.step == 4 && r.channels == 4) {
      for (; x + kLanes <= r.x1; x += kLanes, to += 4 * kLanes) {
        s::StoreInterleaved({hn::LoadU(D(), r.plane[0] + row + x), hn::LoadU(D(), r.plane[1] + row + x),
                             hn::LoadU(D(), r.plane[2] + row + x), hn::LoadU(D(), r.plane[3] + row + x)},
                            to);
      }
    }
    for (; x < r.x1; ++x, to += r.step) {
      for (int c = 0; c < r.channels; ++c) to[c] = r.plane[c][row + x];
    }
  }
}

FftFunctions FftOfTarget() { return {Channel, Interleave}; }

// Fills the spectra of a kernel that has its size.
void MakeSpectra(FftKernel& k, const double* weights) {
  const int size = k.size, half = size / 2;
  const ptrdiff_t stride = HalfStride(size), plane = PlaneSize(size);
  for (int n = 0; n < size; ++n) {
    k.row_of.push_back(s::RowOfFrequency(n, size));
    const double angle = 2 * std::numbers::pi * n / size;
    k.precise.twiddles.insert(k.precise.twiddles.end(), {std::cos(angle), -std::sin(angle)});
  }
  std::vector<double> work(static_cast<size_t>(4 * plane), 0.0);
  const Planes<double> p{work.data(), work.data() + plane}, q{p.re + 2 * plane, p.re + 3 * plane};
  // A correlation multiplies by the spectrum of the kernel turned round, cyclically.
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x) {
      const double w = weights[y * k.width + x];
      const int column = (size - x) % size;
      double* const part = column < half ? p.re : p.im;
      part[(size - y) % size * stride + column % half] = w / size / size;
      k.sum += w;
    }
  }
  Forward(k, k.precise.twiddles.data(), p, q);
  for (int l = 0; l <= half; ++l) {
    const ptrdiff_t a = k.row_of[static_cast<size_t>(l)] * stride,
                    b = k.row_of[static_cast<size_t>((size - l) % size)] * stride;
    k.precise.edges.push_back({{(p.re[a] + p.re[b]) / 2, (p.im[a] + p.im[b]) / 2},
                               {(p.im[a] - p.im[b]) / 2, (p.re[b] - p.re[a]) / 2}});
  }
  // Both the kernel's transform and the block's are doubled.
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < half; ++x) {
      k.precise.re.push_back(p.re[y * stride + x] / 4);
      k.precise.im.push_back(p.im[y * stride + x] / 4);
    }
  }
  k.single.twiddles.assign(k.precise.twiddles.begin(), k.precise.twiddles.end());
  k.single.re.assign(k.precise.re.begin(), k.precise.re.end());
  k.single.im.assign(k.precise.im.begin(), k.precise.im.end());
  for (const auto& e : k.precise.edges) {
    const auto part = [](double v) { return static_cast<float>(v); };
    k.single.edges.push_back({{part(e.re[0]), part(e.re[1])}, {part(e.im[0]), part(e.im[1])}});
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(FftOfTarget);
HWY_EXPORT(MakeSpectra);

// The block with the least work per result.
int BlockSize(int largest) {
  int best = 64;
  double least = 1e30;
  for (const int size : {64, 128, 256, 512}) {
    if (size < 2 * largest) continue;
    // Beyond 128 the block leaves the fast half of the second cache.
    const double results = double{1} * (size - largest + 1) * (size - largest + 1);
    const double cost = double{1} * size * size * std::log2(size) * (size > 128 ? 1.4 : 1) / results;
    if (cost < least) least = cost, best = size;
  }
  return best;
}

}  // namespace

FftKernel MakeFftKernel(int width, int height, const std::vector<double>& weights) {
  FftKernel k;
  k.width = width, k.height = height, k.size = BlockSize(std::max(width, height));
  HWY_DYNAMIC_DISPATCH(MakeSpectra)(k, weights.data());
  return k;
}

// Four planes, the last two of which may be four of doubles.
size_t FftScratchFloats(const FftKernel& k) {
  return static_cast<size_t>(10 * (k.size / 2 + 16) * k.size) + 64;
}

FftFunctions ChooseFft() { return HWY_DYNAMIC_DISPATCH(FftOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
