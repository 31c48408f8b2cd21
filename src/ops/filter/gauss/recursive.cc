// Recursive Gaussian: coefficients in double, sums in float32, 32 samples side by side.
#include "ops/filter/gauss/recursive.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "ops/filter/lines/extend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/gauss/recursive.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/lines/tracks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
constexpr int kPairs = RecursiveGaussian::kPairs;

struct State {
  V v[kFlight][kPairs], u[kFlight][kPairs];
};

HWY_INLINE void Advance(const RecursiveGaussian& g, State& state, int j, V x) {
  const D d;
  HWY_UNROLL(4)
  for (int k = 0; k < kPairs; ++k) {
    state.v[j][k] = hn::NegMulAdd(hn::Set(d, g.step[k]), state.u[j][k],
                                  hn::MulAdd(hn::Set(d, g.decay[k]), state.v[j][k], x));
    state.u[j][k] = hn::MulAdd(hn::Set(d, g.step[k]), state.v[j][k], state.u[j][k]);
  }
}
HWY_INLINE V Output(const float (&of_v)[kPairs], const float (&of_u)[kPairs], const State& state, int j,
                    V sum) {
  const D d;
  HWY_UNROLL(4)
  for (int k = 0; k < kPairs; ++k) {
    sum = hn::MulAdd(hn::Set(d, of_v[k]), state.v[j][k], hn::MulAdd(hn::Set(d, of_u[k]), state.u[j][k], sum));
  }
  return sum;
}

// The state after endlessly many samples x: v = 0, u = x / step.
HWY_INLINE void Settle(const RecursiveGaussian& g, State& state, int j, V x) {
  const D d;
  HWY_UNROLL(4)
  for (int k = 0; k < kPairs; ++k) {
    state.v[j][k] = hn::Zero(d);
    state.u[j][k] = hn::Mul(hn::Set(d, 1 / g.step[k]), x);
  }
}

// One line of every track: `length` samples. Everything is computed relative to the first sample, so that
// flat lines stay as they are to the last bit. `scale`, when not null, multiplies sample n.
template <class Io>
void Line(const RecursiveGaussian& g, const Io& io, int length, const AxisBorder& border, const float* scale,
          float* HWY_RESTRICT forward) {
  const D d;
  constexpr int kPrefetch = 12;
  State state;
  V origin[kFlight];
  const V beyond = hn::Set(d, border.value);
  const bool mapped = border.rule == AxisBorder::kMapped;
  for (int j = 0; j < kFlight; ++j) {
    origin[j] = io.Read(0, j);
    const V x = border.rule == AxisBorder::kEdge ? hn::Zero(d) : hn::Sub(beyond, origin[j]);
    Settle(g, state, j, mapped ? hn::Zero(d) : x);
  }
  for (int n = -g.warm_up; mapped && n < 0; ++n) {
    for (int j = 0; j < kFlight; ++j) Advance(g, state, j, hn::Sub(io.Read(border.Shown(n), j), origin[j]));
  }
  for (int n = 0; n < length; ++n) {
    io.Prefetch(std::min(n + kPrefetch, length - 1));
    HWY_UNROLL(2)
    for (int j = 0; j < kFlight; ++j) {
      Advance(g, state, j, hn::Sub(io.Read(n, j), origin[j]));
      // The origin is added back here once for both directions.
      hn::Store(Output(g.forward_v, g.forward_u, state, j, origin[j]), d,
                forward + (n * kFlight + j) * kLanes);
    }
  }
  for (int j = 0; j < kFlight; ++j) {
    const V x = border.rule == AxisBorder::kEdge ? io.Read(length - 1, j) : beyond;
    Settle(g, state, j, mapped ? hn::Zero(d) : hn::Sub(x, origin[j]));
  }
  for (int n = length - 1 + g.warm_up; mapped && n >= length; --n) {
    for (int j = 0; j < kFlight; ++j) Advance(g, state, j, hn::Sub(io.Read(border.Shown(n), j), origin[j]));
  }
  for (int n = length - 1; n >= 0; --n) {
    io.Prefetch(std::max(n - kPrefetch, 0));
    HWY_UNROLL(2)
    for (int j = 0; j < kFlight; ++j) {
      const V x = hn::Sub(io.Read(n, j), origin[j]);
      V sum = Output(g.backward_v, g.backward_u, state, j, hn::Load(d, forward + (n * kFlight + j) * kLanes));
      Advance(g, state, j, x);
      if (scale != nullptr) sum = hn::Mul(sum, hn::Set(d, scale[n]));
      io.Write(sum, n, j);
    }
  }
}

struct GaussianLine {
  const RecursiveGaussian& gaussian;
  template <class Io>
  void operator()(const Io& io, int length, const AxisBorder& border, const float* scale,
                  float* scratch) const {
    Line(gaussian, io, length, border, scale, scratch);
  }
};

