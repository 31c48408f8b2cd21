// Reference of line integral convolution: streamlines of every pixel in double, with small steps, and what
// their samples may be off by when positions are.
#include "tessera/ops/flow.h"

#include <algorithm>
#include <any>
#include <array>
#include <climits>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "reference/flow_lines.h"
#include "reference/flow_scene.h"
#include "reference/flow_weights.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

using flow::ContrastOf;
using flow::Follow;
using flow::FollowCells;
using flow::Point;
using flow::Scene;
using flow::Taps;
using flow::Weight;

// One pixel's sums, and what they may be off by.
class Pixel {
 public:
  Pixel(const Scene& scene, const LicParams& p) : scene_(scene), p_(p) {}

  struct Result {
    std::vector<double> value, tolerance;
    bool masked = false;
    // Where a line ends, or which way it goes, may be decided otherwise: any mean of the texture's values.
    bool undecided = false;
    double doubtful = 0;  // weight of taps that may be there or not
  };

  Result Convolve(int x, int y) const {
    const auto count = static_cast<size_t>(scene_.channels());
    Result r{std::vector<double>(count), std::vector<double>(count), false, false, 0};
    if (!scene_.Open(x, y)) {
      r.masked = true;
      return r;
    }
    double weight = Weight(p_, 0);
    for (int c = 0; c < scene_.channels() && weight != 0; ++c)
      r.value[static_cast<size_t>(c)] = weight * scene_.Texel(x, y, c);
    for (const double sign : {1.0, -1.0}) AddLine(x, y, sign, r, weight);
    // A few taps at a line's end are as many pixels that may be others; more decide what is seen.
    r.undecided |= r.doubtful > 0.1 * weight;
    for (size_t c = 0; c < count; ++c) {
      const double range = scene_.range(static_cast<int>(c));
      r.value[c] = weight > 0 ? r.value[c] / weight : 0;
      double off = weight > 0 ? (r.tolerance[c] + r.doubtful * range) / weight : 0;
      // Lines that drift so far that a quarter of what they read may be something else.
      if (p_.method == LicMethod::kShared) off = 0;  // AddSharing knows how far beside they may be
      r.undecided |= off > 0.25 * range;
      r.tolerance[c] = std::min(off, 0.25 * range) + 2e-6 * std::max(range, std::fabs(r.value[c]));
    }
    if (p_.method == LicMethod::kShared) AddSharing(x, y, r);
    return r;
  }

 private:
  bool Cells() const { return p_.integrator == LicIntegrator::kCell; }
  bool Adaptive() const { return p_.integrator == LicIntegrator::kAdaptive && !p_.speed; }
  // How far positions are off that no step's error explains: 1e-3 pixels over 100 where steps are chosen.
  double Moved() const {
    if (Adaptive()) return 1e-3 * std::max(1.0, p_.length / 100);
    return Cells() ? 1e-3 : 1e-4;
  }
  int Parts() const {
    if (p_.speed) return static_cast<int>(std::clamp(std::ceil(scene_.longest() * p_.step), 1.0, 64.0));
    return Adaptive() ? static_cast<int>(std::ceil(p_.step)) : 1;
  }

  std::vector<Point> From(int x, int y, Point off, double sign, int parts) const {
    if (Cells()) return FollowCells(scene_, p_, x, y, 0.5 + off.x, 0.5 + off.y, sign);
    return Follow(scene_, p_, {x + off.x, y + off.y}, sign, parts);
  }

