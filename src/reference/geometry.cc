// Reference of the geometry operations: the definition of every result pixel as one sum over source pixels.
#include "tessera/ops/geometry.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "reference/border.h"
#include "reference/footprint.h"
#include "reference/point_loop.h"
#include "reference/reference.h"
#include "reference/resample_filters.h"
#include "tessera/ops/arrangement.h"

namespace tessera::reference {
namespace {

using filters::KernelOf;
using filters::Value;

// What beyond the image counts as in the sum of weights.
enum class Outside { kCounts, kLeftOut };

// The image filtered at (x, y), positions of pixel indices; the filter is `wide` times as wide.
struct Lookup {
  const ImageD& image;
  std::string filter;
  Wrap wrap_x = Wrap::kClamp, wrap_y = Wrap::kClamp;
  Outside outside = Outside::kCounts;
  bool nearest_picks_one = false;  // a position half-way between two pixels takes the right one

  struct Tap {
    int at;
    double weight;
  };
  // `black`, where not null: the sum of |weight| of what counts as black, beside the taps.
  std::vector<Tap> Axis(double position, double wide, int64_t low, int64_t high, Wrap wrap,
                        double* black = nullptr) const {
    std::vector<Tap> taps;
    if (!(std::fabs(position) < 0x1p40)) return taps;
    double sum = 0, unseen = 0;
    if (filter == "box" && nearest_picks_one && wide == 1) {
      auto i = static_cast<int64_t>(std::floor(position + 0.5));
      // A mirror image is the image mirrored, so that there it is the left one.
      const double copy =
          std::floor((position + 0.5 - static_cast<double>(low)) / static_cast<double>(high - low));
      if (wrap == Wrap::kMirror && std::fmod(copy, 2) != 0)
        i = static_cast<int64_t>(std::ceil(position - 0.5));
      if (Shown(i, low, high, wrap)) taps.push_back({static_cast<int>(i), 1});
      return taps;
    }
    const double radius = KernelOf(filter).radius * wide;
    for (auto i = static_cast<int64_t>(std::ceil(position - radius - 1e-9)); i <= position + radius + 1e-9;
         ++i) {
      const double w = Value(filter, (static_cast<double>(i) - position) / wide);
      int64_t at = i;
      const bool seen = Shown(at, low, high, wrap);
      if (seen || outside == Outside::kCounts) sum += w;
      if (!seen && outside == Outside::kCounts) unseen += std::fabs(w);
      if (seen && w != 0) taps.push_back({static_cast<int>(at), w});
    }
    if (sum == 0 || (outside == Outside::kLeftOut && sum < 0)) return {};
    for (Tap& t : taps) t.weight /= sum;
    // Where a small image is seen many times over, each pixel once.
    if (static_cast<int64_t>(taps.size()) > high - low) {
      std::map<int, double> folded;
      for (const Tap& t : taps) folded[t.at] += t.weight;
      taps.clear();
      for (const auto& [at, weight] : folded) taps.push_back({at, weight});
    }
    if (black != nullptr) *black = unseen / std::fabs(sum);
    return taps;
  }
  static double Absolute(const std::vector<Tap>& taps) {
    double sum = 0;
    for (const Tap& t : taps) sum += std::fabs(t.weight);
    return sum;
  }
  // {value, scale} of a channel; the scale is the largest value under the filter times the sum of |weight|.
  static std::pair<double, double> Sum(const ImageD& image, const std::vector<Tap>& x,
                                       const std::vector<Tap>& y, int c) {
    double value = 0, weight = 0, largest = 0;
    for (const Tap& row : y) {
      for (const Tap& column : x) {
        const double sample = image.at(column.at, row.at, c);
        value += row.weight * column.weight * sample;
        weight += std::fabs(row.weight * column.weight);
        largest = std::max(largest, std::fabs(sample));
      }
    }
    return {value, largest * weight};
  }
};

void Put(const Call& call, int x, int y, int c, std::pair<double, double> sample) {
  call.out.at(x, y, c) = sample.first;
  if (call.scale != nullptr) call.scale->at(x, y, c) = std::max(sample.second, kSmallestScale);
}

double Snapped(double position, double within) {
  const double near = std::round(2 * position) / 2;  // a pixel's centre or edge
  return std::fabs(position - near) < within ? near : position;
}

// One axis of a separable operation: result index i looks at position origin + (i + 1/2) step.
struct Line {
  double origin, step, wide;
  double At(int i) const { return Snapped(origin + (i + 0.5) * step - 0.5, 0x1p-20); }
};

void EvaluateLines(const Call& call, const std::string& filter, const Line& lx, const Line& ly, Wrap wrap) {
  const ImageD& in = call.in[0];
  const Roi& w = call.in_specs[0].data_window;
  const Lookup look{in, filter, wrap, wrap};
  std::vector<std::vector<Lookup::Tap>> columns;
  for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
    columns.push_back(look.Axis(lx.At(x), lx.wide, w.x0, w.x1, wrap));
  }
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    const auto rows = look.Axis(ly.At(y), ly.wide, w.y0, w.y1, wrap);
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      for (int c = 0; c < call.out.channels; ++c) {
        Put(call, x, y, c, Lookup::Sum(in, columns[static_cast<size_t>(x - call.out.roi.x0)], rows, c));
      }
    }
  }
}

