// A brush that is any picture, along a path; with time, puffs that a moving source leaves.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "base/number_text.h"
#include "base/turn.h"
#include "ops/composite/composite_ops.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/outline.h"

namespace tessera {
namespace ops {
namespace {

constexpr double kMostStamps = 100000;

// Where the planes of a brush come from: a channel of it for each of the base's, the coverage's last; -1: one
// everywhere on the brush.
struct BrushPlanes {
  std::vector<int> from;
  std::vector<double> factor;
};

std::string Found(const ImageSpec& spec) {
  return std::to_string(spec.channel_count() - (spec.alpha >= 0 ? 1 : 0)) + " channels" +
         (spec.alpha >= 0 ? " beside alpha" : " without alpha");
}

BrushPlanes PlanesOf(const ImageSpec& base, const ImageSpec& brush, const std::vector<double>& color) {
  const int colors = base.channel_count() - (base.alpha >= 0 ? 1 : 0);
  const bool mask = brush.channel_count() == 1 && (brush.alpha < 0 || colors > 0);
  const int brush_colors = brush.channel_count() - (brush.alpha >= 0 ? 1 : 0);
  if (!mask && brush_colors != colors) {
    throw DataError("paint", "found a brush of " + Found(brush) + " and a base of " + Found(base) +
                                 ", expected as many, or a brush of one channel that is the coverage");
  }
  if (color.size() != 1 && static_cast<int>(color.size()) != colors) {
    throw DataError("paint", "found a color of " + std::to_string(color.size()) +
                                 " numbers, expected one, or one for each of the base's " + Found(base));
  }
  const int coverage = mask ? 0 : brush.alpha;
  BrushPlanes planes;
  for (int c = 0, k = 0, b = 0; c < base.channel_count(); ++c) {
    if (c == base.alpha) {
      planes.from.push_back(coverage), planes.factor.push_back(1);
    } else if (mask) {
      planes.from.push_back(0), planes.factor.push_back(color[color.size() == 1 ? 0 : size_t(k++)]);
    } else {
      if (b == brush.alpha) ++b;
      planes.from.push_back(b++), planes.factor.push_back(1);
    }
  }
  planes.from.push_back(coverage), planes.factor.push_back(1);
  return planes;
}

// Means of 2^l x 2^l pixels of the brush; beyond its edge is nothing. Not cleared: all threads write its
// rows.
struct Level {
  int width, height;
  std::unique_ptr<double[]> samples;  // planes of a pixel side by side
  Level(int w, int h, size_t planes)
      : width(w),
        height(h),
        samples(std::make_unique_for_overwrite<double[]>(static_cast<size_t>(w) * static_cast<size_t>(h) *
                                                         planes)) {}
};

class BrushStage final : public graph::TileStage {
 public:
  BrushStage(const std::vector<Stamp>& stamps, const BrushPlanes& planes, const ConstImageView& brush,
             const graph::Workers& workers)
      : planes_(planes.from.size()), alpha_plane_(planes_ - 1) {
    const Roi& roi = brush.roi;
    Level level(roi.width(), roi.height(), planes_);
    workers.For(roi.height(), [&](int64_t row, int) {
      double* to =
          level.samples.get() + static_cast<size_t>(row) * static_cast<size_t>(roi.width()) * planes_;
      for (int x = roi.x0; x < roi.x1; ++x) {
        const auto* pixel = reinterpret_cast<const float*>(brush.At(x, roi.y0 + static_cast<int>(row)));
        for (size_t p = 0; p < planes_; ++p)
          *to++ = planes.factor[p] * (planes.from[p] < 0 ? 1.0 : pixel[planes.from[p]]);
      }
    });
    levels_.push_back(std::move(level));
    while (std::max(levels_.back().width, levels_.back().height) > 1)
      levels_.push_back(Half(levels_.back(), workers));
    for (const Stamp& s : stamps) prints_.push_back(PrintOf(s));
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    const size_t width = static_cast<size_t>(o.width());
    size_t* const near = args.scratch.Allocate<size_t>(prints_.size() + 1);
    size_t count = 0;
    for (size_t k = 0; k < prints_.size(); ++k) {
      const Print& p = prints_[k];
      if (p.x + p.reach > o.x0 && p.x - p.reach < o.x1 && p.y + p.reach > o.y0 && p.y - p.reach < o.y1)
        near[count++] = k;
    }
    const size_t channels = args.channels.size();
    double* const row = args.scratch.Allocate<double>(width * channels);
    double* const sample = args.scratch.Allocate<double>(planes_);
    const auto& have = args.in_channels[0];
    for (int y = o.y0; y < o.y1; ++y) {
      const auto* base = reinterpret_cast<const float*>(args.in[0].At(o.x0, y));
      for (size_t x = 0; x < width; ++x) {
        for (size_t c = 0; c < channels; ++c) {
          const auto at = std::find(have.begin(), have.end(), args.channels[c]) - have.begin();
          row[x * channels + c] = base[x * have.size() + static_cast<size_t>(at)];
        }
      }
      for (size_t k = 0; k < count; ++k)
        PaintRow(prints_[near[k]], y, o.x0, o.x1, args.channels, sample, row);
      auto* to = reinterpret_cast<float*>(args.out.At(o.x0, y));
      for (size_t i = 0; i < width * channels; ++i) to[i] = static_cast<float>(row[i]);
    }
  }

