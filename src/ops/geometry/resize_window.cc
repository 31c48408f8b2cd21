// Windows of another resolution, and the words they are asked for in.
#include "ops/geometry/resize_window.h"

#include <algorithm>
#include <charconv>
#include <climits>
#include <cmath>

#include "tessera/error.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

constexpr int kLongestSide = 1 << 24;

[[noreturn]] void RefuseWindow(const char* what) {
  throw Error(what,
              "found a size or an origin that leads beyond 2^31, expected a window between -2^31 and 2^31");
}

}  // namespace

Roi ResizedDisplay(const char* what, const DisplaySize& size) {
  if (size.width < 1 || size.height < 1 || size.width > kLongestSide || size.height > kLongestSide) {
    throw Error(what, "found " + std::to_string(size.width) + "x" + std::to_string(size.height) +
                          ", expected sides from 1 to " + std::to_string(kLongestSide));
  }
  if (size.x > INT_MAX - size.width || size.y > INT_MAX - size.height) RefuseWindow(what);
  return {size.x, size.y, size.x + size.width, size.y + size.height};
}

Roi ScaledWindow(const char* what, const Roi& data, const Roi& full, const Roi& display) {
  const auto scaled = [&](int& v0, int& v1, int from, int size, int to, int new_size) {
    const float ratio = static_cast<float>(new_size) / static_cast<float>(size);
    const double length = std::ceil(static_cast<float>(v1 - v0) * ratio);
    const double start = to + double{std::floor(static_cast<float>(v0 - from) * ratio)};
    if (!(std::fabs(start) < INT_MAX) || !(start + length < INT_MAX)) RefuseWindow(what);
    v0 = static_cast<int>(start);
    v1 = static_cast<int>(start + length);
  };
  Roi w = data;
  scaled(w.x0, w.x1, full.x0, full.width(), display.x0, display.width());
  scaled(w.y0, w.y1, full.y0, full.height(), display.y0, display.height());
  w.x1 = std::max(w.x1, w.x0 + 1);
  w.y1 = std::max(w.y1, w.y0 + 1);
  return w;
}

ResizeParams ParseResize(const std::string& text, const Roi& from) {
  ResizeParams p;
  p.x = from.x0, p.y = from.y0;
  const char* at = text.data();
  const char* const end = at + text.size();
  double side[2] = {0, 0};
  bool percent[2] = {false, false};
  const auto refuse = [&]() {
    throw Error("geometry", "found \"" + text.substr(0, 60) + "\", expected WxH, W%, W%xH% or WxH+X+Y");
  };
  const auto number = [&](double* value) {
    const auto [stop, error] = std::from_chars(at, end, *value);
    if (error != std::errc() || !(*value >= 0) || *value > 1e9) refuse();
    at = stop;
  };
  number(&side[0]);
  if (at < end && *at == '%') percent[0] = true, ++at;
  if (at < end && *at == 'x') {
    ++at;
    number(&side[1]);
    if (at < end && *at == '%') percent[1] = true, ++at;
  } else if (percent[0]) {
    side[1] = side[0], percent[1] = true;
  } else {
    refuse();
  }
  if (at < end) {
    const Roi offset = ParseGeometry(std::string(at, end), {0, 0, 1, 1});
    p.x = offset.x0, p.y = offset.y0;
  }
  if (percent[0]) side[0] = std::floor(from.width() * side[0] / 100 + 0.5);
  if (percent[1]) side[1] = std::floor(from.height() * side[1] / 100 + 0.5);
  if (side[0] == 0 && side[1] == 0) refuse();
  if (side[0] == 0) side[0] = std::floor(side[1] * from.width() / std::max(1, from.height()) + 0.5);
  if (side[1] == 0) side[1] = std::floor(side[0] * from.height() / std::max(1, from.width()) + 0.5);
  p.width = static_cast<int>(side[0]), p.height = static_cast<int>(side[1]);
  return p;
}

}  // namespace tessera::ops
