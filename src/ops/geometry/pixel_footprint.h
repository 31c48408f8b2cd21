// What a pixel covers of the space that its coordinates are in (a table, a solid, directions), by those of
// its neighbours, and the look-ups whose mean that is. doc/maths/lookup.md, "Footprints".
#ifndef TESSERA_OPS_GEOMETRY_PIXEL_FOOTPRINT_H_
#define TESSERA_OPS_GEOMETRY_PIXEL_FOOTPRINT_H_

#include <algorithm>
#include <cmath>

#include "tessera/camera.h"

namespace tessera::ops {

inline constexpr int kMostAnisotropy = 64;

// Squares of an ellipse's half axes, neither shorter than `least` nor further apart than `anisotropy`;
// `most`: where wider is no different.
struct FootprintAxes {
  double longer, shorter;
  FootprintAxes(double longer_square, double shorter_square, double least, double most, int anisotropy) {
    const double ratio = double{1} * anisotropy * anisotropy;
    longer = std::max(std::min(longer_square, most * most * ratio), least * least);
    shorter = std::max({std::min(shorter_square, most * most), least * least, longer / ratio});
  }
};

// Look-ups along a length for each `width` of it. A little more than a whole number is that number.
inline int ProbeCount(double length, double width, int most) {
  return static_cast<int>(std::clamp<double>(std::ceil(length / width - 0x1p-20), 1, most));
}

// A pixel's coordinates less those of the one before, or the next one's less its own.
struct FootprintSide {
  Vector3 step = {};
  double square = 0;  // of its length; infinite where there is no neighbour that counts

  static FootprintSide None();
  static FootprintSide Of(const Vector3& step);  // None where it is no number
};
// The step from pixel to pixel: each side's, weighted by the other's square, so that the far side of an edge
// hardly counts; one that turns back counts as if it went on.
Vector3 StepBetween(const FootprintSide& before, const FootprintSide& after);

// The image of a pixel's unit circle by its steps across and down.
struct PixelFootprint {
  Vector3 major, minor;    // half axes
  double longer, shorter;  // squares of their lengths
  static PixelFootprint Of(const Vector3& across, const Vector3& down);
};

enum class ProbeFilter { kTrilinear, kEwa };

// A grid of look-ups over a footprint, about its middle.
struct ProbeGrid {
  int along = 1, across = 1;
  double width = 0;                 // what one stands for
  Vector3 step_along, step_across;  // from one to the next
  bool bell = false;                // weights fall off towards the rim

  // `texel`: as wide as the space's finest look-ups; `widest`: where wider is no different. One look-up where
  // the footprint is no longer than a texel.
  static ProbeGrid Of(const PixelFootprint& footprint, ProbeFilter filter, int anisotropy, double texel,
                      double widest);
  int count() const { return along * across; }

  // visit(place, weight) of each that has weight.
  template <class F>
  void ForEach(const F& visit) const {
    // exp(-2 x^2) at places x evenly apart: each by a factor of the one before, which itself falls by one.
    double fall = bell ? std::exp(-2 * Square(1 - 1.0 / along)) : 1;
    double rise = bell ? std::exp((8 - 16.0 / along) / along) : 1;
    const double bend = bell ? std::exp(-16 / Square(along)) : 1;
    for (int i = 0; i < along; ++i, fall *= rise, rise *= bend) {
      const double a = 0.5 * (2 * i + 1 - along);
      for (int j = 0; j < across; ++j) {
        // exp(-2 r^2) - exp(-2), nothing beyond the rim.
        const double weight = bell ? fall * kFallAcross[j] - 0.1353352832366127 : 1;
        if (!(weight > 0)) continue;
        const double b = 0.5 * (2 * j + 1 - across);
        visit(Vector3{a * step_along[0] + b * step_across[0], a * step_along[1] + b * step_across[1],
                      a * step_along[2] + b * step_across[2]},
              weight);
      }
    }
  }

  // Across an ellipse: so many look-ups, each as wide as a fifth of it.
  static constexpr int kAcross = 5;

 private:
  static double Square(double x) { return x * x; }
  // exp(-2 x^2) at 0.8, 0.4 and 0.
  static constexpr double kFallAcross[kAcross] = {0.27803730045319414, 0.7261490370736909, 1,
                                                  0.7261490370736909, 0.27803730045319414};
};

// The look-ups of a pixel.
struct PixelProbes {
  bool plain = true;  // the one that is there
  ProbeGrid grid;
  double at[3] = {};  // about this place
  int level = 0;
  double next = 0;  // share of the level after it
};

// Replaces kTexel floats of each pixel of a run that needs more than one look-up, up to kRun of them at a
// time: put(slot, at, place) says where one is, look(level, held) has the results of those held. A pixel's
// sum is in the order of levels, then of look-ups, whatever pixels are beside it.
template <int kRun, int kTexel, class Put, class Look>
void GatherProbes(const PixelProbes* probes, int count, float* result, const Put& put, const Look& look) {
  struct Sum {
    double value[kTexel], weight;
  };
  Sum sums[kRun] = {};
  int first = 1 << 20, last = -1;
  for (int i = 0; i < count; ++i) {
    if (probes[i].plain) continue;
    first = std::min(first, probes[i].level);
    last = std::max(last, probes[i].level + (probes[i].next > 0 ? 1 : 0));
  }
  int owner[kRun];
  double weight[kRun];
  for (int level = first; level <= last; ++level) {
    int held = 0;
    const auto flush = [&] {
      const float* const found = look(level, held);
      for (int k = 0; k < held; ++k) {
        Sum& sum = sums[owner[k]];
        for (int c = 0; c < kTexel; ++c) sum.value[c] += weight[k] * found[k * kTexel + c];
        sum.weight += weight[k];
      }
      held = 0;
    };
    for (int i = 0; i < count; ++i) {
      const PixelProbes& p = probes[i];
      const double share = p.level == level ? 1 - p.next : p.level + 1 == level ? p.next : 0;
      if (p.plain || !(share > 0)) continue;
      p.grid.ForEach([&](const Vector3& place, double w) {
        put(held, p.at, place);
        owner[held] = i, weight[held] = share * w;
        if (++held == kRun) flush();
      });
    }
    if (held > 0) flush();
  }
  for (int i = 0; i < count; ++i) {
    if (probes[i].plain) continue;
    for (int c = 0; c < kTexel; ++c)
      result[i * kTexel + c] = static_cast<float>(sums[i].value[c] / sums[i].weight);
  }
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_PIXEL_FOOTPRINT_H_