 private:
  // A stamp as its pixels need it: across(u) = (cosine dx - sine dy) * ratio + half the brush's width.
  struct Print {
    double x, y, cosine, sine, ratio, opacity, reach, part;
    size_t level;  // and the next one by `part`
  };

  Level Half(const Level& from, const graph::Workers& workers) const {
    Level to((from.width + 1) / 2, (from.height + 1) / 2, planes_);
    const auto stride = static_cast<size_t>(to.width) * planes_;
    workers.For(to.height, [&](int64_t row, int) {
      double* const sums = to.samples.get() + static_cast<size_t>(row) * stride;
      std::fill_n(sums, stride, 0.0);
      const int first = 2 * static_cast<int>(row);
      for (int y = first; y < std::min(first + 2, from.height); ++y) {
        for (int x = 0; x < from.width; ++x) {
          const double* const a = &from.samples[(static_cast<size_t>(y) * from.width + x) * planes_];
          double* const b = sums + static_cast<size_t>(x / 2) * planes_;
          for (size_t p = 0; p < planes_; ++p) b[p] += a[p] / 4;
        }
      }
    });
    return to;
  }

  Print PrintOf(const Stamp& s) const {
    const double longer = std::max(levels_[0].width, levels_[0].height), size = std::max(s.size, 1.0);
    const base::Turn turn = base::TurnOf(s.angle);
    const double fade = std::min(s.size, 1.0);
    Print p{s.x, s.y, turn.cosine, turn.sine, longer / size, s.opacity * fade * fade, 0, 0, 0};
    const double level = std::min(std::max(std::log2(p.ratio), 0.0), static_cast<double>(levels_.size() - 1));
    p.level = static_cast<size_t>(level);
    p.part = level - std::floor(level);
    const double beyond = std::exp2(std::ceil(level) + 1);  // a pixel of the coarser level, each side
    p.reach = 0.5 * std::hypot(levels_[0].width + beyond, levels_[0].height + beyond) / p.ratio + 1;
    return p;
  }

  // Adds weight times the level at a place in pixels of the finest.
  void Add(size_t l, double u, double v, double weight, double* sum) const {
    const Level& level = levels_[l];
    const double size = std::exp2(static_cast<double>(l));
    u = u / size - 0.5, v = v / size - 0.5;
    if (!(u > -1 && v > -1 && u < level.width && v < level.height)) return;
    const int x = static_cast<int>(std::floor(u)), y = static_cast<int>(std::floor(v));
    const double fx = u - x, fy = v - y;
    for (int j = std::max(y, 0); j <= std::min(y + 1, level.height - 1); ++j) {
      for (int i = std::max(x, 0); i <= std::min(x + 1, level.width - 1); ++i) {
        const double w = weight * (i == x ? 1 - fx : fx) * (j == y ? 1 - fy : fy);
        const double* const from = &level.samples[(static_cast<size_t>(j) * level.width + i) * planes_];
        for (size_t p = 0; p < planes_; ++p) sum[p] += w * from[p];
      }
    }
  }

