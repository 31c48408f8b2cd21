// Judges stored samples one by one: right, at a tie, undecided or out of bound.
#include "verify/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "verify/pixels.h"

namespace tessera::verify {
namespace {

// Integer results may be computed in another order where they round the same but next to a tie.
constexpr double kTie = 0x1p-12;

int MaxCode(PixelType type) { return type == PixelType::kUint8 ? 255 : 65535; }
bool IsInteger(PixelType type) { return type == PixelType::kUint8 || type == PixelType::kUint16; }

}  // namespace

double Comparison::Rounded(double value) const {
  if (stored_.type == PixelType::kHalf) return NearestHalf(value);
  return CodeOf(value, MaxCode(stored_.type)) / static_cast<double>(MaxCode(stored_.type));
}

void Comparison::Tile(const ConstImageView& pixels, const Evaluated& want) {
  const Roi& r = pixels.roi;
  const double unit = IsInteger(stored_.type) ? 1.0 / MaxCode(stored_.type) : 0;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const double alpha = stored_.unassociated < 0 ? 1 : SampleOf(pixels, x, y, stored_.unassociated);
      for (int k = 0; k < pixels.channels; ++k) {
        const int c = stored_.channels[static_cast<size_t>(k)];
        const double exact = want.value.at(x, y, c);
        // The reference itself is exact to double's precision only.
        const double tolerance = std::isfinite(exact) ? want.tolerance.at(x, y, c) + want.JumpAt(x, y, c) +
                                                            1e-14 * std::fabs(exact) + 0x1p-149
                                                      : 0;
        const double got = SampleOf(pixels, x, y, k);
        ++r_.samples;
        if (want.Undecided(x, y, c) || !std::isfinite(tolerance)) {
          ++r_.undecided;
        } else if (!std::isfinite(exact) && !IsInteger(stored_.type)) {
          Finite({x, y, c}, got, exact);
        } else if (stored_.bits > 0) {
          Coarse({x, y, c}, got, std::clamp(exact, 0.0, 1.0), tolerance, 1.0 / ((1 << stored_.bits) - 1));
        } else if (k != stored_.unassociated && alpha > 0 && alpha < 1) {
          // Rounded as it was handed over, and again when it was divided by alpha.
          Coarse({x, y, c}, got * alpha, std::clamp(exact, 0.0, alpha), tolerance, unit * (0.5 + alpha));
        } else if (stored_.type == PixelType::kFloat) {
          Value({x, y, c}, got, exact, tolerance);
        } else {
          Code({x, y, c}, got, exact, tolerance);
        }
      }
    }
  }
}

bool Comparison::Finite(const Place& at, double got, double want) {
  if (std::isfinite(got) && std::isfinite(want)) return true;
  const bool same = (std::isnan(got) && std::isnan(want)) || got == want;
  // Beyond float's range the float result is infinite where the double one is not.
  const bool overflow = std::isinf(got) && std::fabs(want) > std::numeric_limits<float>::max() &&
                        std::signbit(got) == std::signbit(want);
  if (!same && !overflow) {
    ++r_.nan_mismatches;
    Outside(at, std::numeric_limits<double>::infinity());
  }
  return false;
}

void Comparison::Value(const Place& at, double got, double want, double tolerance) {
  if (!Finite(at, got, want)) return;
  const double error = std::fabs(got - want);
  Count(error, tolerance);
  if (error > 0) ratios_.push_back(static_cast<float>(tolerance / error));
  if (error > tolerance) Outside(at, error / tolerance);
}

// Whatever rounds a value that the float result may have is right.
void Comparison::Code(const Place& at, double got, double want, double tolerance) {
  const bool integer = IsInteger(stored_.type);
  if (integer) tolerance += kTie / MaxCode(stored_.type);
  const double nearest = Rounded(want), low = Rounded(want - tolerance), high = Rounded(want + tolerance);
  const bool in_range = std::isnan(want) ? got == nearest : low <= got && got <= high;
  if (integer && std::isnan(want)) want = 0;
  if (integer) want = std::clamp(want, 0.0, 1.0);
  if (std::isfinite(got) && std::isfinite(want)) {
    const double rounding = integer ? 0.5 / MaxCode(stored_.type) : HalfStep(want) / 2;
    Count(std::fabs(got - want), tolerance + rounding);
  }
  if (got == nearest) return;
  if (integer) {
    const int codes = static_cast<int>(std::lround(std::fabs(got - nearest) * MaxCode(stored_.type)));
    r_.max_code_error = std::max(r_.max_code_error, codes);
  } else if (std::isfinite(got) && std::isfinite(nearest)) {
    const double step = std::max(HalfStep(nearest), 0x1p-24);
    r_.max_code_error = std::max(
        r_.max_code_error, static_cast<int>(std::min(1e6, std::round(std::fabs(got - nearest) / step))));
  }
  if (in_range) {
    ++r_.codes_at_tie;
    return;
  }
  ++r_.codes_wrong;
  if (!std::isfinite(got) || !std::isfinite(nearest)) {
    ++r_.nan_mismatches;
    return Outside(at, std::numeric_limits<double>::infinity());
  }
  Outside(at, 1 + std::fabs(got - want) / tolerance);
}

// A value that was rounded to less than the type holds.
void Comparison::Coarse(const Place& at, double got, double want, double tolerance, double rounding) {
  const double error = std::fabs(got - want), allowed = tolerance + rounding;
  Count(error, allowed);
  if (error > allowed) Outside(at, error / allowed);
}

void Comparison::Count(double error, double allowed) {
  ++finite_;
  squares_ += error * error;
  r_.largest_bound = std::max(r_.largest_bound, allowed);
  const double part = error / allowed;
  if (part > r_.closest || (part == r_.closest && allowed > r_.bound)) r_.closest = part, r_.bound = allowed;
  r_.max_error = std::max(r_.max_error, error);
}

void Comparison::Outside(const Place& at, double excess) {
  ++r_.out_of_bound;
  r_.within_bound = false;
  if (excess <= excess_) return;
  excess_ = excess;
  r_.worst_x = at.x, r_.worst_y = at.y, r_.worst_channel = at.channel;
}

void Comparison::Finish() {
  if (finite_ > 0) r_.rms_error = std::sqrt(squares_ / static_cast<double>(finite_));
  if (ratios_.empty()) return;
  const auto middle = ratios_.begin() + static_cast<ptrdiff_t>(ratios_.size() / 2);
  std::nth_element(ratios_.begin(), middle, ratios_.end());
  r_.median_ratio = *middle;
}

}  // namespace tessera::verify