// The same with a filter of the distance in the plane.
void EvaluateRadial(const Call& call, const std::string& filter, const Line& lx, const Line& ly) {
  const ImageD& in = call.in[0];
  const Roi& w = call.in_specs[0].data_window;
  const double rx = KernelOf(filter).radius * lx.wide, ry = KernelOf(filter).radius * ly.wide;
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      const double px = lx.origin + (x + 0.5) * lx.step - 0.5, py = ly.origin + (y + 0.5) * ly.step - 0.5;
      for (int c = 0; c < call.out.channels; ++c) {
        double value = 0, sum = 0, largest = 0, absolute = 0;
        for (auto j = static_cast<int64_t>(std::ceil(py - ry)); j <= py + ry; ++j) {
          for (auto i = static_cast<int64_t>(std::ceil(px - rx)); i <= px + rx; ++i) {
            const double dx = (static_cast<double>(i) - px) / lx.wide,
                         dy = (static_cast<double>(j) - py) / ly.wide;
            const double weight = Value(filter, std::sqrt(dx * dx + dy * dy));
            if (weight == 0) continue;
            int64_t ix = i, iy = j;
            Shown<int64_t>(ix, w.x0, w.x1, Wrap::kClamp);
            Shown<int64_t>(iy, w.y0, w.y1, Wrap::kClamp);
            const double sample = in.at(static_cast<int>(ix), static_cast<int>(iy), c);
            value += weight * sample, sum += weight;
            absolute += std::fabs(weight), largest = std::max(largest, std::fabs(sample));
          }
        }
        Put(call, x, y, c,
            sum == 0 ? std::pair(0.0, 0.0) : std::pair(value / sum, largest * absolute / std::fabs(sum)));
      }
    }
  }
}

struct ResizeLines {
  std::string filter;
  Line x, y;
};
ResizeLines LinesOf(const ResizeParams& p, const ImageSpec& in) {
  const Roi from = in.display_window.empty() ? in.data_window : in.display_window;
  std::string filter = p.filter;
  const bool grows = p.width > from.width() || p.height > from.height();
  if (filter.empty()) filter = grows ? "blackman-harris" : "lanczos3";
  if (p.width == from.width() && p.height == from.height()) filter = "box";
  const double sx = static_cast<double>(from.width()) / p.width,
               sy = static_cast<double>(from.height()) / p.height;
  return {filter, {from.x0 - p.x * sx, sx, std::max(1.0, sx)}, {from.y0 - p.y * sy, sy, std::max(1.0, sy)}};
}

