// Line integral convolution of made and measured fields: a vortex street, a dipole, a saddle, an animated
// loop, and January's mean wind over the oceans.   flow WIND.exr Writes flow_*.png. The wind is the COADS
// climatology (public domain, NOAA), as Debian's ferret-datasets has it.
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>

#include "tessera/tessera.h"

namespace {

using tessera::Image;
using tessera::ImageSpec;
using tessera::LicParams;
using tessera::Node;

using Flow = std::function<std::pair<double, double>(double x, double y)>;

// x and y from -1 to 1 along the longer side, y down.
Image FieldOf(int width, int height, const Flow& flow) {
  const Image image(ImageSpec(width, height, 2));
  const double half = 0.5 * std::max(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto [u, v] = flow((x + 0.5 - width / 2.0) / half, (y + 0.5 - height / 2.0) / half);
      image.at<float>(x, y, 0) = static_cast<float>(u), image.at<float>(x, y, 1) = static_cast<float>(v);
    }
  }
  return image;
}

// Two rows of vortices of opposite turn behind a cylinder, drifting with the stream; the cylinder itself is
// masked.
std::pair<double, double> VortexStreet(double x, double y) {
  const double cx = -0.75, radius = 0.06;
  if (std::hypot(x - cx, y) < radius) return {std::nan(""), std::nan("")};
  double u = 1, v = 0;
  const double dx = x - cx, squared = dx * dx + y * y, push = radius * radius / (squared * squared);
  u -= push * (dx * dx - y * y), v -= push * 2 * dx * y;
  for (int i = 0; i < 8; ++i) {
    const double turn = i % 2 == 0 ? 1 : -1;
    const double vx = x - (cx + 0.2 + 0.21 * i), vy = y - turn * -0.09;
    const double strength = -0.16 * turn * (1 - std::exp(-i - 0.7)), core = 0.05;
    const double r2 = vx * vx + vy * vy, spin = strength * (1 - std::exp(-r2 / (core * core))) / (r2 + 1e-9);
    u -= spin * vy, v += spin * vx;
  }
  return {u, v};
}
// A source and a sink.
std::pair<double, double> Dipole(double x, double y) {
  const auto pole = [&](double at) {
    const double dx = x - at, squared = dx * dx + y * y + 1e-4;
    return std::pair(dx / squared, y / squared);
  };
  const auto [a, b] = pole(-0.4);
  const auto [c, d] = pole(0.4);
  return {a - c, b - d};
}
std::pair<double, double> Saddle(double x, double y) { return {x, -y}; }

void Save(const Node& node, const std::string& name) {
  tessera::Write(node, "flow_" + name + ".png", {.type = tessera::PixelType::kUint8});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: flow WIND.exr\n");
    return 2;
  }
  try {
    LicParams look{
        .length = 25, .kernel = tessera::LicKernel::kHann, .contrast = tessera::LicContrast::kRescale};
    const Node street = tessera::FromImage(FieldOf(960, 480, VortexStreet));
    LicParams colored = look;
    colored.magnitude = tessera::LicMagnitude::kColor;
    Save(Lic(street, colored), "street");
    Save(Lic(tessera::FromImage(FieldOf(512, 512, Dipole)), look), "dipole");
    Save(Lic(tessera::FromImage(FieldOf(512, 512, Saddle)), look), "saddle");

    // Eight frames that loop: a wave moves along the lines.
    for (int frame = 1; frame <= 8; ++frame) {
      Save(Lic(street, LicFrame(look, frame, 8)), "street_loop." + std::to_string(frame));
    }

    // East and north components every two degrees, NaN over land, on a map of quarter degrees.
    LicParams map = colored;
    map.units = tessera::LicUnits::kLatLong, map.bicubic = true, map.width = 1440, map.height = 720;
    Save(Lic(tessera::Read(argv[1]), map), "wind");
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "flow: %s\n", error.what());
    return 1;
  }
  return 0;
}
