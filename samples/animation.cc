// Eight octaves of fire and clouds in motion: renders moments of both, prints the time of a frame, and lays
// them out as a contact sheet (samples/pictures/animation.jpg: 3840 pixels wide).
//   animation [OUT.png [WIDTH]]     fails where neighbouring frames flicker, or stand still
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tessera/tessera.h"

namespace {

using namespace tessera;

constexpr int kColumns = 4, kCell = 400;  // moments in a row, and pixels across one of them
constexpr double kFrame = 1.0 / 24;

struct Scene {
  const char* name;
  TextureKind kind;
  double frequency, interval;  // seconds between moments
};
constexpr Scene kScenes[] = {{"fire", TextureKind::kFire, 3, 0.25}, {"clouds", TextureKind::kClouds, 3, 5}};

Node Frame(const Scene& scene, int width, double time) {
  TextureParams p;
  p.kind = scene.kind;
  p.frequency = scene.frequency;
  p.octaves = 8;
  p.time = time;
  return Texture(ImageSpec(width, width * 9 / 16, 3), p);
}

// The mean difference of two frames, over all channels.
double Difference(const Image& a, const Image& b) {
  const auto *p = reinterpret_cast<const float*>(a.view().data),
             *q = reinterpret_cast<const float*>(b.view().data);
  const auto count = static_cast<size_t>(a.spec().data_window.pixels() * a.spec().channel_count());
  double sum = 0;
  for (size_t i = 0; i < count; ++i) sum += std::fabs(p[i] - q[i]);
  return sum / static_cast<double>(count);
}

// A frame, small, encoded for a screen, into a cell of the sheet.
void Show(const Image& frame, const Image& sheet, int column, int row) {
  const int height = kCell * 9 / 16;
  const Image small = Render(Resize(FromImage(frame), {.width = kCell, .height = height, .filter = {}}));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < kCell; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float v = std::clamp(small.at<float>(x, y, c), 0.0f, 1.0f);
        sheet.at<float>(column * kCell + x, row * height + y, c) = std::pow(v, 1 / 2.2f);
      }
    }
  }
}

void Play(const Scene& scene, int width, const Image& sheet, int row) {
  double fastest = 1e9;
  for (int column = 0; column < kColumns; ++column) {
    const double time = column * scene.interval;
    const auto start = std::chrono::steady_clock::now();
    const Image frame = Render(Frame(scene, width, time));
    const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
    fastest = std::min(fastest, taken.count());
    Show(frame, sheet, column, row);
    const double next = Difference(frame, Render(Frame(scene, width, time + kFrame)));
    const double later = Difference(frame, Render(Frame(scene, width, time + 24 * kFrame)));
    std::printf("%-7s %5.2f s: a frame later %.4f other, a second later %.4f\n", scene.name, time, next,
                later);
    if (!(next > 0 && next < 0.5 * later))
      throw Error(scene.name, "found frames that flicker or stand still");
  }
  std::printf("%-7s %dx%d, 8 octaves: %.0f ms a frame\n", scene.name, width, width * 9 / 16, fastest);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string file = argc > 1 ? argv[1] : "animation.png";
    const int width = argc > 2 ? std::atoi(argv[2]) : 640;
    if (width < 16 || width > 16384)
      throw Error("width", "found " + std::to_string(width) + ", expected 16 to 16384");
    const Image sheet(ImageSpec(kColumns * kCell, 2 * (kCell * 9 / 16), 3));
    for (int row = 0; row < 2; ++row) Play(kScenes[row], width, sheet, row);
    Write(FromImage(sheet), file, {.type = PixelType::kUint8});
    std::printf("%s: %dx%d\n", file.c_str(), sheet.spec().width(), sheet.spec().height());
  } catch (const Error& e) {
    std::fprintf(stderr, "animation: %s\n", e.what());
    return 1;
  }
}
