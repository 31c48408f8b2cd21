// Fog by distance, and by density layers over height: operations, profiles and their means.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "base/number_text.h"
#include "graph/op.h"
#include "model/shade_settings.h"
#include "ops/shade/fog_kernel.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<FogSegment> SegmentsOf(const LayerFogParams& p) {
  std::vector<FogSegment> segments;
  const auto add = [&](double bottom, double top, double base, double slope) {
    if (base != 0 || slope != 0) segments.push_back({bottom, top, base, slope});
  };
  const bool straight = p.profile == FogProfile::kLinear;
  if (straight) add(-kInfinity, p.layers.front().height, p.layers.front().density, 0);
  for (size_t k = 0; k < p.layers.size(); ++k) {
    const FogLayer& layer = p.layers[k];
    const bool last = k + 1 == p.layers.size();
    const double top = last ? kInfinity : p.layers[k + 1].height;
    const double slope =
        straight && !last ? (p.layers[k + 1].density - layer.density) / (top - layer.height) : 0.0;
    add(layer.height, top, layer.density, slope);
  }
  return segments;
}

bool IsClear(const FogSettings& s) {
  if (!s.layered) return s.fog.density == 0 && (s.fog.mode == FogMode::kExp || s.fog.mode == FogMode::kExp2);
  const LayerFogParams& p = s.layers;
  return std::all_of(p.layers.begin(), p.layers.end(), [](const FogLayer& l) { return l.density == 0; }) &&
         std::all_of(p.exponential.begin(), p.exponential.end(),
                     [](const auto& l) { return l.density == 0; });
}

class FogOp final : public graph::OpWith<FogSettings> {
 public:
  explicit FogOp(FogSettings settings) : OpWith(std::move(settings)) {}
  std::string Name() const override { return params().layered ? "layerfog" : "fog"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireSameWindow(Name(), in);
    graph::RequireColor(Name(), in[0]);
    graph::RequireColor(Name() + " positions", in[1]);
    if (params().color_input >= 0) {
      graph::RequireColor(Name() + " fog colours", in[static_cast<size_t>(params().color_input)]);
    }
    return in[0];
  }
  bool ReadsAlpha() const override { return true; }
  bool IsIdentity() const override { return IsClear(params()); }

  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    const FogSettings& s = params();
    FogPlan plan;
    plan.mode = s.fog.mode;
    plan.density = s.fog.density;
    plan.start = s.fog.start, plan.end = s.fog.end;
    plan.distance = !s.layered && (s.fog.distance || s.fog.mode == FogMode::kTransmittance);
    plan.color_input = s.color_input, plan.mask_input = s.mask_input;
    plan.layered = s.layered;
    const auto& color = s.layered ? s.layers.color : s.fog.color;
    const Vector3& eye = s.layered ? s.layers.eye : s.fog.eye;
    for (size_t k = 0; k < 3; ++k) plan.color[k] = static_cast<float>(color[k]), plan.eye[k] = eye[k];
    if (s.layered && s.layers.profile == FogProfile::kExponential) {
      plan.exponential = s.layers.exponential;
    } else if (s.layered) {
      plan.segments = SegmentsOf(s.layers);
      plan.density_at_eye = FogDensity(s.layers, eye[1]);
    }
    return MakeFogStage(plan);
  }
};

void CheckLayers(const LayerFogParams& p) {
  RequireFinite3("layerfog", "eye", p.eye);
  RequireFinite3("layerfog", "color", p.color);
  if (p.profile == FogProfile::kExponential) {
    if (p.exponential.empty()) throw Error("layerfog", "found no layers, expected at least one");
    for (const ExponentialLayer& layer : p.exponential) {
      RequireAtLeast("layerfog", "density", layer.density, 0);
      RequireFinite3("layerfog", "height", std::array{layer.height});
      if (!(layer.falloff > 0) || !std::isfinite(layer.falloff)) {
        throw Error("layerfog",
                    "found falloff " + base::NumberText(layer.falloff) + ", expected a positive height");
      }
    }
    return;
  }
  if (p.layers.empty() || p.layers.size() > 4096) {
    throw Error("layerfog", "found " + std::to_string(p.layers.size()) + " layers, expected 1 to 4096");
  }
  for (size_t k = 0; k < p.layers.size(); ++k) {
    RequireAtLeast("layerfog", "density", p.layers[k].density, 0);
    RequireFinite3("layerfog", "height", std::array{p.layers[k].height});
    if (k > 0 && !(p.layers[k].height > p.layers[k - 1].height)) {
      throw Error("layerfog", "found height " + base::NumberText(p.layers[k].height) + " after " +
                                  base::NumberText(p.layers[k - 1].height) + ", expected increasing heights");
    }
  }
}

