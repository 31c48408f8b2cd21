// Curves and powers on every target: published values, ULP errors, monotony over the floats, special values,
// round trips.
#include "tessera/ops/curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <any>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "reference/reference.h"
#include "support/every_target.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::OnEveryTarget;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
using Samples = std::vector<float>;

Node Row(const Samples& values, int channels = 1) {
  const int width = 4096 * channels;  // long rows as several lines
  const int count = static_cast<int>(values.size());
  const int columns = std::min(count, width) / channels;
  const Image image(ImageSpec(columns, count / channels / columns, channels));
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  return FromImage(image);
}
Samples Values(const Node& node) {
  const Image image = Render(node);
  const auto* const data = reinterpret_cast<const float*>(image.view().data);
  return {data, data + image.spec().data_window.pixels() * image.spec().channel_count()};
}
TransferFunction Named(const std::string& name) {
  const auto& names = TransferFunctionNames();
  return static_cast<TransferFunction>(std::find(names.begin(), names.end(), name) - names.begin());
}

// |got - want| in units of the last place of want, subnormals included.
double Ulps(float got, double want) {
  if (std::isnan(want) || std::isnan(got)) return std::isnan(want) && std::isnan(got) ? 0 : 1e9;
  const auto rounded = static_cast<float>(want);
  if (std::isinf(rounded) || std::isinf(got)) return got == rounded ? 0 : 1e9;
  int exponent = 0;
  std::frexp(want, &exponent);
  return std::fabs(got - want) / std::ldexp(1.0, std::max(exponent - 24, -149));
}

// Floats over the bit patterns from `first` to before `end`, `step` apart, in parts.
template <class F>
void ForFloats(uint32_t step, F each, uint64_t first = 0, uint64_t end = uint64_t{1} << 32) {
  constexpr size_t kPart = size_t{1} << 22;
  Samples values;
  for (uint64_t bits = first; bits < end; bits += step) {
    values.push_back(std::bit_cast<float>(static_cast<uint32_t>(bits)));
    if (values.size() == kPart) each(values), values.clear();
  }
  values.resize(values.size() / 4096 * 4096);
  if (!values.empty()) each(values);
}

constexpr struct {
  const char* name;
  bool inverse;
  double (*exact)(double);
} kElementary[] = {{"log2", false, [](double v) { return std::log2(std::fmax(v, 0)); }},
                   {"ln", false, [](double v) { return std::log(std::fmax(v, 0)); }},
                   {"log10", false, [](double v) { return std::log10(std::fmax(v, 0)); }},
                   {"log2", true, [](double v) { return std::exp2(v); }},
                   {"ln", true, [](double v) { return std::exp(v); }},
                   {"log10", true, [](double v) { return std::pow(10.0, v); }}};

// The largest error of an elementary function over floats `step` apart, on the target that is set.
double WorstError(size_t function, uint32_t step) {
  const auto& f = kElementary[function];
  double worst = 0;
  ForFloats(step, [&](const Samples& x) {
    const TransferFunction curve = Named(f.name);
    const Samples got = Values(f.inverse ? Decode(Row(x), curve) : Encode(Row(x), curve));
    for (size_t i = 0; i < x.size(); ++i) {
      worst = std::max(worst, Ulps(got[i], std::isnan(x[i]) ? x[i] : f.exact(x[i])));
    }
  });
  return worst;
}

TEST(CurveTest, ElementaryFunctionsAreWithinOneUlp) {
  for (size_t f = 0; f < std::size(kElementary); ++f) {
    SCOPED_TRACE(std::string(kElementary[f].name) + (kElementary[f].inverse ? " inverse" : ""));
    OnEveryTarget([&] { EXPECT_LT(WorstError(f, 2039), 0.54); });
  }
}

