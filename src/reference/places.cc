// References of what moves pixels and windows: each pixel's place told from the display windows' corners.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "model/placements.h"
#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/arrangement.h"

namespace tessera::reference {
namespace {

struct Pixel {
  int64_t x, y;
};

// Counted from the corner of what is shown, column u and row v of a picture w wide and h high.
Pixel Source(Rearrangement how, const ImageSpec& in, int64_t x, int64_t y) {
  const Roi& d = in.display_window.empty() ? in.data_window : in.display_window;
  if (how == Rearrangement::kTranspose) return {y, x};
  const int64_t u = x - d.x0, v = y - d.y0, w = d.width(), h = d.height();
  Pixel from{u, v};
  if (how == Rearrangement::kFlip) from = {u, h - 1 - v};
  if (how == Rearrangement::kFlop) from = {w - 1 - u, v};
  if (how == Rearrangement::kRotate180) from = {w - 1 - u, h - 1 - v};
  if (how == Rearrangement::kRotate90) from = {v, h - 1 - u};
  if (how == Rearrangement::kRotate270) from = {w - 1 - v, u};
  return {d.x0 + from.x, d.y0 + from.y};
}

Roi Between(const Pixel& a, const Pixel& b) {
  const auto [x0, x1] = std::minmax(a.x, b.x);
  const auto [y0, y1] = std::minmax(a.y, b.y);
  return {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1 + 1), static_cast<int>(y1 + 1)};
}

Roi RearrangedRoi(const std::any& parameters, const ImageSpec& in, const Roi& out) {
  if (out.empty()) return {};
  const auto how = std::any_cast<Rearrangement>(parameters);
  return Between(Source(how, in, out.x0, out.y0), Source(how, in, out.x1 - 1, out.y1 - 1));
}

void EvaluateRearranged(const Call& call) {
  const auto how = std::any_cast<Rearrangement>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const Pixel from = Source(how, call.in_specs[0], x, y);
    return Rounded(call.in[0].at(static_cast<int>(from.x), static_cast<int>(from.y), c));
  });
}

Roi MovedRoi(const std::any& parameters, const ImageSpec&, const Roi& out) {
  if (out.empty()) return {};
  const auto by = std::any_cast<Offset>(parameters);
  return Between({int64_t{out.x0} - by.x, int64_t{out.y0} - by.y},
                 {int64_t{out.x1} - 1 - by.x, int64_t{out.y1} - 1 - by.y});
}

void EvaluateMoved(const Call& call) {
  const auto by = std::any_cast<Offset>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) { return Rounded(call.in[0].at(x - by.x, y - by.y, c)); });
}

void EvaluateCircle(const Call& call) {
  const auto by = std::any_cast<Offset>(call.parameters);
  const Roi& w = call.in_specs[0].data_window;
  // Backs up by whole images until it is inside one.
  const auto within = [](int64_t at, int begin, int end) {
    const int64_t size = int64_t{end} - begin,
                  turns = (at - begin) / size - ((at - begin) % size < 0 ? 1 : 0);
    return static_cast<int>(at - turns * size);
  };
  ForEachSample(call, [&](int x, int y, int c) {
    return Rounded(
        call.in[0].at(within(int64_t{x} - by.x, w.x0, w.x1), within(int64_t{y} - by.y, w.y0, w.y1), c));
  });
}

// The uppermost image that has this sample.
void EvaluatePaste(const Call& call) {
  const auto& p = std::any_cast<const ops::Placements&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    for (size_t k = p.at.size(); k-- > 0;) {
      const Roi& w = call.in_specs[k].data_window;
      const int64_t sx = int64_t{x} - p.at[k].x, sy = int64_t{y} - p.at[k].y;
      if (sx < w.x0 || sx >= w.x1 || sy < w.y0 || sy >= w.y1 || c >= call.in[k].channels) continue;
      return Rounded(call.in[k].at(static_cast<int>(sx), static_cast<int>(sy), c));
    }
    return Rounded(0);
  });
}

Roi PasteRoi(const std::any& parameters, int input, const Roi& out) {
  const Offset& by = std::any_cast<const ops::Placements&>(parameters).at[static_cast<size_t>(input)];
  const auto back = [](int v, int by) {
    return static_cast<int>(std::clamp<int64_t>(int64_t{v} - by, INT32_MIN, INT32_MAX));
  };
  return {back(out.x0, by.x), back(out.y0, by.y), back(out.x1, by.x), back(out.y1, by.y)};
}

// A resample's position, which is oiiotool's in float.
float Resampled(int i, int to, int to_size, int from, int from_size) {
  const float unit = 1.0f / static_cast<float>(to_size);
  const float s = (static_cast<float>(i) - static_cast<float>(to) + 0.5f) * unit;
  return static_cast<float>(from) + s * static_cast<float>(from_size);
}

void EvaluateResample(const Call& call) {
  const auto& p = std::any_cast<const ResampleParams&>(call.parameters);
  const Roi &w = call.in_specs[0].data_window, &d = call.in_specs[0].display_window,
            &to = call.out_spec.display_window;
  const Roi& from = d.empty() ? w : d;
  const auto sample = [&](double sx, double sy, int c) {
    return call.in[0].at(static_cast<int>(std::clamp<double>(sx, w.x0, w.x1 - 1.0)),
                         static_cast<int>(std::clamp<double>(sy, w.y0, w.y1 - 1.0)), c);
  };
  ForEachSample(call, [&](int x, int y, int c) -> std::pair<double, double> {
    const float px = Resampled(x, to.x0, to.width(), from.x0, from.width()),
                py = Resampled(y, to.y0, to.height(), from.y0, from.height());
    if (!p.interpolate) {
      const double sx = std::floor(px), sy = std::floor(py);
      const bool there = sx >= w.x0 && sx < w.x1 && sy >= w.y0 && sy < w.y1;
      return Rounded(there ? sample(sx, sy, c) : 0);
    }
    const float left = std::floor(px - 0.5f), upper = std::floor(py - 0.5f);
    const double u = (px - 0.5f) - left, v = (py - 0.5f) - upper;
    double value = 0, largest = 0;
    for (const int j : {0, 1}) {
      for (const int i : {0, 1}) {
        const double weight = (i == 0 ? 1 - u : u) * (j == 0 ? 1 - v : v);
        if (weight == 0) continue;
        const double term = sample(double{left} + i, double{upper} + j, c);
        value += weight * term;
        if (!(std::fabs(term) <= largest)) largest = std::fabs(term);
      }
    }
    return {value, largest};
  });
}

constexpr Roi kEverything{INT32_MIN / 2, INT32_MIN / 2, INT32_MAX / 2, INT32_MAX / 2};
Roi AllOf(const std::any&, int, const Roi&) { return kEverything; }

}  // namespace

std::vector<Entry> PlacesEntries() {
  std::vector<Entry> entries = {
      {"originoffset", EvaluateMoved, AllOf, 1, {}, MovedRoi},
      {"cshift", EvaluateCircle, AllOf, 1},
      {"paste", EvaluatePaste, PasteRoi},
      {"resample", EvaluateResample, AllOf, 1},
  };
  for (const char* const name : {"flip", "flop", "rotate90", "rotate180", "rotate270", "transpose"})
    entries.push_back({name, EvaluateRearranged, AllOf, 1, {}, RearrangedRoi});
  return entries;
}

}  // namespace tessera::reference
