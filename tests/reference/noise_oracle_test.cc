// The reference of Perlin's noise against the program that its author published (Improved Noise reference
// implementation, 2002).
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/oracle.h"

namespace tessera {
namespace {

using testing::Command;
using testing::ReferenceOf;
using testing::Row;

const int kPermutation[256] = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

double Fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double Lerp(double t, double a, double b) { return a + t * (b - a); }
double Grad(int hash, double x, double y, double z) {
  const int h = hash & 15;
  const double u = h < 8 ? x : y, v = h < 4 ? y : h == 12 || h == 14 ? x : z;
  return ((h & 1) == 0 ? u : -u) + ((h & 2) == 0 ? v : -v);
}
double Noise(double x, double y, double z) {
  const auto p = [](int i) { return kPermutation[i & 255]; };
  const int i = static_cast<int>(std::floor(x)) & 255, j = static_cast<int>(std::floor(y)) & 255,
            k = static_cast<int>(std::floor(z)) & 255;
  x -= std::floor(x), y -= std::floor(y), z -= std::floor(z);
  const double u = Fade(x), v = Fade(y), w = Fade(z);
  const int a = p(i) + j, aa = p(a) + k, ab = p(a + 1) + k, b = p(i + 1) + j, ba = p(b) + k,
            bb = p(b + 1) + k;
  return Lerp(w,
              Lerp(v, Lerp(u, Grad(p(aa), x, y, z), Grad(p(ba), x - 1, y, z)),
                   Lerp(u, Grad(p(ab), x, y - 1, z), Grad(p(bb), x - 1, y - 1, z))),
              Lerp(v, Lerp(u, Grad(p(aa + 1), x, y, z - 1), Grad(p(ba + 1), x - 1, y, z - 1)),
                   Lerp(u, Grad(p(ab + 1), x, y - 1, z - 1), Grad(p(bb + 1), x - 1, y - 1, z - 1))));
}

TEST(NoiseOracle, PublishedProgram) {
  EXPECT_NEAR(Noise(3.14, 42, 7), 0.13691995878400012, 1e-15);  // its well-known value: no misprint above
  std::vector<std::vector<float>> places;
  for (int i = 0; i < 200; ++i) {
    const auto t = static_cast<float>(i);
    places.push_back({0.37f * t - 21, 3.14f + 0.11f * t, 7.5f - 0.73f * t});
  }
  places.push_back({3, 42, 7});  // lattice points are 0
  places.push_back({255.5f, 256.25f, -0.75f});
  const Node node = Command("noiseat", "lattice=perlin signed=1", {Row(places)});
  const reference::ImageD found = ReferenceOf(node);
  const Image picture = Render(node);
  for (size_t i = 0; i < places.size(); ++i) {
    const double expected = Noise(places[i][0], places[i][1], places[i][2]);
    EXPECT_NEAR(found.at(static_cast<int>(i), 0, 0), expected, 1e-14) << i;
    EXPECT_NEAR(picture.at<float>(static_cast<int>(i), 0, 0), expected, 2e-7) << i;
  }
}

}  // namespace
}  // namespace tessera