// A quarter of an hour: every float, on the best target, which gives the others' bits.
TEST(CurveTest, ElementaryFunctionsAreWithinOneUlpOfAllFloats) {
  if (!std::getenv("TESSERA_LONG_TESTS")) GTEST_SKIP() << "all 2^32 floats; set TESSERA_LONG_TESTS=1";
  for (size_t f = 0; f < std::size(kElementary); ++f) {
    SCOPED_TRACE(std::string(kElementary[f].name) + (kElementary[f].inverse ? " inverse" : ""));
    const double worst = WorstError(f, 1);
    EXPECT_LT(worst, 0.54);
    RecordProperty(std::string(kElementary[f].name) + (kElementary[f].inverse ? "_inverse" : ""),
                   std::to_string(worst));
  }
}

TEST(CurveTest, PowerIsWithinItsBoundAndFollowsTheRulesOfC) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> octave(-120, 120), target(-148, 127);
  for (const double e : {2.2, 1 / 2.2, 0.45, -1.7, 3.0, 1e-3, 17.25, -2.0}) {
    Samples x(8192);
    for (float& v : x) v = static_cast<float>(std::exp2(std::clamp(target(random) / e, -140.0, 127.0)));
    OnEveryTarget([&] {
      const Samples got = Values(PowerConstant(Row(x), {e}));
      for (size_t i = 0; i < x.size(); ++i)
        ASSERT_LT(Ulps(got[i], std::pow(double{x[i]}, e)), 0.75) << x[i] << "^" << e;
    });
  }
  const Samples special = {0, -0.0f, 1,     -1,   2,     -2,     0.5f,   -0.5f,
                           3, kInf,  -kInf, kNaN, 1e38f, -1e38f, 1e-45f, -1e-45f};
  for (const double e :
       {0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 0.5, -0.5, 1e30, -1e30, 16777216.0, 8388607.5}) {
    OnEveryTarget([&] {
      const Samples got = Values(PowerConstant(Row(special), {e}));
      for (size_t i = 0; i < special.size(); ++i) {
        const auto want = static_cast<float>(std::pow(double{special[i]}, e));
        EXPECT_TRUE((std::isnan(want) && std::isnan(got[i])) ||
                    (Ulps(got[i], want) <= 1 && std::signbit(got[i]) == std::signbit(want)))
            << special[i] << "^" << e << " is " << got[i] << ", expected " << want;
      }
    });
  }
}

// A few minutes: every float from 2^-8 to 2^8, so every mantissa, and one of 61 of all other positive ones.
TEST(CurveTest, PowersOfUseAreWithinTheirBoundForEveryMantissa) {
  if (!std::getenv("TESSERA_LONG_TESTS")) GTEST_SKIP() << "1.5e9 powers; set TESSERA_LONG_TESTS=1";
  for (const double e : {2.2, 2.4, 2.6, 1 / 2.2, 1 / 2.4, 1 / 2.6, 0.45, 0.5, 2.0, 3.0}) {
    double worst = 0;
    const auto compare = [&](const Samples& x) {
      const Samples got = Values(PowerConstant(Row(x), {e}));
      for (size_t i = 0; i < x.size(); ++i) worst = std::max(worst, Ulps(got[i], std::pow(double{x[i]}, e)));
    };
    ForFloats(1, compare, std::bit_cast<uint32_t>(0x1p-8f), std::bit_cast<uint32_t>(0x1p8f));
    ForFloats(61, compare, 0, std::bit_cast<uint32_t>(kInf));
    EXPECT_LT(worst, 0.75) << "exponent " << e;
    RecordProperty("exponent_" + std::to_string(e), std::to_string(worst));
  }
}