  void AddLine(int x, int y, double sign, Result& r, double& weight) const {
    const double d = Moved();
    const std::vector<Point> line = From(x, y, {}, sign, Adaptive() ? 4 * Parts() : Parts());
    std::vector<std::vector<Point>> others;
    for (const Point off : {Point{d, 0}, Point{-d, 0}, Point{0, d}, Point{0, -d}}) {
      others.push_back(From(x, y, off, sign, Parts()));
    }
    const double reach = p_.magnitude == LicMagnitude::kLength ? Taps(p_) * scene_.Share(x, y)
                                                               : std::numeric_limits<double>::infinity();
    std::vector<double> apart(line.size(), d);  // how far lines are that start d away
    for (size_t i = 0; i < line.size(); ++i) {
      for (const auto& other : others)
        apart[i] = std::max(apart[i], std::hypot(other[i].x - line[i].x, other[i].y - line[i].y));
    }
    const Missed steps = Adaptive()
                             ? StepErrors(x, y, line, apart, sign)
                             : Missed{std::vector<double>(line.size()), std::vector<double>(line.size())};
    bool ended = false, loose = false;
    for (size_t i = 0; i < line.size(); ++i) {
      const double number = static_cast<double>(i) + 1, w = Weight(p_, static_cast<int>(sign * number));
      if (std::fabs(number - reach) < 1e-3) r.undecided = true;
      if (number > reach) return;
      Point low = line[i], high = line[i];
      for (const auto& other : others) {
        low = {std::min(low.x, other[i].x), std::min(low.y, other[i].y)};
        high = {std::max(high.x, other[i].x), std::max(high.y, other[i].y)};
      }
      // In fields as rough as noise the worst chain of steps is not always found: twice.
      const double margin = Cells() ? 0
                                    : d + 2 * steps.grown[i] * apart[i] / d + steps.astray[i] +
                                          (high.x - low.x + high.y - low.y) / 2;
      low = {low.x - margin, low.y - margin}, high = {high.x + margin, high.y + margin};
      const bool open = !ended && scene_.Open(Nearest(line[i].x), Nearest(line[i].y));
      const Reach reach_here = ReachOf(low, high);
      if (reach_here == Reach::kAnywhere) {
        r.undecided = true;
        if (!open) return;
      }
      // A line may have ended before the others do, or go on behind its end.
      loose |= open && reach_here == Reach::kSome;
      ended |= !open;
      if (ended && reach_here == Reach::kNone) return;
      if (loose || ended) r.doubtful += w;
      if (ended) continue;
      Spread(line[i], low, high, w, r);
      weight += w;
    }
  }
  // What the steps of the method may miss until each tap.
  struct Missed {
    // As a distance at the start of the line, as if errors grew as lines near it drift apart.
    std::vector<double> grown;
    // How far at the tap lines are that go on from the ends of the worst steps: across an edge of a pixel
    // they may part from lines that on this side come together.
    std::vector<double> astray;
  };
  // Where a step ended that was to end at tap `number`, counted from 0 for the start.
  struct Strayed {
    double off = 0;
    size_t number = 0;
    Point end;
  };
  // From tap to tap the larger error of its two steps, of fourth and third order; over several taps, wherever
  // such a step would be taken, that of its end and of the cubics between. Nobody knows where steps begin:
  // the worst chain of them counts.
  Missed StepErrors(int x, int y, const std::vector<Point>& line, const std::vector<double>& apart,
                    double sign) const {
    const size_t taps = line.size();
    const double d = Moved();
    std::vector<Point> at{{static_cast<double>(x), static_cast<double>(y)}};
    at.insert(at.end(), line.begin(), line.end());
    std::vector<double> until(taps + 1), worst(taps + 1);
    std::vector<Strayed> strayed;
    const auto growth = [&](size_t i) { return i == 0 ? 1 : apart[i - 1] / d; };
    const auto stray = [&](Point end, size_t number) {
      const double off = std::hypot(end.x - at[number].x, end.y - at[number].y);
      if (off > d) strayed.push_back({off, number, end});
      return off;
    };
    for (size_t j = 0; j < taps; ++j) {
      double missed = 0;
      for (const Point end : StepEnds(at[j], sign)) missed = std::max(missed, stray(end, j + 1));
      const double one = until[j] + missed / growth(j + 1);
      until[j + 1] = std::max(until[j + 1], one);
      for (const size_t n : {2, 4, 5, 8, 10, 16, 20}) {
        if (j + n > taps || n * p_.step > LongestStep()) break;
        const double h = sign * p_.step * static_cast<double>(n);
        const Point v = scene_.Velocity(at[j]), k2 = scene_.Velocity(at[j] + 0.5 * h * v),
                    k3 = scene_.Velocity(at[j] + 0.5 * h * k2), k4 = scene_.Velocity(at[j] + h * k3);
        if (!IsTaken(v, k2, k3, k4)) continue;
        const Point end = at[j] + (h / 6) * (v + 2 * k2 + 2 * k3 + k4), last = scene_.Velocity(end);
        stray(end, j + n);
        for (size_t m = 1; m <= n; ++m) {
          const double t = static_cast<double>(m) / static_cast<double>(n), u = 1 - t;
          const Point cubic = (u * u * (1 + 2 * t)) * at[j] + (t * t * (3 - 2 * t)) * end +
                              (h * t * u * u) * v + (-h * t * t * u) * last;
          const double off = std::hypot(cubic.x - at[j + m].x, cubic.y - at[j + m].y) / growth(j + m);
          double& place = m == n ? until[j + m] : worst[j + m];
          place = std::max(place, until[j] + off);
        }
      }
    }
    Missed missed{std::vector<double>(taps), std::vector<double>(taps)};
    for (size_t i = 0; i < taps; ++i) missed.grown[i] = std::max(until[i + 1], worst[i + 1]);
    FollowStrayed(strayed, line, sign, missed.astray);
    return missed;
  }
  void FollowStrayed(std::vector<Strayed>& strayed, const std::vector<Point>& line, double sign,
                     std::vector<double>& astray) const {
    // A few tell; all would cost as many lines as there are taps.
    const size_t followed = std::min<size_t>(strayed.size(), 12);
    std::partial_sort(strayed.begin(), strayed.begin() + static_cast<std::ptrdiff_t>(followed), strayed.end(),
                      [](const Strayed& a, const Strayed& b) { return a.off > b.off; });
    for (size_t k = 0; k < followed; ++k) {
      const std::vector<Point> other = Follow(scene_, p_, strayed[k].end, sign, Parts());
      for (size_t i = strayed[k].number; i < line.size(); ++i) {
        const Point at = other[i - strayed[k].number];
        astray[i] = std::max(astray[i], std::hypot(at.x - line[i].x, at.y - line[i].y));
      }
    }
  }
  // Whether a step with these stages may be taken: by how much it turns, unevenly or with a bend within.
  bool IsTaken(Point k1, Point k2, Point k3, Point k4) const {
    const double limit = 1.01 * std::min(0.3, 0.15 * std::pow(20 / Length(), 0.25));
    const auto apart = [](Point a, Point b) { return std::hypot(a.x - b.x, a.y - b.y); };
    return apart(k1, k4) <= limit && 2 * apart(k2, k3) <= limit && 8 * apart(k1 + k4, k2 + k3) <= limit;
  }
  // Of shared lines, which pass beside the centres anyway, the steps are those of short ones.
  double Length() const {
    const double length = std::max(1.0, Taps(p_) * p_.step);
    return p_.method == LicMethod::kShared ? std::min(length, 20.0) : length;
  }
  double LongestStep() const { return Length() > 64 ? 2 : Length() > 32 ? 4 : 20; }
  // Where steps to the next tap end, of fourth and of third order: the kernel takes either where the field
  // has kinks. Longer ones it takes only where their errors are smaller.
  std::array<Point, 2> StepEnds(Point from, double sign) const {
    const int parts = Parts();
    const double h = sign * p_.step / parts;
    Point fourth = from, third = from;
    for (int k = 0; k < parts; ++k) {
      const Point k1 = scene_.Velocity(fourth), k2 = scene_.Velocity(fourth + 0.5 * h * k1),
                  k3 = scene_.Velocity(fourth + 0.5 * h * k2), k4 = scene_.Velocity(fourth + h * k3);
      fourth = fourth + (h / 6) * (k1 + 2 * k2 + 2 * k3 + k4);
      const Point a = scene_.Velocity(third), b = scene_.Velocity(third + 0.5 * h * a);
      const Point c = scene_.Velocity(third + (-0.16 * h) * a + (0.96 * h) * b);
      third = third + h * ((5.0 / 24) * a + (4.0 / 9) * b + (25.0 / 72) * c);
    }
    return {fourth, third};
  }
  // Shared lines pass up to half a pixel beside the centre: two and a half times what lines that start there
  // differ by, and seven standard deviations of a mean whose taps each read any of the pixels around.
  void AddSharing(int x, int y, Result& r) const {
    const auto count = static_cast<size_t>(scene_.channels());
    std::vector<double> spread(count), squares(count);
    double weights = Weight(p_, 0);
    const auto deviate = [&](int px, int py, double w) {
      for (size_t c = 0; c < count; ++c) {
        const double own = scene_.Texel(px, py, static_cast<int>(c));
        double sum = 0;
        for (int k = 0; k < 9; ++k) {
          const double other = scene_.Texel(px + k % 3 - 1, py + k / 3 - 1, static_cast<int>(c)) - own;
          sum += other * other / 8;
        }
        squares[c] += w * w * sum;
      }
    };
    deviate(x, y, weights);
    for (int k = -1; k < 8; ++k) {
      const double angle = k * std::numbers::pi / 4, away = k < 0 ? 0 : 0.5;
      const Point off{away * std::cos(angle), away * std::sin(angle)};
      std::vector<double> sum(count);
      double weight = Weight(p_, 0);
      for (size_t c = 0; c < count; ++c) sum[c] = weight * scene_.Texel(x, y, static_cast<int>(c));
      for (const double sign : {1.0, -1.0}) {
        const std::vector<Point> line = From(x, y, off, sign, Parts());
        for (size_t i = 0; i < line.size(); ++i) {
          const int px = Nearest(line[i].x), py = Nearest(line[i].y);
          if (!scene_.Open(px, py)) break;
          const double w = Weight(p_, static_cast<int>(sign * (static_cast<double>(i) + 1)));
          weight += w;
          for (size_t c = 0; c < count; ++c) sum[c] += w * Value(line[i], static_cast<int>(c));
          if (k < 0) deviate(px, py, w), weights += w;
        }
      }
      for (size_t c = 0; c < count && weight > 0; ++c)
        spread[c] = std::max(spread[c], std::fabs(sum[c] / weight - r.value[c]));
    }
    for (size_t c = 0; c < count && weights > 0; ++c) {
      const double range = scene_.range(static_cast<int>(c));
      r.tolerance[c] += std::max(2.5 * spread[c], 7 * std::sqrt(squares[c]) / weights);
      r.undecided |= r.tolerance[c] > 0.5 * range;
      r.tolerance[c] = std::min(r.tolerance[c], 0.5 * range);
    }
  }
  static int Nearest(double v) { return static_cast<int>(std::floor(v + 0.5)); }