void GaussianTracks(const RecursiveGaussian& g, const TrackBlock& b, bool rgba_rows, const AxisBorder& border,
                    const float* scale, float* scratch) {
  ForLines(GaussianLine{g}, b, rgba_rows, border, scale, scratch);
}
GaussianTracksFunction GaussianTracksOfTarget() { return GaussianTracks; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(GaussianTracksOfTarget);

// exp(-t^2 / 2) for t >= 0 as the sum of exp(-c t) (a cos(d t) + b sin(d t)): least absolute differences,
// found by reweighted least squares over [0, 9]. The L1 distance is 6.6e-6 of the integral.
struct Term {
  double a, b, c, d;
};
constexpr Term kTerms[RecursiveGaussian::kPairs] = {
    {3.2320725584251506, 7.922840359622997, 2.2141313953893325, 0.5287067936452774},
    {-2.404891672593372, -1.1394847264892691, 2.1855773220104964, 1.621857851750768},
    {0.17279341729979364, -0.025711260972955636, 2.118170383075991, 2.86417744264137}};

}  // namespace

RecursiveGaussian MakeRecursiveGaussian(double sigma) {
  RecursiveGaussian g;
  double v[2][RecursiveGaussian::kPairs], u[2][RecursiveGaussian::kPairs], sum = 0;
  for (int k = 0; k < RecursiveGaussian::kPairs; ++k) {
    const Term& t = kTerms[k];
    const std::complex<double> ideal = std::exp(std::complex<double>(-t.c, t.d) / sigma);
    g.decay[k] = static_cast<float>(std::norm(ideal));
    g.step[k] = static_cast<float>(std::abs(1.0 - ideal));
    // The pole that the rounded numbers have.
    const double decay = g.decay[k], step = g.step[k], real = (1 + decay - step * step) / 2;
    const double imaginary = std::sqrt(std::max(0.0, decay - real * real));
    // (A + B / z) / (1 - 2 Re(p) / z + |p|^2 / z^2) is the causal sum, the same without its first sample the
    // other.
    const double first = t.a, second = -(t.a * real - t.b * imaginary);
    v[0][k] = -second, u[0][k] = (first + second) / step;
    const double third = second + 2 * real * first, fourth = -first * decay;
    v[1][k] = -fourth, u[1][k] = (third + fourth) / step;
    sum += (u[0][k] + u[1][k]) / step;
  }
  // Weights sum to 1: the rounding errors of u, the only states that a constant reaches, go into the largest.
  double rounded = 0;
  int largest = 0;
  for (int k = 0; k < RecursiveGaussian::kPairs; ++k) {
    g.forward_v[k] = static_cast<float>(v[0][k] / sum), g.forward_u[k] = static_cast<float>(u[0][k] / sum);
    g.backward_v[k] = static_cast<float>(v[1][k] / sum), g.backward_u[k] = static_cast<float>(u[1][k] / sum);
    rounded += (double{g.forward_u[k]} + double{g.backward_u[k]}) / g.step[k];
    if (std::fabs(g.forward_u[k]) < std::fabs(g.forward_u[largest])) largest = k;
  }
  g.forward_u[largest] = static_cast<float>(g.forward_u[largest] + (1 - rounded) * g.step[largest]);
  g.warm_up = static_cast<int>(std::ceil(8 * sigma)) + 8;
  return g;
}

std::vector<double> RecursiveGaussian::Response(int length) const {
  std::vector<double> response(static_cast<size_t>(length), 0);
  for (int k = 0; k < kPairs; ++k) {
    double sv = 0, su = 0;
    for (int n = 0; n < length; ++n) {
      sv = decay[k] * sv - step[k] * su + (n == 0 ? 1 : 0);
      su += step[k] * sv;
      response[static_cast<size_t>(n)] += forward_v[k] * sv + forward_u[k] * su;
    }
  }
  return response;
}

std::vector<double> WeightsInside(const RecursiveGaussian& gaussian, int length) {
  const std::vector<double> response = gaussian.Response(length);
  std::vector<double> sums(response.size() + 1, 0), inside(response.size());
  for (size_t n = 0; n < response.size(); ++n) sums[n + 1] = sums[n] + response[n];
  for (size_t n = 0; n < inside.size(); ++n) inside[n] = sums[n + 1] + sums[inside.size() - n] - response[0];
  return inside;
}

GaussianTracksFunction ChooseGaussianTracks() { return HWY_DYNAMIC_DISPATCH(GaussianTracksOfTarget)(); }

void RunRecursive(GaussianTracksFunction tracks, const RecursiveGaussian* x, const RecursiveGaussian* y,
                  const ConstImageView& in, const ImageView& out, Wrap wrap, double border_value,
                  const graph::Workers& workers) {
  FilterLines(
      x != nullptr, y != nullptr, in, out, workers,
      [&](int axis, const TrackBlock& block, bool rgba_rows, const float* scale, float* scratch) {
        tracks(axis == 0 ? *x : *y, block, rgba_rows, AxisBorder(wrap, border_value, block.length), scale,
               scratch);
      },
      [&](int axis, int length) {
        std::vector<float> scale;
        if (wrap != Wrap::kRenormalize) return scale;
        for (const double w : WeightsInside(axis == 0 ? *x : *y, length))
          scale.push_back(static_cast<float>(1 / w));
        return scale;
      });
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
