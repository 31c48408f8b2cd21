// Transfer functions as tables, ramps, and the chains of the presets.
#include "ops/volume/transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "base/number_lines.h"
#include "base/number_text.h"
#include "model/black_body.h"
#include "model/volume_settings.h"
#include "ops/noise/plan.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::ops::volume {
namespace {

constexpr double kMostDepth = 92;  // -log1p(-a) of an opacity of 1

TransferPoint At(const std::vector<TransferPoint>& points, double value) {
  if (value <= points.front().value) return points.front();
  for (size_t i = 1; i < points.size(); ++i) {
    if (value > points[i].value) continue;
    const TransferPoint &a = points[i - 1], &b = points[i];
    const double width = b.value - a.value, f = width > 0 ? (value - a.value) / width : 1;
    TransferPoint p;
    p.value = value;
    for (size_t c = 0; c < 3; ++c) p.color[c] = a.color[c] + f * (b.color[c] - a.color[c]);
    p.opacity = a.opacity + f * (b.opacity - a.opacity);
    return p;
  }
  return points.back();
}

double Extinction(double opacity, double length) {
  const double a = opacity > 0 ? std::min(opacity, 1.0) : 0;  // NaN counts as 0
  return std::min(-std::log1p(-a), kMostDepth) / length;
}

using Stop = std::array<double, 5>;  // value, colour, opacity

VolumeTransferFunction FromStops(const std::vector<Stop>& stops, double length) {
  VolumeTransferFunction t;
  t.length = length;
  for (const Stop& s : stops) t.points.push_back({s[0], {s[1], s[2], s[3]}, s[4]});
  return t;
}

// What a mode shows when the caller gives no transfer function.
VolumeTransferFunction Preset(const VolumeDraw& draw) {
  const VolumeParams& p = draw.params;
  const Vector3& spacing = draw.volume.spec().spacing;
  const double voxel = std::min({spacing[0], spacing[1], spacing[2]});
  if (p.mode == VolumeMode::kFire) {
    // Orange to white: what is nearly out is thin, not dark.
    const double length = 0.55 * std::max(p.soft, voxel);
    return FromStops({{0, 1.3, 0.26, 0.015, 0},
                      {0.03, 1.3, 0.26, 0.015, 0},
                      {0.30, 1.5, 0.40, 0.03, 0.06},
                      {0.60, 1.9, 0.75, 0.08, 0.13},
                      {0.85, 2.2, 1.3, 0.28, 0.24},
                      {1, 2.5, 1.8, 0.7, 0.4}},
                     length);
  }
  if (p.mode == VolumeMode::kFur) {
    return FromStops({{0, 1, 1, 1, 0}, {0.06, 1, 1, 1, 0.0}, {0.30, 1, 1, 1, 0.55}, {1, 1, 1, 1, 0.95}},
                     voxel);
  }
  if (p.mode == VolumeMode::kHyper) return FromStops({{0, 1, 1, 1, 0}, {1, 1, 1, 1, 0.5}}, voxel);
  const auto range = draw.volume.Range();
  const double top = range[1] > range[0] ? range[1] : range[0] + 1;
  return FromStops({{range[0], 1, 1, 1, 0}, {top, 1, 1, 1, 0.1}}, voxel);
}

void Order(std::vector<TransferPoint>& points) {
  for (const TransferPoint& p : points) {
    if (!std::isfinite(p.value)) throw Error("transfer function", "found a value that is not finite");
    for (double c : p.color) {
      if (!std::isfinite(c)) throw Error("transfer function", "found a colour that is not finite");
    }
  }
  std::stable_sort(points.begin(), points.end(),
                   [](const TransferPoint& a, const TransferPoint& b) { return a.value < b.value; });
}

// Entries of the light that the medium gives.
void MakeEmission(VolumeDraw& draw) {
  draw.emission.clear();
  const VolumeEmission& e = draw.params.emission;
  if (e.high == 0) return;
  const double hottest = model::BlackBodyLuminance(e.high);
  for (int i = 0; i <= kTransferSize; ++i) {
    const double share = std::min(i, kTransferSize - 1) / (kTransferSize - 1.0);
    const double kelvin = e.low + share * (e.high - e.low);
    const double luminance = e.strength * model::BlackBodyLuminance(kelvin) / hottest;
    for (double c : model::BlackBodyColor(kelvin)) draw.emission.push_back(static_cast<float>(c * luminance));
    draw.emission.push_back(0);
  }
}

}  // namespace

