// Layered fog by the papers' tables, composed of look-ups and blends.
#include <cmath>
#include <memory>
#include <utility>

#include "graph/op.h"
#include "model/shade_settings.h"
#include "ops/shade/place_kernel.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/lookup.h"

namespace tessera::ops {
namespace {

// Table axes of positions: distance and height in [0,1] across the table, the eye's height the same
// everywhere.
class FogAxesOp final : public graph::OpWith<ops::FogAxesSettings> {
 public:
  explicit FogAxesOp(ops::FogAxesSettings settings) : OpWith(std::move(settings)) {}
  std::string Name() const override { return "fogaxes"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireColor("layerfog positions", in[0]);
    return in[0];
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    const ops::FogAxesSettings& s = params();
    const double span = s.high - s.low;
    return MakeFogAxesStage(
        {{s.eye[0], s.eye[1], s.eye[2]}, 1 / s.distance, s.low, 1 / span, (s.eye[1] - s.low) / span});
  }
};

}  // namespace
}  // namespace tessera::ops

namespace tessera {

Node LayerFogByTable(const Node& color, const Node& position, const LayerFogParams& params,
                     const FogTableParams& t) {
  if (color.spec().channel_count() < 3) {
    return AsColors(color, [&](const Node& colors) { return LayerFogByTable(colors, position, params, t); });
  }
  const int most = t.form == FogTable::kDistanceHeightHeight ? 256 : 4096;
  if (t.size < 2 || t.size > most) {
    throw Error("layerfog:table", "found " + std::to_string(t.size) + ", expected 2 to " +
                                      std::to_string(most) + " entries per axis");
  }
  if (t.bits != 0 && (t.bits < 2 || t.bits > 16)) {
    throw Error("layerfog:bits", "found " + std::to_string(t.bits) + ", expected 0 or 2 to 16");
  }
  if (!(t.distance > 0) || !(t.high > t.low) || !std::isfinite(t.distance + t.high - t.low)) {
    throw Error("layerfog:range",
                "found a table without extent, expected a positive distance and low < high");
  }
  LayerFog(color, position, params);  // refuses bad layers
  const auto quantized = [&](double v) {
    if (t.bits == 0) return v;
    const double codes = std::exp2(t.bits) - 1;
    return std::nearbyint(v * codes) / codes;
  };
  const auto height = [&](double c) { return t.low + (t.high - t.low) * c; };
  double densest = 0;
  for (int i = 0; i <= 1024; ++i) densest = std::max(densest, FogDensity(params, height(i / 1024.0)));
  if (densest == 0) densest = 1;

  // Every form is tabulated on [0,1]; axis 0 is the distance but in the one-dimensional form.
  FunctionTableParams shape;
  TableFunction function;
  const double eye = params.eye[1];
  if (t.form == FogTable::kMeanOfHeight) {
    shape.sizes = {t.size};
    function = [&](const double* c, double* r) {
      r[0] = quantized(MeanFogDensity(params, eye, height(c[0])) / densest);
    };
  } else {
    shape.sizes = {t.size, t.size};
    if (t.form == FogTable::kDistanceHeightHeight) shape.sizes.push_back(t.size);
    function = [&](const double* c, double* r) {
      const double from = shape.sizes.size() == 3 ? height(c[2]) : eye;
      r[0] = quantized(std::exp(-c[0] * t.distance * MeanFogDensity(params, from, height(c[1]))));
    };
  }
  shape.probes = 1;
  const Table table = TableFromFunction(function, shape).table;

  const ops::FogAxesSettings axes{params.eye, t.distance, t.low, t.high};
  Node coords = graph::MakeNode(std::make_shared<const ops::FogAxesOp>(axes), {position});
  if (t.bits > 0) coords = Quantize(coords, {.bits = t.bits});
  LookupParams lookup;
  FogParams fog;
  fog.color = params.color, fog.eye = params.eye;
  if (t.form == FogTable::kMeanOfHeight) {
    lookup.axes = {1};
    fog.density = densest;
    return Fog(color, position, fog, {}, Lookup(coords, table, lookup));
  }
  Node through = Lookup(coords, table, lookup);
  if (t.bits > 0) through = Quantize(through, {.bits = t.bits});
  fog.mode = FogMode::kTransmittance;
  return Fog(color, through, fog);
}

}  // namespace tessera
