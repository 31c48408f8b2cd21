// Hypertexture and volumes: a seated figure lit, carved from stone, bumped, furry, melting and burning (four moments of
// the last three), and a cloud of Gardner's sines. `volumes [picture.png [pixels a side]]`
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "tessera/tessera.h"

namespace {

using namespace tessera;

// Copies a picture over dark grey into a cell of the sheet, encoded for a screen.
void Show(const Image& picture, const Image& sheet, int column, int row) {
  const int side = picture.spec().width();
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float under = 0.012f + 0.02f * static_cast<float>(y) / static_cast<float>(side);
        const float v = picture.at<float>(x, y, c) + (1 - picture.at<float>(x, y, 3)) * under;
        sheet.at<float>(column * side + x, row * side + y, c) = std::pow(std::clamp(v, 0.0f, 1.0f), 1 / 2.2f);
      }
    }
  }
}

Volume Cloud() {
  // Gardner's product of sines in 64 slices, fading towards the rim of an ellipsoid.
  constexpr int kSide = 96, kSlices = 64;
  TextureParams gardner;
  gardner.kind = TextureKind::kGardner;
  gardner.frequency = 2.2;
  gardner.slices = kSlices;
  gardner.scale = 0.05;
  gardner.seed = 11;
  return Volume::FromImage(Render(Texture(ImageSpec(kSide, 60 * kSlices, 1), gardner)).view(), kSlices);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string file = argc > 1 ? argv[1] : "volumes.png";
    const int side = argc > 2 ? std::atoi(argv[2]) : 160;
    const Image sheet(ImageSpec(4 * side, 4 * side, 3));
    const Volume body = DistanceField(Solid::Parse("body"), VolumeSpec::Centred({128, 128, 128}, PixelType::kUint16));
    VolumeParams p;
    p.camera = OrbitCamera(body, 25, 15, 30, 1, 1.75);
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
        Show(Render(RenderVolumeSupersampled(size, body, p, 2)), sheet, k, row + 1);
      }
    }
    const Volume cloud = Cloud();
    const double top = cloud.Range()[1];
    VolumeParams c;
    c.mode = VolumeMode::kUnder;
    c.camera = OrbitCamera(cloud, 30, 12, 30, 1, 1.25);
    c.shade = true;
    c.material = {{1, 1, 1}, 0.55, 0.65, 0, 1, {-0.3, 0.9, 0.4}};
    c.transfer = {{{0.02 * top, {0.75, 0.8, 0.9}, 0}, {0.25 * top, {0.95, 0.95, 0.97}, 0.12}, {top, {1, 1, 1}, 0.5}}, 0.03};
    Show(Render(RenderVolume(size, cloud, c)), sheet, 3, 0);
    Write(FromImage(sheet), file, {.type = PixelType::kUint8});
    // Every cell shows something and none is full.
    for (int cell = 0; cell < 16; ++cell) {
      int bright = 0;
      for (int i = 0; i < side * side; ++i) {
        bright += sheet.at<float>(cell % 4 * side + i % side, cell / 4 * side + i / side, 0) > 0.3f;
      }
      if (bright < side * side / 20 || bright > side * side * 19 / 20) {
        std::fprintf(stderr, "volumes: cell %d has %d bright pixels\n", cell, bright);
        return 1;
      }
    }
    std::printf("%s: %dx%d\n", file.c_str(), 4 * side, 4 * side);
  } catch (const Error& e) {
    std::fprintf(stderr, "volumes: %s\n", e.what());
    return 1;
  }
}