// All that a filter of that radius sees of a line, and the edge where it sees beyond it.
std::pair<int, int> Reach(const Line& line, double radius, int first, int end, int low, int high) {
  const double far = radius * line.wide + 1;
  const auto at = [&](double v) {
    return static_cast<int>(
        std::clamp(std::floor(v), static_cast<double>(low), static_cast<double>(high - 1)));
  };
  return {at(line.At(first) - far), at(line.At(end - 1) + far + 1) + 1};
}
Roi ResizeRoi(const std::any& parameters, const ImageSpec& in, const Roi& out) {
  const Roi& w = in.data_window;
  if (out.empty() || w.empty()) return {};
  const auto [filter, x, y] = LinesOf(std::any_cast<const ResizeParams&>(parameters), in);
  const double radius = KernelOf(filter).radius;
  const auto [x0, x1] = Reach(x, radius, out.x0, out.x1, w.x0, w.x1);
  const auto [y0, y1] = Reach(y, radius, out.y0, out.y1, w.y0, w.y1);
  return {x0, y0, x1, y1};
}

void EvaluateResize(const Call& call) {
  const auto& p = std::any_cast<const ResizeParams&>(call.parameters);
  const auto [filter, lx, ly] = LinesOf(p, call.in_specs[0]);
  if (KernelOf(filter).radial) {
    EvaluateRadial(call, filter, lx, ly);
  } else {
    EvaluateLines(call, filter, lx, ly, Wrap::kClamp);
  }
}

void EvaluateShift(const Call& call) {
  const auto& p = std::any_cast<const ShiftParams&>(call.parameters);
  const bool whole = p.x == std::floor(p.x) && p.y == std::floor(p.y);
  EvaluateLines(call, whole ? "box" : p.filter, {-p.x, 1, 1}, {-p.y, 1, 1}, p.wrap);
}

void EvaluateMip(const Call& call) {
  const auto& p = std::any_cast<const MipParams&>(call.parameters);
  const ImageSpec& in = call.in_specs[0];
  const Roi& w = in.data_window;
  for (double& v : call.out.samples) v = 0;
  if (call.scale != nullptr)
    std::fill(call.scale->samples.begin(), call.scale->samples.end(), kSmallestScale);
  const int first = p.level < 0 ? 0 : p.level, last = p.level < 0 ? MipLevelCount(in) - 1 : p.level;
  for (int level = first; level <= last; ++level) {
    const Roi window = p.level < 0 ? MipLevelWindow(in, level) : call.out_spec.data_window;
    const Roi part = Intersection(window, call.out.roi);
    if (part.empty()) continue;
    const double sx = static_cast<double>(w.width()) / window.width(),
                 sy = static_cast<double>(w.height()) / window.height();
    ImageD value(part, call.out.channels), scale(part, call.out.channels);
    const Call one{call.parameters, call.in, call.in_specs, call.out_spec, value, &scale};
    EvaluateLines(one, level == 0 ? "box" : p.filter, {w.x0 - window.x0 * sx, sx, sx},
                  {w.y0 - window.y0 * sy, sy, sy}, p.wrap);
    for (int y = part.y0; y < part.y1; ++y) {
      for (int x = part.x0; x < part.x1; ++x) {
        for (int c = 0; c < call.out.channels; ++c)
          Put(call, x, y, c, {value.at(x, y, c), scale.at(x, y, c)});
      }
    }
  }
}

// The pixel of one axis that a zoom copies to i.
int Zoomed(double factor, int i, int origin, int low, int high) {
  const int at = origin + static_cast<int>(std::floor((i + 0.5 - origin) / factor));
  return std::min(std::max(at, low), high - 1);
}
Roi ZoomRoi(const std::any& parameters, const ImageSpec& in, const Roi& out) {
  const auto& p = std::any_cast<const ZoomParams&>(parameters);
  const Roi &w = in.data_window, &d = in.display_window;
  if (out.empty() || w.empty()) return {};
  // A factor below 0 mirrors.
  const auto [x0, x1] =
      std::minmax({Zoomed(p.x, out.x0, d.x0, w.x0, w.x1), Zoomed(p.x, out.x1 - 1, d.x0, w.x0, w.x1)});
  const auto [y0, y1] =
      std::minmax({Zoomed(p.y, out.y0, d.y0, w.y0, w.y1), Zoomed(p.y, out.y1 - 1, d.y0, w.y0, w.y1)});
  return {x0, y0, x1 + 1, y1 + 1};
}

