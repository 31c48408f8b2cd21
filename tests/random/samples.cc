// Bits of samples, NaN aside.
#include "random/samples.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "random/images.h"
#include "support/pictures.h"
#include "verify/pixels.h"

namespace tessera::random {
namespace {

bool IsInteger(PixelType type) { return type == PixelType::kUint8 || type == PixelType::kUint16; }

// The code of an integer sample.
int CodeAt(const ConstImageView& view, int x, int y, int c) {
  const std::byte* const at = view.At(x, y, c);
  if (view.type == PixelType::kUint8) return std::to_integer<int>(*at);
  uint16_t code;
  std::memcpy(&code, at, 2);
  return code;
}

// `off`: by how much more than a few roundings of 1 the value may be off.
bool IsNearTie(float v, PixelType type, double off) {
  const double codes = type == PixelType::kUint8 ? 255 : 65535, position = double{v} * codes;
  // A rule that rounds has another float than this one, a few roundings away.
  return std::fabs(position - std::floor(position) - 0.5) <= 0x1p-12 + (0x1p-22 + off) * codes;
}

std::string ValueWords(const ConstImageView& view, int x, int y, int c) {
  char text[48];
  if (IsInteger(view.type)) {
    std::snprintf(text, sizeof text, "%d", CodeAt(view, x, y, c));
  } else {
    std::snprintf(text, sizeof text, "%.9g", SampleAt(view, x, y, c));
  }
  return text;
}

}  // namespace

ConstImageView Channel(ConstImageView view, int channel) {
  view.data = view.At(view.roi.x0, view.roi.y0, channel);
  view.channels = 1;
  return view;
}

double SampleAt(const ConstImageView& view, int x, int y, int c) {
  const std::byte* const at = view.At(x, y, c);
  switch (view.type) {
    case PixelType::kUint8:
      return std::to_integer<int>(*at) / 255.0;
    case PixelType::kUint16:
      return CodeAt(view, x, y, c) / 65535.0;
    case PixelType::kHalf: {
      uint16_t bits;
      std::memcpy(&bits, at, 2);
      return verify::HalfToDouble(bits);
    }
    case PixelType::kFloat:
      break;
  }
  float v;
  std::memcpy(&v, at, 4);
  return double{v};
}

std::optional<std::string> Differ(const ConstImageView& got, const ConstImageView& want,
                                  const ConstImageView* floats, const OffFunction& off) {
  if (got.type != want.type || got.channels != want.channels) return "types or channel counts differ";
  const Roi& r = got.roi;
  const size_t bytes = PixelBytes(got.type);
  int64_t wrong = 0;
  std::string first;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < got.channels; ++c) {
        if (std::memcmp(got.At(x, y, c), want.At(x, y, c), bytes) == 0) continue;
        if (!IsInteger(got.type)) {
          if (std::isnan(SampleAt(got, x, y, c)) && std::isnan(SampleAt(want, x, y, c))) continue;
        } else if (floats != nullptr) {
          const auto v = static_cast<float>(SampleAt(*floats, x, y, c));
          const int apart = std::abs(CodeAt(got, x, y, c) - CodeAt(want, x, y, c));
          if (apart == 1 && IsNearTie(v, got.type, 0)) continue;
          const double most = off ? off(x, y, c) : 0, codes = got.type == PixelType::kUint8 ? 255 : 65535;
          if (apart == 1 ? IsNearTie(v, got.type, most) : apart <= 2 * most * codes) continue;
        }
        if (wrong++ == 0) {
          first = "at x=" + std::to_string(x) + " y=" + std::to_string(y) + " channel " + std::to_string(c) +
                  ": " + ValueWords(got, x, y, c) + ", expected " + ValueWords(want, x, y, c);
        }
      }
    }
  }
  if (wrong == 0) return std::nullopt;
  return first + " (" + std::to_string(wrong) + " of " + std::to_string(r.pixels() * got.channels) +
         " samples differ)";
}

std::optional<std::string> DifferRounded(const ConstImageView& packed, const ConstImageView& floats,
                                         bool near_ties, const OffFunction& off) {
  const Pixels rounded(packed.roi, packed.channels, packed.type, {});
  const Roi& r = packed.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < packed.channels; ++c) {
        testing::StoreSample(rounded.view(), x, y, c, static_cast<float>(SampleAt(floats, x, y, c)));
      }
    }
  }
  return Differ(packed, rounded.view(), near_ties ? &floats : nullptr, off);
}

bool AllOrdinary(const ConstImageView& view) {
  const Roi& r = view.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < view.channels; ++c) {
        const double v = std::fabs(SampleAt(view, x, y, c));
        if (!(v < 1e4) || (v != 0 && v < 1e-20)) return false;
      }
    }
  }
  return true;
}

}  // namespace tessera::random