// The largest error of a curve over floats `step` apart: in ULP of the result, where the result is not a sum
// that cancelled nor next to the subnormals; and as a part of its bound.
struct CurveErrors {
  double ulps = 0, of_bound = 0;
  float at = 0;
};
CurveErrors ErrorsOf(const CurveFormula& formula, uint32_t step, float low, float high) {
  CurveErrors errors;
  const std::any params = CurveParams{{formula}};
  const auto compare = [&](const Samples& x) {
    const Node node = ApplyCurve(Row(x), {{formula}});
    const Samples got = Values(node);
    const Roi roi{0, 0, static_cast<int>(x.size()), 1};
    const ImageSpec spec(roi.width(), 1, 1);
    reference::ImageD in(roi, 1), want(roi, 1), scale(roi, 1);
    for (size_t i = 0; i < x.size(); ++i) in.samples[i] = x[i];
    reference::Find("curve")->evaluate({params, {&in, 1}, {&spec, 1}, spec, want, &scale});
    for (size_t i = 0; i < x.size(); ++i) {
      const double exact = want.samples[i];
      if (std::fabs(exact) > std::numeric_limits<float>::max()) continue;
      const double error = std::fabs(got[i] - exact);
      // Half a subnormal step is allowed to every result.
      errors.of_bound = std::max(errors.of_bound, error / (0x1p-23 * scale.samples[i] + 0x1p-149));
      if (scale.samples[i] > 1.0001 * std::fabs(exact) || std::fabs(exact) < 0x1p-120) continue;
      const double ulps = Ulps(got[i], exact);
      if (ulps > errors.ulps) errors.ulps = ulps, errors.at = x[i];
    }
  };
  ForFloats(step, compare, std::bit_cast<uint32_t>(low), std::bit_cast<uint32_t>(high));
  return errors;
}

TEST(CurveTest, EveryNamedCurveIsWithinItsBound) {
  const bool every = std::getenv("TESSERA_LONG_TESTS") != nullptr;
  for (const std::string& name : TransferFunctionNames()) {
    for (const bool inverse : {false, true}) {
      SCOPED_TRACE(name + (inverse ? " inverse" : ""));
      const CurveFormula formula = inverse ? Decoding(Named(name)) : Encoding(Named(name));
      const auto expect = [&] {
        // Every binade sparsely; what pictures hold densely.
        const CurveErrors wide = ErrorsOf(formula, every ? 61 : 40009, 0, kInf);
        const CurveErrors dense = ErrorsOf(formula, every ? 1 : 4001, 0x1p-10f, 4);
        // PQ's decoding reaches 1.13 next to its pole, at a signal of 1.992.
        EXPECT_LT(std::max(wide.ulps, dense.ulps), name == "pq" && inverse ? 1.2 : 0.95)
            << "at " << (wide.ulps > dense.ulps ? wide : dense).at;
        EXPECT_LE(std::max(wide.of_bound, dense.of_bound), 1);
        RecordProperty(name + (inverse ? "_inverse" : ""), std::to_string(std::max(wide.ulps, dense.ulps)));
        if (std::getenv("TESSERA_LONG_TESTS")) {
          std::printf("%-10s %-8s %.4f ULP\n", name.c_str(), inverse ? "inverse" : "",
                      std::max(wide.ulps, dense.ulps));
        }
      };
      if (every) {
        expect();
      } else {
        OnEveryTarget(expect);
      }
    }
  }
}

TEST(CurveTest, TargetsWithFusedMultiplyAddGiveTheSameBits) {
  for (const std::string& name : TransferFunctionNames()) {
    for (const bool inverse : {false, true}) {
      SCOPED_TRACE(name + (inverse ? " inverse" : ""));
      const CurveFormula formula = inverse ? Decoding(Named(name)) : Encoding(Named(name));
      const auto compare = [&](const Samples& x) {
        std::vector<Samples> results;
        for (const std::string& target : SimdTargets()) {
          if (target.find("AVX") == std::string::npos) continue;
          SetSimdTarget(target);
          results.push_back(Values(ApplyCurve(Row(x), {{formula}})));
        }
        SetSimdTarget("auto");
        for (const Samples& y : results) {
          for (size_t i = 0; i < y.size(); ++i) {
            ASSERT_EQ(std::bit_cast<uint32_t>(y[i]), std::bit_cast<uint32_t>(results[0][i])) << x[i];
          }
        }
      };
      ForFloats(65521, compare);
      ForFloats(997, compare, std::bit_cast<uint32_t>(0x1p-10f), std::bit_cast<uint32_t>(2.0f));
    }
  }
}