void EvaluateZoom(const Call& call) {
  const auto& p = std::any_cast<const ZoomParams&>(call.parameters);
  const Roi &w = call.in_specs[0].data_window, &d = call.in_specs[0].display_window;
  ForEachSample(call, [&](int x, int y, int c) {
    return Rounded(call.in[0].at(Zoomed(p.x, x, d.x0, w.x0, w.x1), Zoomed(p.y, y, d.y0, w.y0, w.y1), c));
  });
}

// Where one result pixel of a warp looks, how wide, and what doubles in another order may be off by.
struct Place {
  double x = 0, y = 0, wide_x = 1, wide_y = 1, off_x = 0, off_y = 0;
  double by_x[2] = {1, 0}, by_y[2] = {0, 1};  // derivatives of (x, y) by the result's two coordinates
};

// Values and scales of every channel at a place.
struct Looked {
  std::vector<double> value, scale;
};
Looked LookAt(const Call& call, const Lookup& look, const Place& p) {
  const Roi& w = call.in_specs[0].data_window;
  // A reduction takes in at most 65,536 pixels per axis.
  const double widest = 32768 / KernelOf(look.filter).radius;
  double black_x = 0, black_y = 0;
  const auto columns =
      look.Axis(Snapped(p.x, 0x1p-17), std::min(p.wide_x, widest), w.x0, w.x1, look.wrap_x, &black_x);
  const auto rows =
      look.Axis(Snapped(p.y, 0x1p-17), std::min(p.wide_y, widest), w.y0, w.y1, look.wrap_y, &black_y);
  // The weights of what is black take part in the sum that all are divided by, so they belong to the scale.
  const double seen_x = Lookup::Absolute(columns), seen_y = Lookup::Absolute(rows);
  double share = seen_x * seen_y > 0 ? (1 + black_x / seen_x) * (1 + black_y / seen_y) : 1;
  // Long sums round more often, and of a flat picture always one way.
  share *= 1 + KernelOf(look.filter).radius * (std::min(p.wide_x, widest) + std::min(p.wide_y, widest)) / 64;
  Looked looked;
  for (int c = 0; c < call.out.channels; ++c) {
    const auto [value, scale] = Lookup::Sum(look.image, columns, rows, c);
    looked.value.push_back(value), looked.scale.push_back(scale * share);
  }
  return looked;
}

void PutLookup(const Call& call, const Lookup& look, int x, int y, const Place& place) {
  const Looked here = LookAt(call, look, place);
  std::vector<double> apart(here.value.size());
  // What places that far out, or that near to a horizon, are off by is felt. So is the kernel's snap, which
  // is a step where a position is that near to its end.
  const auto near_snap = [](double at, double off) {
    const double from = std::fabs(2 * at - std::round(2 * at)) / 2;
    return std::fabs(from - 0x1p-17) <= off;
  };
  const double most = std::max(place.off_x, place.off_y);
  if (call.scale != nullptr &&
      (most > 0x1p-30 || near_snap(place.x, place.off_x) || near_snap(place.y, place.off_y))) {
    for (const int side : {0, 1, 2, 3}) {
      Place aside = place;
      aside.x += (side % 2 != 0 ? 1 : -1) * place.off_x, aside.y += (side / 2 != 0 ? 1 : -1) * place.off_y;
      const Looked there = LookAt(call, look, aside);
      for (size_t c = 0; c < apart.size(); ++c)
        apart[c] = std::max(apart[c], std::fabs(there.value[c] - here.value[c]));
    }
  }
  for (int c = 0; c < call.out.channels; ++c) {
    const auto k = static_cast<size_t>(c);
    Put(call, x, y, c, {here.value[k], here.scale[k]});
    if (apart[k] > 0) call.Undecided(x, y, c, apart[k]);
  }
}

// A few roundings of doubles, in parts of the terms of a sum.
constexpr double kOrder = 0x1p-50;

// Solves (x, y, 1) M = q (X, Y, 1) for x and y by Cramer's rule; false where the projector does not see.
struct Projector {
  std::vector<long double> m;
  long double sign;

