// The one place that asks Verify.
#include "random/verdict.h"

#include <cmath>
#include <cstring>

#include "random/draw.h"
#include "random/images.h"
#include "random/samples.h"
#include "support/pictures.h"
#include "tessera/error.h"
#include "tessera/verify.h"

namespace tessera::random {

std::optional<std::string> WrongVerdict(const Node& node, const ImageView& result, uint64_t number,
                                        Tally& tally) {
  VerifyOptions options{
      .samples = 6, .tile_size = 32, .render = {.threads = 1}, .seconds = 0.05, .first_seconds = 5};
  VerifyReport honest;
  try {
    honest = VerifyStored(node, result, options);
  } catch (const Error& e) {
    if (e.reason().find("reference takes more than") == std::string::npos) throw;
    tally.Add(kCases, "too long to judge");
    return std::nullopt;
  }
  tally.Add(kCases, "honest verdicts");
  if (!honest.within_bound) return "condemned: " + honest.Summary();
  // A wrong sample can only be seen where all samples are looked at and judged.
  if (honest.share < 1 || honest.undecided > 0) return std::nullopt;
  Draw draw(number, 5);
  const Roi& w = result.roi;
  const int x = draw.Between(w.x0, w.x1 - 1), y = draw.Between(w.y0, w.y1 - 1);
  const int c = draw.Below(result.channels);
  const double value = SampleAt(result, x, y, c);
  if (!(std::fabs(value) < 1e30) || !(honest.largest_bound < 1e30)) return std::nullopt;
  const double step = result.type == PixelType::kUint8    ? 1 / 255.0
                      : result.type == PixelType::kUint16 ? 1 / 65535.0
                                                          : 0;
  const double off = 3 * honest.largest_bound + 2 * step + 1e-3 * std::fabs(value) + 1e-6;
  const double wrong = value + off <= 1 || step == 0 ? value + off : value - off;
  if (step > 0 && (wrong < 0 || wrong > 1)) return std::nullopt;
  if (result.type == PixelType::kHalf && std::fabs(wrong) > 6e4) return std::nullopt;  // infinity either way
  // The caller's strides may be any number of bytes.
  const Pixels one({0, 0, 1, 1}, 1, result.type, {});
  testing::StoreSample(one.view(), 0, 0, 0, static_cast<float>(wrong));
  std::memcpy(result.At(x, y, c), one.view().data, PixelBytes(result.type));
  tally.Add(kCases, "spoilt verdicts");
  const VerifyReport report = VerifyStored(node, result, options);
  // Bounds may have grown with the value, or with what there was time for.
  if (!report.within_bound || report.share < 1 || off <= 1.5 * report.largest_bound) return std::nullopt;
  return "passed with x=" + std::to_string(x) + " y=" + std::to_string(y) + " channel " + std::to_string(c) +
         " off by " + std::to_string(off) + ": " + report.Summary();
}

}  // namespace tessera::random
