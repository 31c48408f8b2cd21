// Reference of volume pictures: scenes of several volumes, and what a result is uncertain by.
#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <vector>

#include "model/volume_settings.h"
#include "reference/reference.h"
#include "reference/volume_picture.h"

namespace tessera::reference {
namespace {

using volume::Colored;
using volume::kChannels;
using volume::kEndless;
using volume::kMissed;
using volume::Picture;
using volume::Ray;
using volume::Result;
using volume::VolumeDraw;

// The pictures of one scene: the nearest surface, and all media on one lattice before it.
class Scene {
 public:
  explicit Scene(const VolumeDraw& draw) {
    Add(draw);
    for (const auto& other : draw.others) Add(*other);
  }
  double brightest() const { return brightest_; }
  double termination() const { return termination_; }
  size_t moves() const { return moves_[0].size(); }

  // Moved by a share of the m-th of the moves; -1: not moved.
  Result Draw(double x, double y, double scene, int m, double share = 1) const {
    const auto moved = [&](size_t k) {
      return m < 0 ? Vector3{0, 0, 0} : reference::Add({}, moves_[k][static_cast<size_t>(m)], share);
    };
    if (pictures_.size() == 1) return pictures_[0].Draw(x, y, scene, moved(0));
    Result surface = Colored(0, 0, 0, 0);
    for (size_t k = 0; k < pictures_.size(); ++k) {
      if (!pictures_[k].IsSurface()) continue;
      const Result r = pictures_[k].Draw(x, y, scene, moved(k));
      if (r[4] < surface[4]) surface = r;
    }
    std::vector<size_t> media;
    std::vector<Ray> rays;
    double enter = kEndless, begin = kEndless, end = -kEndless, spacing = kEndless;
    for (size_t k = 0; k < pictures_.size(); ++k) {
      if (pictures_[k].IsSurface()) continue;
      spacing = std::min(spacing, pictures_[k].step());
      const Ray ray = pictures_[k].RayOf(x, y, surface[4] < scene ? surface[4] : scene, moved(k));
      if (ray.misses) continue;
      enter = std::min(enter, ray.enter), begin = std::min(begin, ray.begin), end = std::max(end, ray.end);
      media.push_back(k);
      rays.push_back(ray);
    }
    if (media.empty()) return surface;
    const double world = Length(rays[0].direction), step = spacing / world, base = enter + 0.5 * step;
    Result sum = Colored(0, 0, 0, 0);
    const auto first = static_cast<int64_t>(std::max(0.0, std::floor((begin - base) / step + 0.5)));
    for (int64_t i = first;; ++i) {
      const double t = base + static_cast<double>(i) * step;
      if (t - 0.5 * step >= end) break;
      std::array<double, 5> all = {0, 0, 0, 0, 0};
      for (size_t k = 0; k < media.size(); ++k) {
        const Ray& ray = rays[k];
        const double share = (std::min(t + 0.5 * step, ray.end) - std::max(t - 0.5 * step, ray.begin)) / step;
        if (share <= 0) continue;
        const std::array<double, 5> c = pictures_[media[k]].Light(ray, t, 0.5 * step);
        for (const size_t n : {0, 1, 2, 4}) all[n] += share * c[3] * c[n];
        all[3] += share * c[3];
      }
      if (all[3] <= 0) continue;
      const double weight = (1 - sum[3]) * -std::expm1(-all[3] * step * world);
      for (size_t n = 0; n < 3; ++n) sum[n] += weight * all[n] / all[3];
      sum[3] += weight;
      sum[kMissed] += weight * all[4] / all[3];
      if (std::fabs(sum[3] - 0.5) < volume::kTie) sum[volume::kDoubt] = 1;
      if (sum[3] >= 0.5 && sum[4] == kEndless) sum[4] = t;
    }
    if (sum[4] < kEndless) {  // of a medium alone; several have none
      const Vector3 p = reference::Add(rays[0].origin, rays[0].direction, sum[4]);
      pictures_[media[0]].AddAovs(rays[0], sum[4], pictures_[media[0]].OutwardAt(p), sum);
    }
    const double through = 1 - sum[3];
    for (size_t n = 0; n < 4; ++n) sum[n] += through * surface[n];
    sum[kMissed] += through * surface[kMissed];
    if (through > 0) sum[volume::kDoubt] = std::max(sum[volume::kDoubt], surface[volume::kDoubt]);
    if (surface[4] < sum[4]) std::copy(surface.begin() + 4, surface.begin() + kChannels, sum.begin() + 4);
    return sum;
  }

