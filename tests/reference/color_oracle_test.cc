// References of colour operations against closed forms and published numbers.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/oracle.h"

namespace tessera {
namespace {

using testing::Command;
using testing::ReferenceOf;
using testing::Row;
using Matrix = std::array<std::array<double, 3>, 3>;

// The matrix of a linear operation: what it makes of red, green and blue.
Matrix MatrixOf(const std::string& name, const std::string& words) {
  const reference::ImageD r = ReferenceOf(Command(name, words, {Row({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}})}));
  Matrix m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[static_cast<size_t>(i)][static_cast<size_t>(j)] = r.at(j, 0, i);
  }
  return m;
}
void ExpectNear(const Matrix& found, const Matrix& expected, double within) {
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) EXPECT_NEAR(found[i][j], expected[i][j], within) << i << "," << j;
  }
}
Matrix Product(const Matrix& a, const Matrix& b) {
  Matrix m{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) m[i][j] += a[i][k] * b[k][j];
    }
  }
  return m;
}

// W3C Filter Effects Module Level 1, feColorMatrix type="saturate", with its weights 0.213, 0.715, 0.072.
TEST(ColorOracle, SaturationIsThatOfFilterEffects) {
  for (const double s : {0.0, 0.4, 1.3}) {
    const Matrix expected = {{{0.213 + 0.787 * s, 0.715 - 0.715 * s, 0.072 - 0.072 * s},
                              {0.213 - 0.213 * s, 0.715 + 0.285 * s, 0.072 - 0.072 * s},
                              {0.213 - 0.213 * s, 0.715 - 0.715 * s, 0.072 + 0.928 * s}}};
    ExpectNear(MatrixOf("saturate", std::to_string(s) + " weights=0.213,0.715,0.072"), expected, 1e-12);
  }
}

// Rodrigues' rotation about (1,1,1)/sqrt(3): a third of a turn is the cycle of the channels, a half 2/3 - I.
TEST(ColorOracle, PlainHueIsARotationAboutGrey) {
  ExpectNear(MatrixOf("hue", "120 preserve=none"), {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}}, 1e-12);
  constexpr double kTwo = 2.0 / 3, kOne = -1.0 / 3;
  ExpectNear(MatrixOf("hue", "180 preserve=none"),
             {{{kOne, kTwo, kTwo}, {kTwo, kOne, kTwo}, {kTwo, kTwo, kOne}}}, 1e-12);
  const Matrix half = MatrixOf("hue", "90 preserve=none");  // 1/3 and 1/3 -+ 1/sqrt(3)
  EXPECT_NEAR(half[0][0], 1.0 / 3, 1e-12);
  EXPECT_NEAR(half[0][1], 1.0 / 3 - 1 / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(half[1][0], 1.0 / 3 + 1 / std::sqrt(3.0), 1e-12);
}

// With the luminance kept it is a rotation of another basis: greys and luminance stay, angles add up, and the
// trace is 1 + 2 cos. Rec. 709 weights.
TEST(ColorOracle, HueKeepsLuminanceAndGroups) {
  const Matrix a = MatrixOf("hue", "40"), b = MatrixOf("hue", "65"), both = MatrixOf("hue", "105");
  ExpectNear(Product(a, b), both, 1e-12);
  const double weights[3] = {0.2126, 0.7152, 0.0722};
  for (size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(a[j][0] + a[j][1] + a[j][2], 1, 1e-12);
    double luminance = 0;
    for (size_t i = 0; i < 3; ++i) luminance += weights[i] * a[i][j];
    EXPECT_NEAR(luminance, weights[j], 1e-12);
  }
  EXPECT_NEAR(a[0][0] + a[1][1] + a[2][2], 1 + 2 * std::cos(40 * std::numbers::pi / 180), 1e-12);
}

// By mpmath, 30 digits, from IEC 61966-2-1, BT.709 with the digits of its constants that BT.2020 gives, ST
// 2084, BT.2100 (HLG), S-2016-001 (ACEScct) and ARRI's LogC3 for EI 800.
TEST(ColorOracle, CurvesHaveTheirStandardsValues) {
  struct Value {
    const char* curve;
    double light, signal;
  };
  const Value values[] = {
      {"srgb", 0.5, 0.73535698305244949},   {"srgb", 0.18, 0.46135612950044165},
      {"srgb", 0.01, 0.099852822734128337}, {"srgb", 2, 1.3532560461493863},
      {"rec709", 0.5, 0.70543555305561831}, {"rec709", 0.18, 0.4088481088912251},
      {"rec709", 0.1, 0.29074840608453222}, {"pq", 0.01, 0.50807842151739486},
      {"pq", 0.1, 0.75182709624704177},     {"pq", 1, 1},
      {"pq", 0.0001, 0.14994573210017977},  {"hlg", 0.05, 0.38729833462074169},
      {"hlg", 0.5, 0.87164347087417718},    {"acescct", 0.18, 0.41358840249244222},
      {"acescct", 1, 0.55479452054794521},  {"acescct", 0.001, 0.08344577193749},
      {"logc3", 0.18, 0.39100683203408372},
  };
  for (const Value& v : values) {
    const auto light = static_cast<float>(v.light);
    const double found = ReferenceOf(Command("curve", v.curve, {Row({{light, light, light}})})).at(0, 0, 0);
    // The sample is a float: its rounding passes through slopes of up to a few tens.
    EXPECT_NEAR(found, v.signal, 4e-7) << v.curve << " of " << v.light;
    const auto signal = static_cast<float>(v.signal);
    const double back =
        ReferenceOf(Command("curve", std::string(v.curve) + " inverse=1", {Row({{signal, signal, signal}})}))
            .at(0, 0, 0);
    EXPECT_NEAR(back, v.light, 2e-6 * v.light + 1e-9) << v.curve << " to " << v.light;
  }
}

// Porter and Duff 1984, table of the fractions F_A and F_B.
TEST(ColorOracle, PorterAndDuffsTable) {
  const std::vector<float> a = {0.3f, 0.15f, 0.05f, 0.5f}, b = {0.4f, 0.2f, 0.6f, 0.8f};
  const double as = a[3], bs = b[3];
  struct Operator {
    const char* name;
    double fa, fb;
  };
  const Operator operators[] = {{"clear", 0, 0},
                                {"src", 1, 0},
                                {"dst", 0, 1},
                                {"over", 1, 1 - as},
                                {"dst-over", 1 - bs, 1},
                                {"in", bs, 0},
                                {"dst-in", 0, as},
                                {"out", 1 - bs, 0},
                                {"dst-out", 0, 1 - as},
                                {"atop", bs, 1 - as},
                                {"dst-atop", 1 - bs, as},
                                {"xor", 1 - bs, 1 - as},
                                {"plus", 1, 1}};
  for (const Operator& o : operators) {
    const reference::ImageD found = ReferenceOf(Command("blend", o.name, {Row({a}), Row({b})}));
    for (int c = 0; c < 4; ++c) {
      const auto k = static_cast<size_t>(c);
      EXPECT_NEAR(found.at(0, 0, c), o.fa * a[k] + o.fb * b[k], 1e-14) << o.name << ", channel " << c;
    }
  }
}

}  // namespace
}  // namespace tessera
