// Responses to moved inputs: slopes where they scale with the move, jumps where they do not.
#include "verify/propagate.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace tessera::verify {
namespace {

using reference::ImageD;
using reference::kEndlessJump;
using reference::kUnknownJump;

// Inputs are moved by twice what they may be off, so that a decision on several of them is found when one
// moves at a time, and by an eighth of that to see whether the response scales.
constexpr double kMove = 2, kFine = 8;
// A response that is this share of the largest value may be more than a slope.
constexpr double kMuch = 0x1p-10;

// The sign of a sample in a set of signs.
enum class Signs : uint8_t {
  kSame,       // all samples in one direction: whatever adds up
  kByChannel,  // every other channel the other way: differences of channels
  kByPlace,    // by chance: errors that know nothing of each other
  kByValue,    // by chance, equal for equal samples: patterns and areas of few values
};

struct SignSet {
  Signs signs;
  uint32_t seed;
};

uint32_t Mixed(uint32_t v) {
  v = (v ^ v >> 16) * 0x7FEB352Du;
  v = (v ^ v >> 15) * 0x846CA68Bu;
  return v ^ v >> 16;
}

double SignOf(const SignSet& set, int x, int y, int c, double value) {
  switch (set.signs) {
    case Signs::kSame:
      return 1;
    case Signs::kByChannel:
      return c % 2 == 0 ? 1 : -1;
    case Signs::kByPlace: {
      const uint32_t place = Mixed(static_cast<uint32_t>(x) * 0x9E3779B1u + set.seed) ^
                             Mixed(static_cast<uint32_t>(y) * 0x85EBCA77u + static_cast<uint32_t>(c));
      return (Mixed(place) & 1) != 0 ? 1 : -1;
    }
    case Signs::kByValue: {
      uint64_t bits;
      std::memcpy(&bits, &value, sizeof bits);
      return (Mixed(static_cast<uint32_t>(bits ^ bits >> 32) + set.seed) & 1) != 0 ? 1 : -1;
    }
  }
  return 1;
}

// Calls f(x, y, c) for every sample.
template <typename F>
void ForEachSample(const ImageD& image, const F& f) {
  for (int y = image.roi.y0; y < image.roi.y1; ++y) {
    for (int x = image.roi.x0; x < image.roi.x1; ++x) {
      for (int c = 0; c < image.channels; ++c) f(x, y, c);
    }
  }
}

void AddJump(Evaluated& out, size_t i, double jump) {
  if (out.jump.samples.empty()) out.jump = ImageD(out.value.roi, out.value.channels);
  double& most = out.jump.samples[i];
  most = std::max(most, jump) == kEndlessJump ? kEndlessJump : std::min(kUnknownJump, most + jump);
}

class Responses {
 public:
  Responses(const Operation& operation, std::span<const Evaluated> in, size_t k, Evaluated& out)
      : operation_(operation), moved_(in[k]), k_(k), out_(out), own_(out.tolerance) {
    for (const Evaluated& e : in) values_.push_back(e.value);
  }

  // The change of the result where samples of channel `only` (all for -1) move by sign * factor * amount.
  // NaN where one side is no number.
  std::vector<double> Change(const ImageD& amount, int only, const SignSet& set, double factor) {
    ImageD& input = values_[k_];
    ForEachSample(input, [&](int x, int y, int c) {
      const double by = only < 0 || c == only ? amount.at(x, y, c) : 0;
      if (!(by > 0)) return;
      double& sample = input.at(x, y, c);
      // What is infinite by a decision may be anything else by another.
      if (!std::isfinite(sample) && std::isfinite(by)) sample = 0;
      sample += factor * by * SignOf(set, x, y, c, moved_.value.at(x, y, c));
    });
    ImageD response(out_.value.roi, out_.value.channels);
    operation_.evaluate(values_, response);
    input.samples = moved_.value.samples;
    std::vector<double>& change = response.samples;
    for (size_t i = 0; i < change.size(); ++i) {
      const double before = out_.value.samples[i], after = change[i];
      const bool same = before == after || (std::isnan(before) && std::isnan(after));
      change[i] = same ? 0 : after - before;
      if (!same && !std::isfinite(change[i])) change[i] = std::numeric_limits<double>::quiet_NaN();
    }
    return change;
  }

  // One sample or channel at a time, either way; the effects of all add up. Exact to first order.
  void AddEach() {
    const int channels = moved_.value.channels;
    for (int c = operation_.separate_channels ? -1 : 0; c < (operation_.separate_channels ? 0 : channels);
         ++c) {
      if (!Any(moved_.tolerance, c)) continue;
      const std::vector<double> slope = Slopes(c, {Signs::kSame, 0});
      for (size_t i = 0; i < slope.size(); ++i) out_.tolerance.samples[i] += slope[i];
    }
  }