void MakeColors(VolumeDraw& draw) {
  std::vector<TransferPoint>& points = draw.params.colors;
  // Veins where the wave of the block is lowest, where it lingers.
  if (points.empty()) {
    points = FromStops({{0, 0.045, 0.05, 0.06, 1},
                        {0.02, 0.14, 0.135, 0.14, 1},
                        {0.08, 0.42, 0.39, 0.36, 1},
                        {0.25, 0.70, 0.67, 0.62, 1},
                        {0.60, 0.86, 0.84, 0.79, 1},
                        {1, 0.94, 0.92, 0.87, 1}},
                       1)
                 .points;
  }
  Order(points);
  draw.colors_low = points.front().value, draw.colors_high = points.back().value;
  if (!(draw.colors_high > draw.colors_low))
    draw.colors_high = draw.colors_low + 1e-6 * std::max(1.0, std::fabs(draw.colors_low));
  constexpr int kEntries = 256;
  draw.colors.clear();
  for (int i = 0; i <= kEntries; ++i) {
    const double share = std::min(i, kEntries - 1) / (kEntries - 1.0);
    const TransferPoint p = At(points, draw.colors_low + share * (draw.colors_high - draw.colors_low));
    for (double c : p.color) draw.colors.push_back(static_cast<float>(c));
    draw.colors.push_back(1);
  }
}

void MakeTransfer(VolumeDraw& draw) {
  VolumeTransferFunction& t = draw.params.transfer;
  if (t.points.empty()) t = Preset(draw);
  if (!(t.length > 0)) throw Error("transfer function", "found a reference length that is not positive");
  Order(t.points);
  draw.transfer_low = t.points.front().value;
  draw.transfer_high = t.points.back().value;
  if (!(draw.transfer_high > draw.transfer_low))
    draw.transfer_high = draw.transfer_low + 1e-6 * std::max(1.0, std::fabs(draw.transfer_low));
  const double domain = draw.transfer_high - draw.transfer_low;
  draw.transfer.clear();
  for (int i = 0; i <= kTransferSize; ++i) {  // one more, for the last entry's neighbour
    const double share = std::min(i, kTransferSize - 1) / (kTransferSize - 1.0);
    const TransferPoint p = At(t.points, draw.transfer_low + share * domain);
    for (double c : p.color) draw.transfer.push_back(static_cast<float>(c));
    draw.transfer.push_back(static_cast<float>(Extinction(p.opacity, t.length)));
  }
  MakeEmission(draw);
  draw.pairs.clear();
  if (draw.params.classification != Classification::kPreIntegrated) return;
  // Colour and extinction of a segment along which the value runs from front to back, by many small steps.
  constexpr int kParts = 64;
  const double step = draw.params.step;
  const auto entry = [&](double share, int c) {
    const double at = std::clamp(share, 0.0, 1.0) * (kTransferSize - 1);
    const auto i = static_cast<size_t>(at);
    const double f = at - static_cast<double>(i);
    return (1 - f) * draw.transfer[4 * i + static_cast<size_t>(c)] +
           f * draw.transfer[4 * i + 4 + static_cast<size_t>(c)];
  };
  draw.pairs.resize(static_cast<size_t>(kPairSize + 1) * (kPairSize + 1) * 4);
  for (int b = 0; b <= kPairSize; ++b) {
    for (int f = 0; f <= kPairSize; ++f) {
      const double front = std::min(f, kPairSize - 1) / (kPairSize - 1.0);
      const double back = std::min(b, kPairSize - 1) / (kPairSize - 1.0);
      const int parts = front == back ? 1 : kParts;
      double alpha = 0, depth = 0, color[3] = {0, 0, 0}, mean[3] = {0, 0, 0};
      for (int i = 0; i < parts; ++i) {
        const double share = front + (i + 0.5) / parts * (back - front);
        const double optical = entry(share, 3) * step / parts, a = -std::expm1(-optical);
        for (int c = 0; c < 3; ++c) {
          color[c] += (1 - alpha) * a * entry(share, c);
          mean[c] += entry(share, c) / parts;
        }
        alpha += (1 - alpha) * a;
        depth += optical;
      }
      float* const to = &draw.pairs[(static_cast<size_t>(b) * (kPairSize + 1) + static_cast<size_t>(f)) * 4];
      for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(alpha > 1e-12 ? color[c] / alpha : mean[c]);
      to[3] = static_cast<float>(depth / step);
    }
  }
}

