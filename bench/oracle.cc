// Bands of the reference engine's result, and the comparison of pixels with them.
#include "oracle.h"

#include <algorithm>
#include <cmath>

#include "graph/little_memory.h"
#include "graph/op.h"
#include "task.h"
#include "verify/evaluate.h"
#include "verify/pixels.h"

namespace tessera::bench {

using reference::ImageD;

ImageD Reference(const Node& node, const Roi& roi) {
  // Bounds are the tests' business; here errors are measured, not judged.
  verify::ReferenceEngine engine([](const std::string&) { return 0.0; });
  return engine.Evaluate(node, roi).value;
}

bool NeedsStatistics(const Node& node) {
  if (graph::PrefersRows(*node.data()->op)) return true;
  return std::any_of(node.data()->inputs.begin(), node.data()->inputs.end(), NeedsStatistics);
}

void Errors::Add(const Errors& other) {
  max = std::max(max, other.max), rms = std::max(rms, other.rms);
  max_code_error = std::max(max_code_error, other.max_code_error);
  values += other.values, wrong_codes += other.wrong_codes, not_finite += other.not_finite;
}

Oracle::Oracle(const Node& node, int bands, int rows_per_band) {
  const Roi window = node.spec().data_window;
  const int rows = std::min(rows_per_band, window.height());
  bands = std::max(1, std::min(bands, window.height() / std::max(1, rows)));
  verify::ReferenceEngine engine(
      [](const std::string&) { return 0.0; });  // remembers statistics between bands
  for (int i = 0; i < bands; ++i) {
    const int last = window.height() - rows;
    const int y = window.y0 + (bands > 1 ? static_cast<int>(int64_t{last} * i / (bands - 1)) : 0);
    bands_.push_back(engine.Evaluate(node, {window.x0, y, window.x1, y + rows}).value);
  }
}

Errors Oracle::Compare(const ConstImageView& pixels) const {
  Errors errors;
  const bool integer = pixels.type == PixelType::kUint8 || pixels.type == PixelType::kUint16;
  const int codes = pixels.type == PixelType::kUint8 ? 255 : 65535;
  double squares = 0;
  for (const ImageD& band : bands_) {
    for (int y = band.roi.y0; y < band.roi.y1; ++y) {
      for (int x = band.roi.x0; x < band.roi.x1; ++x) {
        for (int c = 0; c < band.channels; ++c) {
          double exact = band.at(x, y, c);
          const double found = Decode(pixels.At(x, y, c), pixels.type);
          if (integer) exact = std::isnan(exact) ? 0 : std::clamp(exact, 0.0, 1.0);
          if (!std::isfinite(exact) || !std::isfinite(found)) {
            const bool same = exact == found || (std::isnan(exact) && std::isnan(found));
            errors.not_finite += same ? 0 : 1;
            continue;
          }
          const double error = std::abs(found - exact);
          errors.max = std::max(errors.max, error);
          squares += error * error;
          ++errors.values;
          if (integer) {
            const double code = exact * codes;
            const int difference = std::abs(verify::CodeOf(found, codes) - verify::CodeOf(exact, codes));
            const bool tie = std::abs(code - std::floor(code) - 0.5) <= 0x1p-12;
            errors.max_code_error = std::max(errors.max_code_error, difference);
            if (difference > (tie ? 1 : 0)) ++errors.wrong_codes;
          }
        }
      }
    }
  }
  errors.rms = errors.values ? std::sqrt(squares / static_cast<double>(errors.values)) : 0;
  return errors;
}

}  // namespace tessera::bench
