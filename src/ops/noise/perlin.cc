// Perlin's "improving noise" of 2002: the published permutation and gradients, in double and in the published
// order of operations, so that published values come out bit for bit; rounded to float once.
#include <array>
#include <cmath>

#include "ops/noise/kernels.h"

namespace tessera::ops {
namespace {

// K. Perlin, "Improving noise", 2002: 0..255 in random order.
constexpr std::array<uint8_t, 256> kPermutation = {
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

constexpr int At(int i) { return kPermutation[static_cast<size_t>(i & 255)]; }

// The 12 edges and 4 of them again, by the low four bits of a hash.
constexpr double kEdge[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                 {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                 {1, 1, 0},  {0, -1, 1},  {-1, 1, 0}, {0, -1, -1}};

double Fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double FadeSlope(double t) { return 30 * t * t * (t - 1) * (t - 1); }
double Lerp(double t, double a, double b) { return a + t * (b - a); }

}  // namespace

void PerlinNoise(const double* px, const double* py, const double* pz, int count, float* value,
                 float* const* slope) {
  for (int i = 0; i < count; ++i) {
    const double p[3] = {px[i], py[i], pz[i]};
    int cell[3];
    double f[3], u[3];
    for (int a = 0; a < 3; ++a) {
      const double whole = std::floor(p[a]);
      cell[a] = static_cast<int>(whole) & 255;
      f[a] = p[a] - whole;
      u[a] = Fade(f[a]);
    }
    double n[8];
    const double* g[8];
    for (int c = 0; c < 8; ++c) {
      const int hash = At(At(At(cell[0] + (c & 1)) + cell[1] + (c >> 1 & 1)) + cell[2] + (c >> 2));
      g[c] = kEdge[hash & 15];
      // Two of the three products are the published u and v; the zero changes nothing.
      n[c] = g[c][0] * (f[0] - (c & 1)) + g[c][1] * (f[1] - (c >> 1 & 1)) + g[c][2] * (f[2] - (c >> 2));
    }
    double x[4], y[2];
    for (int c = 0; c < 4; ++c) x[c] = Lerp(u[0], n[2 * c], n[2 * c + 1]);
    for (int c = 0; c < 2; ++c) y[c] = Lerp(u[1], x[2 * c], x[2 * c + 1]);
    value[i] = static_cast<float>(Lerp(u[2], y[0], y[1]) + 0.0);
    if (slope == nullptr) continue;
    for (int a = 0; a < 3; ++a) {
      double blended[8];
      for (int c = 0; c < 8; ++c) blended[c] = g[c][a];
      for (int k = 0; k < 3; ++k) {
        for (int c = 0; c < 4 >> k; ++c) blended[c] = Lerp(u[k], blended[2 * c], blended[2 * c + 1]);
      }
      const double across =
          a == 0   ? Lerp(u[2], Lerp(u[1], n[1] - n[0], n[3] - n[2]), Lerp(u[1], n[5] - n[4], n[7] - n[6]))
          : a == 1 ? Lerp(u[2], x[1] - x[0], x[3] - x[2])
                   : y[1] - y[0];
      slope[a][i] = static_cast<float>(blended[0] + FadeSlope(f[a]) * across);
    }
  }
}

void PerlinBatch(const NoiseBatch& batch, int dims) {
  double position[3][kNoiseBatch] = {};
  for (int a = 0; a < dims; ++a) {
    for (int i = 0; i < batch.count; ++i)
      position[a][i] = (batch.cell[a][i] & 255) + static_cast<double>(batch.fraction[a][i]);
  }
  PerlinNoise(position[0], position[1], position[2], batch.count, batch.value,
              batch.slope[0] != nullptr ? batch.slope : nullptr);
}

}  // namespace tessera::ops
