// Line integral convolution as the paper does it, pass by pass with the library's own blocks: a coordinate
// image that starts as a ramp, look-ups of the noise at it that are accumulated, and look-ups of the field
// that move it. Writes multipass_lic.png and fails unless the operation Lic gives the same picture.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tessera/tessera.h"

namespace {

using tessera::Image;
using tessera::ImageSpec;
using tessera::Node;
using tessera::Table;

constexpr int kWidth = 512, kHeight = 384, kSteps = 20;

// A vortex pair; the longest vector has length 1, so that a step moves by a pixel at most.
Image VortexPair() {
  const Image field(ImageSpec(kWidth, kHeight, 2));
  const auto turn = [](double x, double y, double strength) {
    const double spin = strength / (0.02 + x * x + y * y);
    return std::pair(-spin * y, spin * x);
  };
  double longest = 0;
  for (const bool scale : {false, true}) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double px = (x - 255.5) / 256, py = (y - 191.5) / 256;
        const auto [u0, v0] = turn(px + 0.35, py, 1);
        const auto [u1, v1] = turn(px - 0.35, py, -1);
        const double u = u0 + u1, v = v0 + v1;
        longest = std::max(longest, std::hypot(u, v));
        if (!scale) continue;
        field.at<float>(x, y, 0) = static_cast<float>(u / longest);
        field.at<float>(x, y, 1) = static_cast<float>(v / longest);
      }
    }
  }
  return field;
}

// The paper's passes in one direction: every step moves the coordinates, then takes the noise there.
void Advance(const Table& field, const Table& noise, double sign, std::vector<Node>& taps) {
  Node coordinates = SelectChannels(tessera::Ramp(ImageSpec(kWidth, kHeight, 2)), "0,1");
  // The field is in pixels, coordinates go from 0 to 1 across the picture.
  const std::vector<double> step = {sign / kWidth, sign / kHeight};
  for (int i = 0; i < kSteps; ++i) {
    coordinates = Add(coordinates, MulConstant(Lookup(coordinates, field), step));
    taps.push_back(Lookup(coordinates, noise));
  }
}

double Milliseconds(const Node& node, Image& result) {
  const auto start = std::chrono::steady_clock::now();
  result = Render(node);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

int main() {
  try {
    const Image field = VortexPair();
    tessera::NoiseParams white;
    white.kind = tessera::NoiseKind::kWhite, white.frequency = 0;
    const Image noise = Render(tessera::Noise(ImageSpec(kWidth, kHeight, 1), white));

    std::vector<Node> taps = {FromImage(noise)};
    const Table directions = TableFromImage(field.view()), texture = TableFromImage(noise.view());
    for (const double sign : {1.0, -1.0}) Advance(directions, texture, sign, taps);
    Image passes, direct;
    const double slow = Milliseconds(Average(taps), passes);

    const tessera::LicParams same{.length = kSteps,
                                  .integrator = tessera::LicIntegrator::kEuler,
                                  .method = tessera::LicMethod::kDirect,
                                  .wrap = tessera::Wrap::kClamp,
                                  .linear = true,
                                  .speed = true};
    const double fast = Milliseconds(Lic(FromImage(noise), FromImage(field), same), direct);

    // Coordinates from 0 to 1 in float are good to 2^-24 of the picture's width: 3e-5 pixels a step.
    double most = 0, squares = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double off = passes.at<float>(x, y, 0) - direct.at<float>(x, y, 0);
        most = std::max(most, std::fabs(off)), squares += off * off;
      }
    }
    const double rms = std::sqrt(squares / (kWidth * kHeight));
    // The noise is around 0, and the mean takes most of its contrast away.
    const Node shown = AddConstant(MulConstant(FromImage(passes), {2}), {0.5});
    Write(shown, "multipass_lic.png", {.type = tessera::PixelType::kUint8});
    std::printf("%d passes: %.1f ms, Lic: %.1f ms; they differ by %.1e at most, rms %.1e\n", 2 * kSteps, slow,
                fast, most, rms);
    return most < 2e-3 && rms < 1e-4 ? 0 : 1;
  } catch (const tessera::Error& error) {
    std::printf("%s\n", error.what());
  }
  return 1;
}