  void PaintRow(const Print& p, int y, int x0, int x1, std::span<const int> channels, double* sample,
                double* row) const {
    const double dy = y + 0.5 - p.y, half = p.reach * p.reach - dy * dy;
    if (!(half > 0)) return;
    const double reach = std::sqrt(half), low = std::clamp(p.x - reach, double(x0), double(x1)),
                 high = std::clamp(p.x + reach, low, double(x1));
    for (int x = static_cast<int>(low); x < static_cast<int>(std::ceil(high)); ++x) {
      const double dx = x + 0.5 - p.x;
      const double u = (p.cosine * dx - p.sine * dy) * p.ratio + 0.5 * levels_[0].width,
                   v = (p.sine * dx + p.cosine * dy) * p.ratio + 0.5 * levels_[0].height;
      std::fill_n(sample, planes_, 0.0);
      Add(p.level, u, v, p.opacity * (1 - p.part), sample);
      if (p.part > 0) Add(p.level + 1, u, v, p.opacity * p.part, sample);
      double* const to = row + static_cast<size_t>(x - x0) * channels.size();
      for (size_t c = 0; c < channels.size(); ++c)
        to[c] = sample[static_cast<size_t>(channels[c])] + (1 - sample[alpha_plane_]) * to[c];
    }
  }

  size_t planes_, alpha_plane_;
  std::vector<Level> levels_;
  std::vector<Print> prints_;
};

class BrushOp final : public graph::OpWith<std::pair<std::vector<Stamp>, std::vector<double>>> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "paint"; }
  std::string Describe() const override {
    return "paint of " + std::to_string(params().first.size()) + " stamps";
  }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int k) const override { return k == 1; }
  bool IsIdentity() const override { return params().first.empty(); }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    PlanesOf(inputs[0], inputs[1], params().second);
    return inputs[0];
  }
  std::vector<bool> NeededChannels(int k, const std::vector<bool>& result,
                                   const ImageSpec& in) const override {
    return k == 0 ? result : std::vector<bool>(in.channels.size(), true);
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<BrushStage>(params().first,
                                        PlanesOf(context.inputs[0], context.inputs[1], params().second),
                                        context.whole[1], context.workers);
  }
};

void RequireIn(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw Error("paint", std::string("found ") + name + " " + base::NumberText(value) + ", expected " +
                           base::NumberText(low) + " to " + base::NumberText(high));
}

// The points of a curve that goes through those given.
std::vector<std::array<double, 2>> CatmullRom(const std::vector<std::array<double, 2>>& points) {
  constexpr int kPieces = 32;
  std::vector<std::array<double, 2>> curve = {points.front()};
  for (size_t k = 1; k < points.size(); ++k) {
    const auto &a = points[k > 1 ? k - 2 : 0], &b = points[k - 1], &c = points[k];
    const auto& d = points[std::min(k + 1, points.size() - 1)];
    for (int i = 1; i <= kPieces; ++i) {
      const double t = static_cast<double>(i) / kPieces;
      std::array<double, 2> at;
      for (size_t axis = 0; axis < 2; ++axis) {
        const double p = a[axis], q = b[axis], r = c[axis], s = d[axis];
        at[axis] = q + 0.5 * t * (r - p + t * (2 * p - 5 * q + 4 * r - s + t * (3 * (q - r) + s - p)));
      }
      curve.push_back(at);
    }
  }
  return curve;
}

// In [-1, 1], of a stamp's own: neighbours, or which stamps are there, do not matter.
double Jitter(uint32_t seed, size_t stamp, uint64_t which) {
  uint64_t h = (uint64_t{seed} << 32) + 8 * stamp + which;
  for (const uint64_t factor : {0xBF58476D1CE4E5B9u, 0x94D049BB133111EBu}) {
    h = (h + 0x9E3779B97F4A7C15u) * factor;
    h ^= h >> 29;
    h *= factor;
    h ^= h >> 32;
  }
  return static_cast<double>(h >> 11) * 0x1p-52 - 1;
}

}  // namespace