TEST(CurveTest, PublishedValues) {
  const struct {
    const char* name;
    float light;
    double signal, tolerance;
  } kValues[] = {{"srgb", 0.5f, 0.735356983, 1e-7},
                 {"srgb", 0.002f, 0.02584, 1e-8},
                 {"rec709", 0.18f, 0.4088481, 1e-6},
                 {"pq", 0.01f, 0.508078421, 1e-7},
                 {"pq", 1, 1, 1e-7},
                 {"pq", 0, 7.3095593e-7, 1e-12},
                 {"hlg", 1 / 12.0f, 0.5, 1e-7},
                 {"hlg", 1, 1, 1e-7},
                 {"acescct", 0.18f, 0.4135884, 1e-7},
                 {"acescct", 0, 0.0729055342, 1e-7},
                 {"logc3", 0.18f, 0.3910068, 1e-6},
                 {"logc4", 0.18f, 0.2783958, 1e-6},
                 {"slog3", 0.18f, 420 / 1023.0, 1e-7},
                 {"slog3", 0, 95 / 1023.0, 1e-6},
                 {"vlog", 0.18f, 0.4233115, 1e-6},
                 {"log3g10", 0.18f, 0.3333333, 1e-6},
                 {"cineon", 1, 685 / 1023.0, 1e-7},
                 {"cineon", 0, 95 / 1023.0, 1e-7}};
  for (const auto& v : kValues) {
    SCOPED_TRACE(std::string(v.name) + " of " + std::to_string(v.light));
    OnEveryTarget(
        [&] { EXPECT_NEAR(Values(Encode(Row({v.light}), Named(v.name)))[0], v.signal, v.tolerance); });
  }
}

TEST(CurveTest, MonotoneOverTheFloatsAndAcrossTheJoins) {
  Samples all;
  ForFloats(4093, [&](const Samples& part) { all.insert(all.end(), part.begin(), part.end()); });
  std::erase_if(all, [](float v) { return std::isnan(v); });
  std::sort(all.begin(), all.end());
  all.resize(all.size() / 4096 * 4096);
  for (const std::string& name : TransferFunctionNames()) {
    for (const bool inverse : {false, true}) {
      SCOPED_TRACE(name + (inverse ? " inverse" : ""));
      const CurveFormula formula = inverse ? Decoding(Named(name)) : Encoding(Named(name));
      // Every float around the join, both 2^14 of them.
      Samples near;
      double join = formula.join;
      if (name == "hlg") join = inverse ? 0.5 : 1.0 / 12;
      float v = std::isfinite(join) ? static_cast<float>(join) : 1.0f;
      for (int i = 0; i < 16384; ++i) v = std::nextafter(v, -1e30f);
      for (int i = 0; i < 32768; ++i) near.push_back(v), v = std::nextafter(v, 1e30f);
      OnEveryTarget([&] {
        for (const Samples& x : {all, near}) {
          const Samples y = Values(ApplyCurve(Row(x), {{formula}}));
          for (size_t i = 1; i < y.size(); ++i) {
            ASSERT_LE(y[i - 1], y[i]) << "between " << x[i - 1] << " and " << x[i];
          }
        }
      });
    }
  }
}

TEST(CurveTest, InverseUndoesTheCurve) {
  Samples x;
  for (int i = 0; i < 4096; ++i) x.push_back(static_cast<float>(std::exp2(i / 256.0 - 12)));
  for (const std::string& name : TransferFunctionNames()) {
    SCOPED_TRACE(name);
    OnEveryTarget([&] {
      const Samples back = Values(Decode(Encode(Row(x), Named(name)), Named(name)));
      for (size_t i = 0; i < x.size(); ++i) {
        if (name == "pq" && x[i] > 1) break;
        ASSERT_NEAR(back[i], x[i], 2e-5 * x[i] + 1e-7) << x[i];
      }
    });
  }
}