  // Sets of signs for all samples together. Of those by chance the spread is taken, and four times that.
  void AddSets(bool linear) {
    if (!Any(moved_.tolerance, -1)) return;
    const size_t count = out_.value.samples.size();
    std::vector<double> largest(count), squares(count);
    const std::vector<SignSet> all = {{Signs::kSame, 0},     {Signs::kByPlace, 11}, {Signs::kByPlace, 57},
                                      {Signs::kByPlace, 91}, {Signs::kByValue, 17}, {Signs::kByPlace, 23},
                                      {Signs::kByValue, 71}, {Signs::kByChannel, 0}};
    const size_t sets = linear ? 5 : all.size();
    int by_chance = 0;
    for (size_t s = 0; s < sets; ++s) {
      if (all[s].signs == Signs::kByChannel && moved_.value.channels == 1) continue;
      const std::vector<double> slope = linear ? Straight(all[s]) : Slopes(-1, all[s]);
      const bool place = all[s].signs == Signs::kByPlace;
      by_chance += place;
      for (size_t i = 0; i < count; ++i) {
        largest[i] = std::max(largest[i], slope[i]);
        if (place) squares[i] += slope[i] * slope[i];
      }
    }
    const std::vector<double> near = LargestNear(squares);
    for (size_t i = 0; i < count; ++i) {
      out_.tolerance.samples[i] += std::max(largest[i], 4 * std::sqrt(near[i] / by_chance));
    }
  }

  // What all inputs do at once and none alone: products of errors, which are all there is where both factors
  // are 0.
  void AddTogether(std::span<const Evaluated> in) {
    for (size_t k = 0; k < in.size(); ++k) {
      for (size_t i = 0; i < values_[k].samples.size() && !in[k].tolerance.samples.empty(); ++i)
        values_[k].samples[i] += in[k].tolerance.samples[i];
    }
    ImageD response(out_.value.roi, out_.value.channels);
    operation_.evaluate(values_, response);
    for (size_t i = 0; i < response.samples.size(); ++i) {
      const double change = std::fabs(response.samples[i] - out_.value.samples[i]);
      const bool decided = out_.jump.samples.empty() || out_.jump.samples[i] == 0;
      if (decided && std::isfinite(change))
        out_.tolerance.samples[i] = std::max(out_.tolerance.samples[i], change);
    }
    for (size_t k = 0; k < in.size(); ++k) values_[k].samples = in[k].value.samples;
  }

  // What undecided samples would change.
  void AddJumps() {
    if (moved_.jump.samples.empty()) return;
    ImageD known = moved_.jump, unknown = moved_.jump, endless = moved_.jump;
    double size = 1;
    for (const double v : moved_.value.samples) {
      if (std::isfinite(v)) size = std::max(size, std::fabs(v));
    }
    for (size_t i = 0; i < known.samples.size(); ++i) {
      const bool measured = known.samples[i] < kUnknownJump;
      unknown.samples[i] = measured ? 0 : size;
      if (!measured) known.samples[i] = 0;
      if (endless.samples[i] < kEndlessJump) endless.samples[i] = 0;
    }
    // Of differences a set by chance misses one in two, in eight where there are three.
    const SignSet sets[] = {{Signs::kSame, 0},
                            {Signs::kByPlace, 5},
                            {Signs::kByPlace, 29},
                            {Signs::kByPlace, 63},
                            {Signs::kByPlace, 101}};
    std::vector<double> largest(out_.value.samples.size()), any = largest;
    for (const SignSet& set : sets) {
      for (const double side : {1.0, -1.0}) {
        if (Any(known, -1)) Largest(Change(known, -1, set, side), largest);
        if (Any(unknown, -1)) Largest(Change(unknown, -1, set, side), any);
      }
    }
    for (const double side : {1.0, -1.0}) {
      if (Any(endless, -1)) Largest(Change(endless, -1, {Signs::kSame, 0}, side), any);
    }
    for (size_t i = 0; i < largest.size(); ++i) {
      if (std::max(any[i], largest[i]) == kEndlessJump) {
        AddJump(out_, i, kEndlessJump);
      } else if (any[i] > out_.tolerance.samples[i]) {
        AddJump(out_, i, kUnknownJump);
      } else if (largest[i] + any[i] > 0) {
        AddJump(out_, i, largest[i] + any[i]);
      }
    }
  }

 private:
  static bool Any(const ImageD& amount, int only) {
    for (size_t i = only < 0 ? 0 : static_cast<size_t>(only); i < amount.samples.size();
         i += only < 0 ? 1 : static_cast<size_t>(amount.channels)) {
      if (amount.samples[i] > 0) return true;
    }
    return false;
  }