  Projector(const std::vector<double>& matrix, const Roi& frame) : m(matrix.begin(), matrix.end()) {
    const long double cx = 0.5L * (0.0L + frame.x0 + frame.x1), cy = 0.5L * (0.0L + frame.y0 + frame.y1);
    sign = cx * m[2] + cy * m[5] + m[8] < 0 ? -1 : 1;
  }
  // x (m0 - X m2) + y (m3 - X m5) = X m8 - m6 and the same with Y; the derivatives of both by X and by Y.
  bool Source(long double big_x, long double big_y, Place* to) const {
    const long double a = m[0] - big_x * m[2], b = m[3] - big_x * m[5], e = big_x * m[8] - m[6];
    const long double c = m[1] - big_y * m[2], d = m[4] - big_y * m[5], f = big_y * m[8] - m[7];
    const long double det = a * d - b * c;
    const long double x = (e * d - b * f) / det, y = (a * f - e * c) / det, q = x * m[2] + y * m[5] + m[8];
    to->x = static_cast<double>(x - 0.5L), to->y = static_cast<double>(y - 0.5L);
    const auto steepest = [&](long double s, long double t) {
      return std::max(1.0, static_cast<double>(std::max(std::fabs(s * q / det), std::fabs(t * q / det))));
    };
    to->wide_x = steepest(d, b), to->wide_y = steepest(c, a);
    const auto derivative = [&](long double part) { return static_cast<double>(part * q / det); };
    to->by_x[0] = derivative(d), to->by_x[1] = derivative(-c);
    to->by_y[0] = derivative(-b), to->by_y[1] = derivative(a);
    // What cancels leaves the rounding of its parts.
    const long double parts_x = std::fabs(e * d) + std::fabs(b * f),
                      parts_y = std::fabs(a * f) + std::fabs(e * c);
    const long double share = (std::fabs(a * d) + std::fabs(b * c)) / std::fabs(det);
    to->off_x = static_cast<double>(kOrder * (parts_x / std::fabs(det) + std::fabs(x) * share));
    to->off_y = static_cast<double>(kOrder * (parts_y / std::fabs(det) + std::fabs(y) * share));
    return q * sign > 0;
  }
};

void EvaluateWarp(const Call& call) {
  const auto& p = std::any_cast<const WarpParams&>(call.parameters);
  const Projector projector(p.matrix, call.in_specs[0].display_window);
  if (p.filter == "trilinear" || p.filter == "ewa") {
    Footprints footprints(call, call.in_specs[0].data_window, p.wrap, p.filter == "ewa", p.anisotropy);
    for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
      for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
        Place at;
        if (!projector.Source(x + 0.5L, y + 0.5L, &at)) at.x = INFINITY;
        footprints.Put(x, y,
                       {at.x, at.y, at.by_x[0], at.by_x[1], at.by_y[0], at.by_y[1], at.off_x, at.off_y});
      }
    }
    return;
  }
  const Lookup look{call.in[0], p.filter.empty() ? "lanczos3" : p.filter, p.wrap, p.wrap, Outside::kCounts,
                    true};
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      Place place;
      if (!projector.Source(x + 0.5L, y + 0.5L, &place)) place = {INFINITY, INFINITY};
      PutLookup(call, look, x, y, place);
    }
  }
}

// The picture's middle lies in the window's, each pixel as many times as large as one side's ratio says.
void EvaluateFit(const Call& call) {
  const auto& p = std::any_cast<const FitParams&>(call.parameters);
  const Roi& d = call.in_specs[0].display_window;
  const double across = static_cast<double>(p.width) / d.width(),
               down = static_cast<double>(p.height) / d.height();
  const double times = p.mode == FitMode::kWidth    ? across
                       : p.mode == FitMode::kHeight ? down
                                                    : std::min(across, down);
  std::string filter = p.filter;
  if (filter.empty()) filter = across > 1 || down > 1 ? "blackman-harris" : "lanczos3";
  const Lookup look{call.in[0], filter, Wrap::kBlack, Wrap::kBlack, Outside::kLeftOut, true};
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      Place place;
      place.x = (x + 0.5 - p.x - 0.5 * p.width) / times + 0.5 * d.width() + d.x0 - 0.5;
      place.y = (y + 0.5 - p.y - 0.5 * p.height) / times + 0.5 * d.height() + d.y0 - 0.5;
      place.wide_x = place.wide_y = std::max(1.0, 1 / times);
      place.off_x = kOrder * (std::fabs(d.x0) + d.width() + (std::fabs(p.x) + p.width) / times);
      place.off_y = kOrder * (std::fabs(d.y0) + d.height() + (std::fabs(p.y) + p.height) / times);
      PutLookup(call, look, x, y, place);
      // Beyond the edge, at whole distances, every weight of a sinc is 0 or what its rounding left; filters
      // end at halves of one.
      const auto at_zero = [&](double at, int low, int high) {
        const double beyond = std::max(low - at, at - (high - 1.0)) / place.wide_x;
        return beyond > 0.25 && std::fabs(2 * beyond - std::round(2 * beyond)) < 1e-9;
      };
      const Roi& w = call.in_specs[0].data_window;
      if (at_zero(place.x, w.x0, w.x1) || at_zero(place.y, w.y0, w.y1)) call.Undecided(x, y);
    }
  }
}