OpInfo PaintInfo() {
  OpInfo info;
  info.name = "paint";
  info.family = "composite";
  info.inputs = 2;
  info.summary = "Any picture as a brush along a path, or as puffs that a moving source leaves";
  info.help =
      "BASE BRUSH: the brush is stamped along the line or curve through the points path=, every spacing= of its "
      "larger size=, the later over the earlier: p + (1-a) base, premultiplied. A brush without alpha is a "
      "rectangle that covers; one of a single channel is a mask, painted in color=. Two numbers of size= and "
      "opacity= are those of the oldest and the newest stamp: pressure. A size below 1 pixel stays 1 and "
      "fades as its square. jitter= takes up to four: place (in sizes), rotation (degrees), loss of size, loss "
      "of opacity (shares). Trails: by time= a share of the path has been travelled (beyond 1, the source has "
      "stopped), a stamp lives life= of it, and drift= is how far wind takes it meanwhile; size= and opacity= "
      "then are at death and at birth. Small stamps read means of 2^l x 2^l brush pixels, linear between two "
      "l. The brush and those means are held in memory whole. Source: McReynolds et al. 1997, 6.3 and 11.2; Haeberli and Segal 1993, 4.2.";
  info.bound = "2 u of the sum of magnitudes";
  info.bound_u = 2;
  info.modifiers = {
      ListModifier("path", "0,0", 65536, -1e9, 1e9, "points x0,y0,x1,y1,... in pixels"),
      FlagModifier("smooth", "a Catmull-Rom curve through the points"),
      NumberModifier("spacing", "0.25", 1e-3, 1e6, "between stamps, in parts of the larger size"),
      ListModifier("size", "32", 2, 0, 1e6, "of the brush's longer side, pixels: oldest, newest"),
      ListModifier("opacity", "1", 2, 0, 1, "oldest, newest"),
      NumberModifier("rotation", "0", -1e6, 1e6, "degrees, counter-clockwise as seen"),
      FlagModifier("follow", "turned as the path is, besides"),
      ListModifier("jitter", "0", 4, 0, 1e6, "place, rotation, size, opacity; the last two at most 1"),
      IntegerModifier("seed", "0", 0, 4294967295.0, "of jitter"),
      NumberModifier("time", "1", 0, 1e6, "share of the path that was travelled"),
      NumberModifier("life", "1", 1e-6, 1e6, "of a stamp, in shares of the path"),
      ListModifier("drift", "0,0", 2, -1e9, 1e9, "x,y in pixels, over a stamp's life"),
      ListModifier("color", "1", 64, -1e9, 1e9, "of a brush that is a mask: one number, or one per channel")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const auto at = [&](const char* name, size_t i) {
      const std::vector<double>& n = a.Numbers(name);
      return n[std::min(i, n.size() - 1)];
    };
    const auto jitter = [&](size_t i) { return i < a.Numbers("jitter").size() ? a.Numbers("jitter")[i] : 0; };
    const std::vector<double>& n = a.Numbers("path");
    if (n.size() % 2 != 0)
      throw Error("paint", "found an odd number of coordinates in path, expected pairs x,y");
    StampPathParams p;
    p.path.clear();
    for (size_t i = 0; i < n.size(); i += 2) p.path.push_back({n[i], n[i + 1]});
    p.smooth = a.Flag("smooth"), p.spacing = a.Number("spacing");
    p.size = {at("size", 0), at("size", 1)}, p.opacity = {at("opacity", 0), at("opacity", 1)};
    p.rotation = a.Number("rotation"), p.follow = a.Flag("follow");
    p.time = a.Number("time"), p.life = a.Number("life"), p.drift = {at("drift", 0), at("drift", 1)};
    p.jitter_place = jitter(0), p.jitter_rotation = jitter(1);
    p.jitter_size = jitter(2), p.jitter_opacity = jitter(3);
    p.seed = static_cast<uint32_t>(a.Number("seed"));
    return Paint(in[0], in[1], StampsAlong(p), a.Numbers("color"));
  };
  info.examples = {
      "path=4,6,40,20,30,5 size=20 opacity=0.6",
      "path=0,0,20,25,50,10 smooth=1 spacing=0.4 size=4,24 follow=1 jitter=0.3,40,0.5,0.5 seed=3",
      "path=5,20,45,8 size=30,6 opacity=0,0.7 time=1.2 life=0.8 drift=5,-12 rotation=30"};
  return info;
}

}  // namespace ops