bool TransferSupport(const VolumeDraw& draw, double& from, double& to) {
  int first = kTransferSize, last = -1;
  for (int i = 0; i < kTransferSize; ++i) {
    if (draw.transfer[static_cast<size_t>(4 * i + 3)] > 0) first = std::min(first, i), last = i;
  }
  if (last < 0) return false;
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const double entry = (draw.transfer_high - draw.transfer_low) / (kTransferSize - 1);
  from = first == 0 ? -kEndless : draw.transfer_low + (first - 1) * entry;
  to = last == kTransferSize - 1 ? kEndless : draw.transfer_low + (last + 1) * entry;
  return true;
}

std::vector<Dmf> FireChain(const VolumeParams& p, double side) {
  const double frequency = p.frequency > 0 ? p.frequency : 2.3 / side;
  // Frequencies in parts of that; `stretch`: how many times as high as wide.
  const auto step = [&](Dmf::Kind kind, double amount, double times, double rise, double stretch) {
    Dmf made;
    made.kind = kind;
    made.amount = amount;
    made.frequency = times * frequency;
    made.upright = 1 / stretch;
    made.drift = {0, -rise, 0.12 * rise};
    return made;
  };
  // Some flames are higher; all bend, the more the finer; noise that is far higher than wide leaves tongues
  // that taper as the field does, turbulence parts them; what little is left is nothing.
  std::vector<Dmf> chain = {
      step(Dmf::Kind::kNoise, 1.3, 0.22, 0.3, 1.5),        step(Dmf::Kind::kWarp, 0.07 * side, 0.7, 0.4, 1.6),
      step(Dmf::Kind::kWarp, 0.03 * side, 1.65, 0.6, 1.6), step(Dmf::Kind::kNoise, 1.4, 0.7, 0.4, 4),
      step(Dmf::Kind::kTurbulence, 0.9, 1.3, 0.6, 3),      step(Dmf::Kind::kThreshold, 0.14, 1, 0, 1)};
  chain.back().softness = 0.7;
  for (Dmf& one : chain) one.lookup = p.lookup;
  return chain;
}

void CompleteDmf(Dmf& step) {
  using Kind = Dmf::Kind;
  const auto require = [&](bool valid, const char* what, double found, const char* expected) {
    if (!valid)
      throw Error("dmf",
                  std::string("found ") + what + " " + base::NumberText(found) + ", expected " + expected);
  };
  require(std::isfinite(step.amount), "an amount of", step.amount, "a finite number");
  require(step.frequency >= 0 && step.frequency < 1e6, "a frequency of", step.frequency, "0 to 1e6");
  const auto line = [&](const std::vector<std::array<double, 2>>& points, const char* what) {
    require(!points.empty() && points.size() <= 64, what, static_cast<double>(points.size()),
            "1 to 64 points");
    double before = points[0][0];
    for (const auto& [at, value] : points) {
      require(std::isfinite(at) && at >= before, "a point at", at, "finite numbers in order");
      require(value >= 0 && value <= 1, "a point's value of", value, "0 to 1");
      before = at;
    }
  };
  for (const DmfInput& input : step.inputs) {
    line(input.points, "an input's points,");
    for (double c : input.place) require(std::fabs(c) <= 1e6, "an input's place of", c, "-1e6 to 1e6");
    const bool moves = step.kind == Kind::kWarp || step.kind == Kind::kLift || step.kind == Kind::kSwell;
    if (moves && input.kind < DmfInput::Kind::kHeight) {
      throw Error(
          "dmf",
          "found a displacement by the field's gradient, normal or density, expected one by height or "
          "region");
    }
  }
  if (step.kind == Kind::kBias || step.kind == Kind::kGain) {
    require(step.amount > 0 && step.amount < 1, "an amount of", step.amount, "between 0 and 1");
    return;
  }
  if (step.kind == Kind::kTable) line(step.table, "a table's points,");
  if (step.kind == Kind::kThreshold || step.kind == Kind::kTable) return;
  if (step.kind == Kind::kFunction) {
    if (!step.function) throw Error("dmf", "found no function, expected one");
    return;
  }
  NoiseContent content = NoiseContent::kNoise;
  int cells = 8, octaves = 1;
  if (step.kind == Kind::kWarp) {
    content = NoiseContent::kVector;
    cells = 4;
  } else if (step.kind != Kind::kNoise) {
    switch (step.lookup) {
      case TurbulenceLookup::kBlock:
      case TurbulenceLookup::kExact:  // its mean
        content = NoiseContent::kTurbulence;
        cells = kTurbulenceCells, octaves = kTurbulenceOctaves;
        break;
      case TurbulenceLookup::kFourChannels:
        content = NoiseContent::kFourOctaves;
        cells = 4;
        break;
      default:
        cells = 4;
    }
  }
  if (step.block.empty()) step.block = NoiseBlock(content, cells, octaves);
  const int channels = content >= NoiseContent::kFourOctaves ? 4 : 1;
  require(step.block.channels() == channels, "a noise block whose channels are", step.block.channels(),
          channels == 4 ? "4" : "1");
}