  // Which of the pixels that a tap may lie in lines may be at.
  enum class Reach { kAll, kSome, kNone, kAnywhere };
  Reach ReachOf(Point low, Point high) const {
    const int x0 = Nearest(low.x), x1 = Nearest(high.x), y0 = Nearest(low.y), y1 = Nearest(high.y);
    if (!(high.x - low.x < 8 && high.y - low.y < 8)) return Reach::kAnywhere;
    int open = 0;
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) open += scene_.Open(x, y);
    }
    if (open == 0) return Reach::kNone;
    return open == (x1 - x0 + 1) * (y1 - y0 + 1) ? Reach::kAll : Reach::kSome;
  }
  // Adds a tap.
  void Spread(Point at, Point low, Point high, double w, Result& r) const {
    if (ReachOf(low, high) == Reach::kAnywhere) return Take(at, w, r);
    const int x0 = Nearest(low.x), x1 = Nearest(high.x), y0 = Nearest(low.y), y1 = Nearest(high.y);
    for (int c = 0; c < scene_.channels(); ++c) {
      const double own = Value(at, c);
      double off = 0;
      if (p_.linear) {
        double least = own, most = own;
        for (int y = static_cast<int>(std::floor(low.y)); y <= static_cast<int>(std::floor(high.y)) + 1;
             ++y) {
          for (int x = static_cast<int>(std::floor(low.x)); x <= static_cast<int>(std::floor(high.x)) + 1;
               ++x) {
            least = std::min(least, scene_.Texel(x, y, c)), most = std::max(most, scene_.Texel(x, y, c));
          }
        }
        off = (most - least) * std::min(1.0, high.x - low.x + high.y - low.y);
      } else {
        for (int y = y0; y <= y1; ++y) {
          for (int x = x0; x <= x1; ++x) off = std::max(off, std::fabs(scene_.Texel(x, y, c) - own));
        }
      }
      r.tolerance[static_cast<size_t>(c)] += w * off;
    }
    Take(at, w, r);
  }
  void Take(Point at, double w, Result& r) const {
    for (int c = 0; c < scene_.channels() && w != 0; ++c) r.value[static_cast<size_t>(c)] += w * Value(at, c);
  }
  double Value(Point at, int c) const {
    if (!p_.linear || Cells()) return scene_.Texel(Nearest(at.x), Nearest(at.y), c);
    const double fx = std::floor(at.x), fy = std::floor(at.y), tx = at.x - fx, ty = at.y - fy;
    const int x = static_cast<int>(fx), y = static_cast<int>(fy);
    const auto mix = [](double a, double b, double t) { return t == 0 ? a : a + t * (b - a); };
    return mix(mix(scene_.Texel(x, y, c), scene_.Texel(x + 1, y, c), tx),
               mix(scene_.Texel(x, y + 1, c), scene_.Texel(x + 1, y + 1, c), tx), ty);
  }

  const Scene& scene_;
  const LicParams& p_;
};