 private:
  void Add(const VolumeDraw& draw) {
    pictures_.emplace_back(draw);  // a deque: pictures refer to their own parts
    moves_.push_back(pictures_.back().Moves());
    brightest_ = std::max(brightest_, pictures_.back().Brightest());
    if (pictures_.back().EndsEarly()) termination_ = std::max(termination_, draw.params.termination);
  }

  std::deque<Picture> pictures_;
  std::vector<std::vector<Vector3>> moves_;
  double brightest_ = 1, termination_ = 0;
};

// What a result does where the ray is moved by what the float kernel's position is uncertain by: its slope,
// or a jump where something else is hit, or nothing.
class Responses {
 public:
  Responses(const Scene& scene, double x, double y, double depth, const Result& own)
      : scene_(scene), x_(x), y_(y), depth_(depth), own_(own) {
    for (size_t m = 0; m < scene.moves(); ++m) Try(static_cast<int>(m));
  }
  double slope(size_t c) const { return slope_[c]; }
  double jump(size_t c) const { return jump_[c]; }

 private:
  static constexpr double kFine = 8;

  void Try(int m) {
    const Result moved = scene_.Draw(x_, y_, depth_, m);
    Result fine = moved;
    bool tried = false;
    for (size_t c = 0; c < kChannels; ++c) {
      if (moved[c] == own_[c]) continue;
      const double change = std::fabs(moved[c] - own_[c]);
      if (!std::isfinite(change)) {
        jump_[c] = kEndlessJump;
        continue;
      }
      if (change < 1e-4) {
        slope_[c] = std::max(slope_[c], change);
        continue;
      }
      if (!tried) fine = scene_.Draw(x_, y_, depth_, m, 1 / kFine), tried = true;
      // A slope gives an eighth, a silhouette's square root a third; a jump all or nothing.
      const double part = std::fabs(fine[c] - own_[c]) / change;
      if (part > 0.6 || part < 1 / (4 * kFine)) {
        jump_[c] = std::max(jump_[c], change);
      } else {
        slope_[c] = std::max(slope_[c], change);
      }
    }
  }

  const Scene& scene_;
  const double x_, y_, depth_;
  const Result& own_;
  std::array<double, kChannels> slope_ = {}, jump_ = {};
};

void Evaluate(const Call& call) {
  const VolumeDraw& draw = *std::any_cast<const ops::volume::VolumeDrawPointer&>(call.parameters);
  const Scene scene(draw);
  const Roi& roi = call.out.roi;
  constexpr double kBound = 168 * 0x1p-24;  // the row's
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      const double depth = draw.with_scene ? call.in[0].at(x, y, 0) : kEndless;
      const Result r = scene.Draw(x, y, depth, -1);
      for (int c = 0; c < call.out.channels; ++c) call.out.at(x, y, c) = r[static_cast<size_t>(c)];
      if (call.scale == nullptr) continue;
      const Responses responses(scene, x, y, depth, r);
      // Rays that end early leave out what would come after; others leave out nothing.
      const double beyond = std::max(0.0, r[3] - (1 - scene.termination()) + 1e-5);
      const double left_out = scene.termination() > 0 ? std::min(beyond, scene.termination()) : 0;
      const double ends = left_out * scene.brightest() + 1.01 * r[kMissed];
      for (int c = 0; c < call.out.channels; ++c) {
        const auto k = static_cast<size_t>(c);
        call.scale->at(x, y, c) = std::max(1.0, std::fabs(r[k])) + (responses.slope(k) + ends) / kBound;
        if (r[volume::kDoubt] > (c < 4 ? 1 : 0)) call.Undecided(x, y, c, c < 4 ? kUnknownJump : kEndlessJump);
        if (responses.jump(k) > 0) call.Undecided(x, y, c, responses.jump(k));
      }
    }
  }
}

}  // namespace

std::vector<Entry> VolumeEntries() { return {{"volume", Evaluate}}; }

}  // namespace tessera::reference