Node MakeFogNode(FogSettings settings, const Node& color, const Node& position, const Node& fog_color,
                 const Node& density_factor) {
  if (color.spec().channel_count() < 3) {
    return AsColors(color, [&](const Node& colors) {
      return MakeFogNode(settings, colors, position, fog_color, density_factor);
    });
  }
  std::vector<Node> inputs = {color, position};
  if (fog_color) {
    settings.color_input = static_cast<int>(inputs.size());
    inputs.push_back(fog_color);
  }
  if (density_factor) {
    settings.mask_input = static_cast<int>(inputs.size());
    // A factor of one channel is spread, so that it can be a colour operation's input.
    inputs.push_back(ThreeChannels(density_factor));
  }
  // Distances and transmittances have one channel; a position of one is refused.
  const bool scalar =
      !settings.layered && (settings.fog.distance || settings.fog.mode == FogMode::kTransmittance);
  if (scalar || position.spec().channel_count() >= 3) inputs[1] = ThreeChannels(inputs[1]);
  return graph::MakeNode(std::make_shared<const FogOp>(std::move(settings)), std::move(inputs));
}

}  // namespace
}  // namespace tessera::ops

namespace tessera {

Node Fog(const Node& color, const Node& position, const FogParams& params, const Node& fog_color,
         const Node& density_factor) {
  ops::RequireAtLeast("fog", "density", params.density, 0);
  ops::RequireFinite3("fog", "start and end", std::array{params.start, params.end});
  ops::RequireFinite3("fog", "color", params.color);
  ops::RequireFinite3("fog", "eye", params.eye);
  ops::FogSettings settings;
  settings.fog = params;
  return ops::MakeFogNode(std::move(settings), color, position, fog_color, density_factor);
}

Node LayerFog(const Node& color, const Node& position, const LayerFogParams& params, const Node& fog_color,
              const Node& density_factor) {
  ops::CheckLayers(params);
  ops::FogSettings settings;
  settings.layered = true;
  settings.layers = params;
  return ops::MakeFogNode(std::move(settings), color, position, fog_color, density_factor);
}

std::vector<FogLayer> SampleProfile(const std::function<double(double)>& density, double low, double high,
                                    int samples) {
  if (samples < 2 || !(low < high)) {
    throw Error("fog profile", "found " + std::to_string(samples) + " samples from " + base::NumberText(low) +
                                   " to " + base::NumberText(high) +
                                   ", expected at least 2 and increasing heights");
  }
  std::vector<FogLayer> layers;
  for (int i = 0; i < samples; ++i) {
    const double height = low + (high - low) * i / (samples - 1);
    layers.push_back({height, density(height)});
  }
  return layers;
}

double FogDensity(const LayerFogParams& p, double height) {
  double density = 0;
  if (p.profile == FogProfile::kExponential) {
    for (const auto& layer : p.exponential)
      density += layer.density * std::exp((layer.height - height) / layer.falloff);
    return density;
  }
  const bool straight = p.profile == FogProfile::kLinear;
  if (straight) density = p.layers.front().density;
  for (size_t k = 0; k < p.layers.size() && height >= p.layers[k].height; ++k) {
    density = p.layers[k].density;
    if (straight && k + 1 < p.layers.size()) {
      density += (p.layers[k + 1].density - density) * (height - p.layers[k].height) /
                 (p.layers[k + 1].height - p.layers[k].height);
    }
  }
  return density;
}

double MeanFogDensity(const LayerFogParams& p, double a, double b) {
  const double low = std::min(a, b), high = std::max(a, b);
  if (low == high) return FogDensity(p, low);
  double sum = 0;
  if (p.profile == FogProfile::kExponential) {
    for (const auto& layer : p.exponential) {
      const double x = (high - low) / layer.falloff;
      sum += layer.density * std::exp((layer.height - low) / layer.falloff) * (-std::expm1(-x) / x);
    }
    return sum;
  }
  for (const ops::FogSegment& s : ops::SegmentsOf(p)) {
    const double bottom = std::max(low, s.bottom), top = std::min(high, s.top);
    if (top <= bottom) continue;
    const double middle = s.slope == 0 ? 0 : 0.5 * (bottom + top) - s.bottom;
    sum += (s.base + s.slope * middle) * (top - bottom);
  }
  return sum / (high - low);
}

}  // namespace tessera