// The colour of |f|, from 0 to 1.
std::array<double, 3> Color(double t) {
  const double stops[5][3] = {
      {0.16, 0.20, 0.55}, {0.12, 0.46, 0.66}, {0.20, 0.70, 0.50}, {0.70, 0.85, 0.30}, {1.0, 0.93, 0.45}};
  const double at = 4 * t;
  const int i = std::min(3, static_cast<int>(at));
  std::array<double, 3> c{};
  for (size_t k = 0; k < 3; ++k) c[k] = stops[i][k] + (at - i) * (stops[i + 1][k] - stops[i][k]);
  return c;
}

// What deviations from the mean are multiplied by at a pixel.
class Contrast {
 public:
  Contrast(const LicParams& p, const Scene& scene) : p_(p), scene_(scene) {}
  double At(int x, int y) {
    if (p_.contrast != LicContrast::kRescale || scene_.StillOrNot(x, y) == 1) return 1;
    int taps = Taps(p_), spot = p_.with_image ? 1 : p_.spot;
    if (p_.magnitude == LicMagnitude::kLength) taps = static_cast<int>(taps * scene_.Share(x, y));
    if (p_.magnitude == LicMagnitude::kNoise) spot <<= std::min(3, static_cast<int>(4 * scene_.Share(x, y)));
    double& known = known_[{taps, spot}];
    if (known == 0) known = ContrastOf(p_, taps, spot);
    return known;
  }

