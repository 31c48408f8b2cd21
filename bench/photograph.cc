// The photograph, read once.
#include "photograph.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "tessera/image.h"
#include "tessera/io.h"
#include "tessera/render.h"

namespace tessera::bench {
namespace {

constexpr char kGarden[] = "/usr/share/backgrounds/mate/nature/Garden.jpg";

const Image& Pixels() {
  static const Image pixels = [] {
    const std::string file = PhotographFile();
    return file.empty() ? Image() : Render(Read(file), PixelType::kUint8);
  }();
  return pixels;
}

int Mirrored(int i, int count) {
  const int period = 2 * count, at = (i % period + period) % period;
  return at < count ? at : period - 1 - at;
}

float Shading(int x, int y, int channel, float noise) {
  const double u = x / 700.0, v = y / 500.0;
  const double patch = std::fmod(std::floor(u * 3) * 0.37 + std::floor(v * 3) * 0.61, 1.0);
  const double shade = 0.1 + 0.6 * patch + 0.25 * std::sin(u * (channel + 1) + v) + 0.03 * (noise - 0.5);
  return static_cast<float>(std::clamp(shade, 0.0, 1.0));
}

}  // namespace

std::string PhotographFile() {
  const char* const given = std::getenv("TESSERA_PHOTOGRAPH");
  if (given != nullptr) return given;
  return std::filesystem::exists(kGarden) ? kGarden : "";
}

float Photograph(int x, int y, int channel, float noise) {
  const Image& image = Pixels();
  if (image.view().data == nullptr) return Shading(x, y, channel, noise);
  const ImageSpec& spec = image.spec();
  const float code = image.at<uint8_t>(Mirrored(x, spec.width()), Mirrored(y, spec.height()),
                                       std::min(channel, spec.channel_count() - 1));
  return std::clamp((code + noise - 0.5f) / 255, 0.0f, 1.0f);
}

}  // namespace tessera::bench