std::vector<Stamp> StampsAlong(const StampPathParams& p) {
  constexpr double kFar = 1e9;
  if (p.path.empty()) throw Error("paint", "found no points, expected a path of at least one");
  for (const auto& point : p.path)
    for (const double v : point) ops::RequireIn("a coordinate of path", v, -kFar, kFar);
  ops::RequireIn("spacing", p.spacing, 1e-3, 1e6);
  ops::RequireIn("rotation", p.rotation, -1e6, 1e6);
  ops::RequireIn("time", p.time, 0, 1e6);
  ops::RequireIn("life", p.life, 1e-6, 1e6);
  for (size_t i = 0; i < 2; ++i) {
    ops::RequireIn("size", p.size[i], 0, 1e6), ops::RequireIn("opacity", p.opacity[i], 0, 1);
    ops::RequireIn("drift", p.drift[i], -kFar, kFar);
  }
  ops::RequireIn("jitter of place", p.jitter_place, 0, 1e6);
  ops::RequireIn("jitter of rotation", p.jitter_rotation, 0, 1e6);
  ops::RequireIn("jitter of size", p.jitter_size, 0, 1),
      ops::RequireIn("jitter of opacity", p.jitter_opacity, 0, 1);

  const std::vector<std::array<double, 2>> line = p.smooth ? ops::CatmullRom(p.path) : p.path;
  std::vector<double> until = {0};  // the length up to each point
  for (size_t k = 1; k < line.size(); ++k)
    until.push_back(until.back() + std::hypot(line[k][0] - line[k - 1][0], line[k][1] - line[k - 1][1]));
  const double length = until.back(), step = p.spacing * std::max({p.size[0], p.size[1], 0x1p-20});
  if (length / step >= ops::kMostStamps) {
    throw Error("paint", "found " + base::NumberText(std::floor(length / step) + 1) +
                             " stamps on the path, expected at most 100000: a larger spacing or size");
  }
  std::vector<Stamp> stamps;
  size_t piece = 1;
  for (size_t k = 0; k <= static_cast<size_t>(length / step); ++k) {
    const double along = static_cast<double>(k) * step, born = length > 0 ? along / length : 1;
    while (piece + 1 < line.size() && until[piece] < along) ++piece;
    const double youth = 1 - (p.time - born) / p.life;
    if (!(youth >= 0 && youth <= 1)) continue;
    Stamp s;
    s.x = line[0][0], s.y = line[0][1], s.angle = p.rotation;
    if (length > 0) {
      const auto [ax, ay] = line[piece - 1];
      const auto [bx, by] = line[piece];
      const double t = (along - until[piece - 1]) / std::max(until[piece] - until[piece - 1], 1e-300);
      s.x = ax + (bx - ax) * t, s.y = ay + (by - ay) * t;
      if (p.follow) s.angle += std::atan2(ay - by, bx - ax) * 180 / std::numbers::pi;
    }
    const auto jitter = [&](uint64_t which) { return ops::Jitter(p.seed, k, which); };
    const auto between = [&](const std::array<double, 2>& v) { return v[0] + (v[1] - v[0]) * youth; };
    s.size = between(p.size) * (1 - p.jitter_size * (0.5 + 0.5 * jitter(2)));
    s.opacity = between(p.opacity) * (1 - p.jitter_opacity * (0.5 + 0.5 * jitter(3)));
    s.angle += p.jitter_rotation * jitter(1);
    s.x += p.drift[0] * (1 - youth) + p.jitter_place * s.size * jitter(0);
    s.y += p.drift[1] * (1 - youth) + p.jitter_place * s.size * jitter(4);
    if (s.size > 0 && s.opacity > 0) stamps.push_back(s);
  }
  return stamps;
}

Node Paint(const Node& base, const Node& brush, const std::vector<Stamp>& stamps,
           const std::vector<double>& color) {
  for (const Stamp& s : stamps) {
    ops::RequireIn("x of a stamp", s.x, -4e9, 4e9), ops::RequireIn("y of a stamp", s.y, -4e9, 4e9);
    ops::RequireIn("size of a stamp", s.size, 0, 1e6), ops::RequireIn("opacity of a stamp", s.opacity, 0, 1);
    ops::RequireIn("angle of a stamp", s.angle, -1e9, 1e9);
  }
  return graph::MakeNode(std::make_shared<const ops::BrushOp>(std::pair(stamps, color)), {base, brush});
}

}  // namespace tessera