 private:
  const LicParams& p_;
  const Scene& scene_;
  std::map<std::pair<int, int>, double> known_;
};

void EvaluateLic(const Call& call) {
  const auto& p = std::any_cast<const LicParams&>(call.parameters);
  const Scene scene(p, call);
  const Pixel pixel(scene, p);
  Contrast contrasts(p, scene);
  const double mean = !p.with_image && p.noise == LicNoise::kSparse ? 1.0 / 24 : 0.5;
  const bool colored = p.magnitude == LicMagnitude::kColor;
  const Roi& window = call.out_spec.data_window;
  for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
    call.Check();
    for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
      const int px = x - window.x0, py = y - window.y0;
      const Pixel::Result r = pixel.Convolve(px, py);
      const std::array<double, 3> color = Color(scene.Share(px, py));
      const double contrast = contrasts.At(px, py);
      const bool still_or_not = p.contrast == LicContrast::kRescale && scene.StillOrNot(px, py) == 0.5;
      for (int c = 0; c < call.out.channels; ++c) {
        double value = 0, tolerance = 0, jump = 0;
        if (!r.masked && !p.with_image && c == (colored ? 3 : 1)) {
          value = 1;
        } else if (!r.masked) {
          const size_t k = p.with_image ? static_cast<size_t>(c) : 0;
          value = mean + contrast * (r.value[k] - mean), tolerance = contrast * r.tolerance[k];
          // A tolerance that no picture of this contrast leaves cannot fail: nothing was decided.
          const bool anything = tolerance > 0.5 * scene.range(static_cast<int>(k));
          if (r.undecided || still_or_not || anything) jump = contrast * scene.range(static_cast<int>(k));
          // Of floats: the mean, the factor, their product.
          tolerance += contrast * 4e-7 * (mean + std::fabs(r.value[k]));
          if (contrast == 1) value = r.value[k], tolerance = r.tolerance[k];
          if (colored) {
            const double shade = color[static_cast<size_t>(c)];
            value = shade * (0.25 + 1.5 * value), tolerance = 1.5 * shade * tolerance + 4e-6;
            jump *= 1.5 * shade;
          }
        }
        call.out.at(x, y, c) = value;
        if (jump > 0) call.Undecided(x, y, c, jump);
        if (call.scale != nullptr) call.scale->at(x, y, c) = 0x1p24 * tolerance;
      }
    }
  }
}

