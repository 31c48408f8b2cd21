// Hypertexture and volumes: a seated figure lit, carved from stone, bumped, furry, melting and burning (four
// moments of the last three), and a cloud of Gardner's ellipsoids. `volumes [picture.png [pixels a side]]`
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "tessera/tessera.h"

namespace {

using namespace tessera;

// What is behind: the colour at the top of a cell, and how it changes to the bottom.
struct Backdrop {
  float top[3], change[3];
};
constexpr Backdrop kGrey = {{0.012f, 0.012f, 0.012f}, {0.02f, 0.02f, 0.02f}};
constexpr Backdrop kSky = {{0.10f, 0.22f, 0.50f}, {0.22f, 0.30f, 0.28f}};

// Copies a picture over its backdrop into a cell of the sheet, encoded for a screen. Refuses one that shows
// nothing, or nothing else.
void Show(const Image& picture, const Image& sheet, int column, int row, const Backdrop& behind = kGrey) {
  const int side = picture.spec().width();
  int covered = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      covered += picture.at<float>(x, y, 3) > 0.5f;
      for (int c = 0; c < 3; ++c) {
        const float under =
            behind.top[c] + behind.change[c] * static_cast<float>(y) / static_cast<float>(side);
        const float v = picture.at<float>(x, y, c) + (1 - picture.at<float>(x, y, 3)) * under;
        sheet.at<float>(column * side + x, row * side + y, c) = std::pow(std::clamp(v, 0.0f, 1.0f), 1 / 2.2f);
      }
    }
  }
  if (covered < side * side / 20 || covered > side * side * 19 / 20) {
    throw Error("volumes", "found " + std::to_string(covered) + " covered pixels in cell " +
                               std::to_string(column) + "," + std::to_string(row));
  }
}

// Gardner's cloud: ellipsoids on a common base, opacity falling towards the rim, which noise eats away.
Volume Cloud() {
  struct Puff {
    Vector3 centre, radii;
  };
  static constexpr Puff kPuffs[] = {
      {{-0.52, -0.12, 0.05}, {0.36, 0.27, 0.34}}, {{-0.15, 0.06, -0.08}, {0.42, 0.44, 0.40}},
      {{0.30, -0.03, 0.04}, {0.38, 0.34, 0.36}},  {{0.66, -0.16, -0.02}, {0.28, 0.20, 0.28}},
      {{0.04, -0.16, 0.26}, {0.50, 0.22, 0.26}},  {{-0.80, -0.22, 0.00}, {0.18, 0.12, 0.20}}};
  constexpr double kBlend = 0.25, kBase = -0.36;
  const NoiseBlock noise(NoiseContent::kFbm, 6, 5, 3);
  return Volume(VolumeSpec::Centred({144, 92, 88}, PixelType::kUint16), [&](const Vector3& p) {
    double inside = -1;
    for (const Puff& puff : kPuffs) {
      double square = 0;
      for (size_t a = 0; a < 3; ++a) {
        square += std::pow((p[a] - puff.centre[a]) / puff.radii[a], 2);
      }
      const double one = 1 - std::sqrt(square), near = std::max(kBlend - std::fabs(inside - one), 0.0);
      inside = std::max(inside, one) + near * near;
    }
    double n;
    noise.Sample({0.5 * p[0], 0.5 * p[1], 0.5 * p[2]}, &n);
    return std::clamp((p[1] - kBase) / 0.1, 0.0, 1.0) * std::clamp(1.6 * (inside + 0.55 * n), 0.0, 1.0);
  });
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string file = argc > 1 ? argv[1] : "volumes.png";
    const int side = argc > 2 ? std::atoi(argv[2]) : 160;
    const Image sheet(ImageSpec(4 * side, 4 * side, 3));
    const Volume body =
        DistanceField(Solid::Parse("body"), VolumeSpec::Centred({128, 128, 128}, PixelType::kUint16));
    VolumeParams p;
    p.camera = OrbitCamera(body, 25, 15, 30, 1, 1.6);
    const ImageSpec size(side, side, 4);
    const VolumeMode surfaces[] = {VolumeMode::kIso, VolumeMode::kSolid, VolumeMode::kBump};
    for (int k = 0; k < 3; ++k) {
      p.mode = surfaces[k];
      Show(Render(RenderVolumeSupersampled(size, body, p, 4)), sheet, k, 0);
    }
    const VolumeMode moving[] = {VolumeMode::kFur, VolumeMode::kMelt, VolumeMode::kFire};
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 4; ++k) {
        p.mode = moving[row];
        p.time = (row == 1 ? 1.4 : 0.7) * (k + 0.5);
        Show(Render(RenderVolumeSupersampled(size, body, p, 4)), sheet, k, row + 1);
      }
    }
    const Volume cloud = Cloud();
    VolumeParams c;
    c.mode = VolumeMode::kUnder;
    c.camera = OrbitCamera(cloud, 25, 8, 30, 1, 1.3);
    c.shade = true;
    c.step = cloud.spec().spacing[0] / 2;
    c.material = {{1, 1, 1}, 0.62, 0.42, 0, 1, {-0.45, 0.85, 0.35}};
    c.transfer = {{{0, {0.62, 0.68, 0.78}, 0},
                   {0.15, {0.86, 0.89, 0.94}, 0.03},
                   {0.5, {1, 1, 1}, 0.22},
                   {1, {1, 0.99, 0.97}, 0.5}},
                  0.02};
    Show(Render(RenderVolume(size, cloud, c)), sheet, 3, 0, kSky);
    Write(FromImage(sheet), file, {.type = PixelType::kUint8});
    std::printf("%s: %dx%d\n", file.c_str(), 4 * side, 4 * side);
  } catch (const Error& e) {
    std::fprintf(stderr, "volumes: %s\n", e.what());
    return 1;
  }
}