double TurbulenceRange(const Dmf& step) {
  if (step.block.empty()) return 0;
  const double one = std::max(std::fabs(step.block.low()), std::fabs(step.block.high()));
  switch (step.lookup) {
    case TurbulenceLookup::kBlock:
      return one;
    case TurbulenceLookup::kFourChannels: {
      const NoiseBlock::Data& d = step.block.data();
      return 1.875 * std::max(std::fabs(d.bias), std::fabs(d.bias + 65535 * d.scale));
    }
    case TurbulenceLookup::kExact:
      return 2;  // of noise in [-1, 1]
    default:
      return 2 * one;
  }
}

double Unseen(const std::vector<Dmf>& chain, const MediumArgs& m) {
  double most = std::clamp<double>(m.clear, 0, 1);
  for (size_t i = chain.size(); i-- > 0;) {
    const double after = most;
    const double exponent = 1 / std::max<double>(m.steps[i].amount, 1e-6);
    switch (chain[i].kind) {
      case Dmf::Kind::kBias:
        most = std::pow(most, exponent);
        break;
      case Dmf::Kind::kGain:
        most = most < 0.5 ? 0.5 * std::pow(2 * most, exponent) : 1 - 0.5 * std::pow(2 - 2 * most, exponent);
        break;
      case Dmf::Kind::kTurbulence: {
        const double amount = chain[i].amount,
                     factor = 1 - amount + std::fabs(amount) * TurbulenceRange(chain[i]);
        most = factor > most ? most / factor : 1;
        break;
      }
      case Dmf::Kind::kThreshold:
        if (chain[i].amount < 0) return 0;
        most = std::clamp(chain[i].amount, 0.0, 1.0);
        break;
      case Dmf::Kind::kNoise:
      case Dmf::Kind::kTable:
        return 0;  // may add density wherever there is some
      default:
        continue;
    }
    if (!chain[i].inputs.empty()) most = std::min(most, after);  // where it does not act
    most *= 1 - 1e-4;                                            // for rounding
  }
  return most;
}

void ExactOctaves(ExactOctave (&octaves)[kTurbulenceOctaves]) {
  NoiseParams params;
  params.dims = 3;
  const NoisePlan plan = MakeNoisePlan(params, false, 0);
  for (size_t k = 0; k < kTurbulenceOctaves; ++k) {
    ExactOctave& to = octaves[k];
    to.cells = static_cast<float>(kTurbulenceCells);
    to.times = static_cast<float>(1 << k);
    for (size_t a = 0; a < 3; ++a) to.shift[a] = kOctaveShifts[k][a];
    to.weight = plan.octaves[0].weight * plan.shape.scale / to.times;
    to.seed = plan.octaves[0].seed;
  }
}

}  // namespace tessera::ops::volume

namespace tessera {

VolumeTransferFunction ReadVolumeTransferFunction(const std::string& file) {
  VolumeTransferFunction t;
  base::ReadNumberLines(file, "lines of value red green blue opacity", {"value red green blue opacity", 5, 5},
                        [&](std::span<const double> n, int) {
                          t.points.push_back({n[0], {n[1], n[2], n[3]}, n[4]});
                        });
  if (t.points.empty())
    throw DataError(file, "found no points, expected lines of value red green blue opacity");
  return t;
}

}  // namespace tessera