void EvaluateEqualize(const Call& call) {
  const ImageD& in = call.in[0];
  for (int c = 0; c < in.channels; ++c) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    const int alpha = call.out_spec.alpha;
    const auto shown = [&](int x, int y) { return alpha < 0 || in.at(x, y, alpha) != 0; };
    const auto each = [&](const std::function<void(double)>& f) {
      for (int y = in.roi.y0; y < in.roi.y1; ++y) {
        for (int x = in.roi.x0; x < in.roi.x1; ++x) {
          if (shown(x, y)) f(in.at(x, y, c));
        }
      }
    };
    each([&](double v) {
      if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
    });
    const auto place = [&](double v) { return high > low ? (v - low) / (high - low) * 65535 : 0.0; };
    const auto number = [&](double v) {
      if (!std::isfinite(v)) return v > 0 ? 65535L : 0L;
      return std::lround(place(v));
    };
    // Whether doubles in another order have it in the next class.
    const auto at_edge = [&](double v) {
      return std::isfinite(v) && std::fabs(place(v) - std::floor(place(v)) - 0.5) < 0x1p-34;
    };
    std::vector<double> count(65536);
    double total = 0, at_edges = 0;
    each([&](double v) {
      if (!std::isnan(v)) count[static_cast<size_t>(number(v))] += 1, total += 1, at_edges += at_edge(v);
    });
    bool exact = true;  // samples that may be off may be in another class
    for (size_t k = 0; !call.tolerances.empty() && k < call.tolerances[0].samples.size(); ++k)
      exact = exact && call.tolerances[0].samples[k] == 0;
    std::vector<double> below(65537);
    for (size_t i = 0; i < 65536; ++i) below[i + 1] = below[i] + count[i];
    for (int y = call.out.roi.y0; y < call.out.roi.y1; ++y) {
      for (int x = call.out.roi.x0; x < call.out.roi.x1; ++x) {
        const double v = in.at(x, y, c);
        const bool same = c == alpha || std::isnan(v) || !shown(x, y);
        const auto i = static_cast<size_t>(same ? 0 : number(v));
        const auto before = i > 0 ? i - 1 : i, after = std::min<size_t>(i + 2, 65536);
        call.out.at(x, y, c) = same ? v : (below[i] + 0.5 * count[i]) / total;
        const double near = same ? 0 : (below[after] - below[before]) / total;
        if (!same && exact && at_edge(v)) call.Undecided(x, y, c, near);
        if (call.scale == nullptr) continue;
        call.scale->at(x, y, c) = same    ? 0x1p-126
                                  : exact ? call.out.at(x, y, c) + 0x1p24 * at_edges / total
                                          : 0x1p24 * (near + 1e-6);
      }
    }
  }
}

// All of every input.
Roi Everything(const std::any&, int, const Roi&) {
  return {INT_MIN / 2, INT_MIN / 2, INT_MAX / 2, INT_MAX / 2};
}

}  // namespace

std::vector<Entry> FlowEntries() {
  return {{"lic", EvaluateLic, Everything}, {"equalize", EvaluateEqualize, Everything}};
}

}  // namespace tessera::reference