TEST(CurveTest, NegativesInfinitiesAndNaN) {
  OnEveryTarget([&] {
    const Samples x = {-0.25f, -0.0f, -kInf, kInf, kNaN, 0.25f};
    const Samples mirrored = Values(Encode(Row(x), TransferFunction::kSrgb));
    EXPECT_EQ(mirrored[0], -mirrored[5]);
    EXPECT_EQ(mirrored[1], 0);
    EXPECT_EQ(mirrored[2], -kInf);
    EXPECT_EQ(mirrored[3], kInf);
    EXPECT_TRUE(std::isnan(mirrored[4]));
    EXPECT_EQ(Values(Power(Row(x), 2, Negatives::kClamp))[0], 0.0f);
    EXPECT_EQ(Values(Power(Row(x), 2, Negatives::kKeep))[0], -0.25f);
    EXPECT_EQ(Values(Power(Row(x), 2, Negatives::kExtend))[2], 0.0f);
    const Samples log = Values(Encode(Row(x), TransferFunction::kLog2));
    EXPECT_EQ(log[0], -kInf);
    EXPECT_EQ(log[1], -kInf);
    EXPECT_EQ(log[3], kInf);
    EXPECT_EQ(log[5], -2.0f);
    EXPECT_EQ(Values(Decode(Row(x), TransferFunction::kLog2))[2], 0.0f);
    // Colours only; alpha keeps its bits, even NaN.
    const Samples pixel = Values(Encode(Row({0.5f, 0.5f, 0.5f, kNaN}, 4), TransferFunction::kSrgb));
    EXPECT_NEAR(pixel[0], 0.73536f, 1e-5);
    EXPECT_TRUE(std::isnan(pixel[3]));
  });
}

// Curves of 8-bit pixels are looked up, samples that an operation has changed are not: bits are those of
// floats.
TEST(CurveTest, BytesGiveTheBitsOfFloats) {
  const Image bytes(ImageSpec(67, 16, 3, PixelType::kUint8));
  for (int i = 0; i < 67 * 16 * 3; ++i)
    bytes.at<uint8_t>(i / 3 % 67, i / 201, i % 3) = static_cast<uint8_t>(i * 5);
  const Node codes = FromImage(bytes);
  OnEveryTarget([&] {
    for (const Node& from : {codes, MulConstant(codes, {-1}), MulConstant(codes, {1, 0.37, 2})}) {
      const Node floats = FromImage(Render(from));
      const auto expect_same = [&](const auto& curve) {
        const Samples got = Values(curve(from)), want = Values(curve(floats));
        EXPECT_EQ(std::memcmp(got.data(), want.data(), want.size() * sizeof(float)), 0);
      };
      for (const std::string& name : TransferFunctionNames()) {
        SCOPED_TRACE(name);
        expect_same([&](const Node& node) { return Encode(node, Named(name)); });
        expect_same([&](const Node& node) { return Decode(node, Named(name)); });
      }
      for (const double exponent : {2.2, -0.5, 3.0, 2.0}) {
        SCOPED_TRACE(exponent);
        if (exponent > 0) expect_same([&](const Node& node) { return Power(node, exponent); });
        expect_same([&](const Node& node) { return PowerConstant(node, {exponent, 1.0, 2.4}); });
      }
    }
  });
}

TEST(CurveTest, Refusals) {
  const Node image = Row({1});
  EXPECT_THROW(ApplyCurve(image, {}), Error);
  EXPECT_THROW(ApplyCurve(image, {{{}, {}}}), Error);
  EXPECT_THROW(Power(image, 0), Error);
  EXPECT_THROW(Power(image, kNaN), Error);
  EXPECT_THROW(PowerConstant(image, {}), Error);
  EXPECT_THROW(PowerConstant(image, {kInf}), Error);
}

}  // namespace
}  // namespace tessera