  static void Largest(const std::vector<double>& change, std::vector<double>& largest) {
    for (size_t i = 0; i < change.size(); ++i) {
      largest[i] = std::max(largest[i], std::isnan(change[i]) ? kEndlessJump : std::fabs(change[i]));
    }
  }

  // The response of a weighted sum: it scales, and one direction is as good as the other.
  std::vector<double> Straight(const SignSet& set) {
    std::vector<double> change = Change(moved_.tolerance, -1, set, 1);
    for (double& v : change) v = std::isnan(v) ? 0 : std::fabs(v);  // not finite anyway: nothing to bound
    return change;
  }

  // The larger response to moves either way by the tolerance; jumps go to out.jump and leave no slope.
  std::vector<double> Slopes(int channel, const SignSet& set) {
    const std::vector<double> up = Change(moved_.tolerance, channel, set, kMove);
    const std::vector<double> down = Change(moved_.tolerance, channel, set, -kMove);
    std::vector<double> slope(up.size());
    std::vector<size_t> doubtful, large;
    const double much = kMuch * LargestOf(out_.value.samples);
    for (size_t i = 0; i < up.size(); ++i) {
      const double a = std::fabs(up[i]), b = std::fabs(down[i]), larger = std::max(a, b);
      // A response to either side that is as large and opposite is a slope, unless it is as much as both ends
      // of a clamp leave.
      if (std::fabs(up[i] + down[i]) <= 0.5 * larger) {
        slope[i] = larger / kMove;
        if (larger > much && larger > own_.samples[i]) large.push_back(i);
      } else if (larger <= own_.samples[i]) {
        slope[i] = larger;  // whatever it is, it does not matter
      } else {
        doubtful.push_back(i);
      }
    }
    if (doubtful.empty() && large.empty()) return slope;
    const std::vector<double> fine_up = Change(moved_.tolerance, channel, set, kMove / kFine);
    const std::vector<double> fine_down = Change(moved_.tolerance, channel, set, -kMove / kFine);
    for (const size_t i : large) {
      if (!Scales(up[i], fine_up[i]) || !Scales(down[i], fine_down[i])) doubtful.push_back(i);
    }
    for (const size_t i : doubtful) {
      slope[i] = std::max(Doubtful(i, up[i], fine_up[i]), Doubtful(i, down[i], fine_down[i]));
    }
    return slope;
  }

  static double LargestOf(const std::vector<double>& values) {
    double largest = 0;
    for (const double v : values) largest = std::isfinite(v) ? std::max(largest, std::fabs(v)) : largest;
    return largest;
  }

  // Whether the fine move's response is its share of the whole one's.
  static bool Scales(double whole, double fine) {
    return std::fabs(whole - kFine * fine) <= 0.5 * std::fabs(whole);
  }

  // One side's response at the whole and at the fine move.
  double Doubtful(size_t i, double whole, double fine) {
    if (std::isnan(whole) || std::isnan(fine)) {
      AddJump(out_, i, kEndlessJump);
      return 0;
    }
    const double w = std::fabs(whole), f = std::fabs(fine);
    if (w <= 16 * own_.samples[i] || w <= 1e-12 * std::fabs(out_.value.samples[i])) return w;
    if (w > 32 * kFine * f) {  // it happened between the two
      AddJump(out_, i, w);
      return f * kFine / kMove;
    }
    if (w < 1.5 * f) {  // and here before the fine one: a step, or a slope without end
      AddJump(out_, i, w);
      return 0;
    }
    return w;
  }

  // The largest of a sample and its eight neighbours: slopes hardly differ, and chance evens out.
  std::vector<double> LargestNear(const std::vector<double>& values) const {
    const Roi& r = out_.value.roi;
    const int channels = out_.value.channels, width = r.width(), height = r.height();
    std::vector<double> largest = values;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < channels; ++c) {
          double& most = largest[(static_cast<size_t>(y) * width + x) * channels + c];
          for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j) {
            for (int k = std::max(0, x - 1); k <= std::min(width - 1, x + 1); ++k) {
              most = std::max(most, values[(static_cast<size_t>(j) * width + k) * channels + c]);
            }
          }
        }
      }
    }
    return largest;
  }

  const Operation& operation_;
  const Evaluated& moved_;
  size_t k_;
  Evaluated& out_;
  const ImageD own_;  // the operation's own error and that of the inputs before
  std::vector<ImageD> values_;
};

}  // namespace

void PassErrors(const Operation& operation, std::span<const Evaluated> in, size_t k, bool linear,
                Evaluated& out) {
  Responses responses(operation, in, k, out);
  if (operation.neighbours || linear) {
    responses.AddSets(linear);
  } else {
    responses.AddEach();
  }
  responses.AddJumps();
  if (k > 0 && k + 1 == in.size() && !linear) responses.AddTogether(in);
}

}  // namespace tessera::verify