void EvaluateStWarp(const Call& call) {
  const auto& p = std::any_cast<const StWarpParams&>(call.parameters);
  const Roi& d = call.in_specs[0].display_window;
  const Lookup look{
      call.in[0], p.filter.empty() ? "lanczos3" : p.filter, p.wrap_s, p.wrap_t, Outside::kLeftOut, true};
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      double s = call.in[1].at(x, y, p.channel_s), t = call.in[1].at(x, y, p.channel_t);
      if (p.flip_s) s = 1 - s;
      if (p.flip_t) t = 1 - t;
      Place place{d.x0 + s * d.width() - 0.5, d.y0 + t * d.height() - 0.5};
      place.off_x = kOrder * (std::fabs(d.x0) + (std::fabs(s) + 1) * d.width());
      place.off_y = kOrder * (std::fabs(d.y0) + (std::fabs(t) + 1) * d.height());
      PutLookup(call, look, x, y, place);
    }
  }
}

void EvaluateDistort(const Call& call) {
  const auto& p = std::any_cast<const DistortParams&>(call.parameters);
  const Lookup look{call.in[0], p.filter.empty() ? "triangle" : p.filter, p.wrap, p.wrap, Outside::kCounts,
                    true};
  const int last = call.in[1].channels - 1;
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      const double dx = call.in[1].at(x, y, p.channel_x),
                   dy = call.in[1].at(x, y, std::min(p.channel_y, last));
      Place place{x + p.amount * (dx - p.centre), y + p.amount * (dy - p.centre)};
      const double far = std::fabs(p.amount * p.centre);
      place.off_x = kOrder * (std::fabs(x) + std::fabs(p.amount * dx) + far + 1);
      place.off_y = kOrder * (std::fabs(y) + std::fabs(p.amount * dy) + far + 1);
      PutLookup(call, look, x, y, place);
    }
  }
}

constexpr Roi kEverything{INT32_MIN / 2, INT32_MIN / 2, INT32_MAX / 2, INT32_MAX / 2};
Roi AllOf(const std::any&, int, const Roi&) { return kEverything; }
Roi AllOfTheFirst(const std::any&, int input, const Roi& out) { return input == 0 ? kEverything : out; }

}  // namespace

std::vector<Entry> GeometryEntries() {
  std::vector<Entry> entries = {
      {"resize", EvaluateResize, AllOf, 1, {}, ResizeRoi},
      {"shift", EvaluateShift, AllOf, 1},
      {"mip", EvaluateMip, AllOf, 1},
      {"zoom", EvaluateZoom, AllOf, 1, {}, ZoomRoi},
      {"warp", EvaluateWarp, AllOf, 1},
      {"fit", EvaluateFit, AllOf, 1},
      {"st_warp", EvaluateStWarp, AllOfTheFirst, 1},
      {"distort", EvaluateDistort, AllOfTheFirst, 1},
  };
  for (Entry& entry : entries) {  // pixels near a horizon take in very many others
    entry.by_rows = entry.op == "warp" || entry.op == "fit" || entry.op == "st_warp" || entry.op == "distort";
  }
  return entries;
}

}  // namespace tessera::reference
