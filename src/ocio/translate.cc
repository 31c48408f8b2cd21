// A processor of OpenColorIO as nodes: one transform after the other, runs of those without nodes as one CPU
// processor.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "graph/op.h"
#include "ocio/config.h"
#include "ocio/formulas.h"
#include "tessera/ocio_adapter.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"
#include "tessera/ops/lookup.h"

namespace tessera::ocio {
namespace {

bool IsInverse(const lib::Transform& t) { return t.getDirection() == lib::TRANSFORM_DIR_INVERSE; }

// The colours only, as a matrix: it folds with its neighbours.
Node ScaleAndOffset(const Node& image, const double (&scale)[3], const double (&offset)[3]) {
  return ColorMatrix(image,
                     {{scale[0], 0, 0, 0, scale[1], 0, 0, 0, scale[2], offset[0], offset[1], offset[2]}});
}

// Solves for the inverse by elimination with pivots; false when the matrix is singular.
bool Invert4(double (&m)[16], double (&inverse)[16]) {
  for (int i = 0; i < 16; ++i) inverse[i] = i % 5 == 0;
  for (int c = 0; c < 4; ++c) {
    int pivot = c;
    for (int r = c + 1; r < 4; ++r) {
      if (std::fabs(m[r * 4 + c]) > std::fabs(m[pivot * 4 + c])) pivot = r;
    }
    if (m[pivot * 4 + c] == 0) return false;
    for (int k = 0; k < 4; ++k) {
      std::swap(m[c * 4 + k], m[pivot * 4 + k]);
      std::swap(inverse[c * 4 + k], inverse[pivot * 4 + k]);
    }
    const double scale = 1 / m[c * 4 + c];
    for (int k = 0; k < 4; ++k) m[c * 4 + k] *= scale, inverse[c * 4 + k] *= scale;
    for (int r = 0; r < 4; ++r) {
      const double factor = m[r * 4 + c];
      if (r == c || factor == 0) continue;
      for (int k = 0; k < 4; ++k) {
        m[r * 4 + k] -= factor * m[c * 4 + k];
        inverse[r * 4 + k] -= factor * inverse[c * 4 + k];
      }
    }
  }
  return true;
}

std::optional<Node> OfMatrix(const Node& image, const lib::MatrixTransform& t) {
  double m[16], offset[4];
  t.getMatrix(m), t.getOffset(offset);
  if (IsInverse(t)) {
    double inverse[16], back[4] = {};
    if (!Invert4(m, inverse)) return std::nullopt;
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) back[r] -= inverse[r * 4 + c] * offset[c];
    }
    std::copy(inverse, inverse + 16, m), std::copy(back, back + 4, offset);
  }
  std::vector<double> values(m, m + 16);
  values.insert(values.end(), offset, offset + 4);
  return ColorMatrix(image, {values, /*transpose=*/true});
}

Node Limited(const Node& image, bool has_low, double low, bool has_high, double high) {
  ClampParams clamp;
  if (has_low) clamp.min.assign(3, low);
  if (has_high) clamp.max.assign(3, high);
  return has_low || has_high ? Clamp(image, clamp) : image;
}

Node OfRange(const Node& image, const lib::RangeTransform& t) {
  double low_in = t.getMinInValue(), low_out = t.getMinOutValue();
  double high_in = t.getMaxInValue(), high_out = t.getMaxOutValue();
  if (IsInverse(t)) std::swap(low_in, low_out), std::swap(high_in, high_out);
  const bool low = t.hasMinInValue() && t.hasMinOutValue(), high = t.hasMaxInValue() && t.hasMaxOutValue();
  const double scale = low && high && high_in != low_in ? (high_out - low_out) / (high_in - low_in) : 1;
  const double offset = low ? low_out - scale * low_in : high ? high_out - scale * high_in : 0;
  Node node = image;
  if (scale != 1 || offset != 0) node = ScaleAndOffset(node, {scale, scale, scale}, {offset, offset, offset});
  return t.getStyle() == lib::RANGE_CLAMP ? Limited(node, low, low_out, high, high_out) : node;
}

// ASC CDL: slope and offset, power, saturation about Rec.709 luma; the ASC style limits to [0,1] after the
// first and the last, the other leaves negative values alone.
Node OfCdl(const Node& image, const lib::CDLTransform& t) {
  double slope[3], offset[3], power[3];
  t.getSlope(slope), t.getOffset(offset), t.getPower(power);
  const bool limit = t.getStyle() == lib::CDL_ASC;
  const auto limited = [&](const Node& n) { return limit ? Limited(n, true, 0, true, 1) : n; };
  const auto powered = [&](const Node& n, bool inverse) {
    if (power[0] == 1 && power[1] == 1 && power[2] == 1) return n;
    CurveParams params;
    for (const double p : power) {
      CurveFormula f;
      f.kind = p == 1 ? CurveFormula::Kind::kLinear : CurveFormula::Kind::kPower;
      f.exponent = inverse ? 1 / p : p;
      f.negatives = Negatives::kKeep;
      params.formulas.push_back(f);
    }
    return ApplyCurve(n, params);
  };
  if (!IsInverse(t)) {
    const Node toned = powered(limited(ScaleAndOffset(image, slope, offset)), false);
    return limited(Saturate(toned, t.getSat(), kRec709));
  }
  double scale[3], bias[3];
  for (int c = 0; c < 3; ++c) scale[c] = 1 / slope[c], bias[c] = -offset[c] / slope[c];
  const Node grey = limited(Saturate(limited(image), 1 / t.getSat(), kRec709));
  return limited(ScaleAndOffset(powered(grey, true), scale, bias));
}

std::optional<Node> OfLut1D(const Node& image, const lib::Lut1DTransform& t, const TableFilter* filter) {
  if (IsInverse(t) || t.getInputHalfDomain() || t.getOutputRawHalfs() || t.getHueAdjust() != lib::HUE_NONE) {
    return std::nullopt;
  }
  const unsigned long length = t.getLength();
  std::vector<float> channels[3];
  for (unsigned long i = 0; i < length; ++i) {
    float rgb[3];
    t.getValue(i, rgb[0], rgb[1], rgb[2]);
    for (int c = 0; c < 3; ++c) channels[c].push_back(rgb[c]);
  }
  Tables1DParams params;
  for (const std::vector<float>& samples : channels) {
    params.tables.emplace_back(std::vector<int>{static_cast<int>(length)}, 1, samples, TableAlign::kEnds);
  }
  if (filter != nullptr && *filter != TableFilter::kTetrahedral) params.filter = *filter;
  return ApplyTables1D(image, params);
}

std::optional<Node> OfLut3D(const Node& image, const lib::Lut3DTransform& t, const TableFilter* filter) {
  if (IsInverse(t)) return std::nullopt;
  const auto size = static_cast<int>(t.getGridSize());
  std::vector<float> samples;
  samples.reserve(static_cast<size_t>(size) * size * size * 3);
  for (int b = 0; b < size; ++b) {
    for (int g = 0; g < size; ++g) {
      for (int r = 0; r < size; ++r) {
        float rgb[3];
        t.getValue(static_cast<unsigned long>(r), static_cast<unsigned long>(g),
                   static_cast<unsigned long>(b), rgb[0], rgb[1], rgb[2]);
        samples.insert(samples.end(), rgb, rgb + 3);
      }
    }
  }
  Table3DParams params;
  const lib::Interpolation own = t.getInterpolation();
  params.filter = filter != nullptr                                           ? *filter
                  : own == lib::INTERP_TETRAHEDRAL || own == lib::INTERP_BEST ? TableFilter::kTetrahedral
                                                                              : TableFilter::kLinear;
  return ApplyTable3D(image, Table({size, size, size}, 3, samples, TableAlign::kEnds), params);
}

// Nodes of one transform, or nothing where it has none.
std::optional<Node> OfTransform(const Node& image, const lib::ConstTransformRcPtr& transform,
                                const TableFilter* filter) {
  const lib::Transform& t = *transform;
  switch (t.getTransformType()) {
    case lib::TRANSFORM_TYPE_MATRIX:
      return OfMatrix(image, dynamic_cast<const lib::MatrixTransform&>(t));
    case lib::TRANSFORM_TYPE_RANGE:
      return OfRange(image, dynamic_cast<const lib::RangeTransform&>(t));
    case lib::TRANSFORM_TYPE_CDL:
      return OfCdl(image, dynamic_cast<const lib::CDLTransform&>(t));
    case lib::TRANSFORM_TYPE_EXPONENT:
      return ApplyCurve(image, FormulasOf(dynamic_cast<const lib::ExponentTransform&>(t)));
    case lib::TRANSFORM_TYPE_EXPONENT_WITH_LINEAR:
      return ApplyCurve(image, FormulasOf(dynamic_cast<const lib::ExponentWithLinearTransform&>(t)));
    case lib::TRANSFORM_TYPE_LOG:
      return ApplyCurve(image, FormulasOf(dynamic_cast<const lib::LogTransform&>(t)));
    case lib::TRANSFORM_TYPE_LOG_AFFINE:
      return ApplyCurve(image, FormulasOf(dynamic_cast<const lib::LogAffineTransform&>(t)));
    case lib::TRANSFORM_TYPE_LOG_CAMERA:
      return ApplyCurve(image, FormulasOf(dynamic_cast<const lib::LogCameraTransform&>(t)));
    case lib::TRANSFORM_TYPE_LUT1D:
      return OfLut1D(image, dynamic_cast<const lib::Lut1DTransform&>(t), filter);
    case lib::TRANSFORM_TYPE_LUT3D:
      return OfLut3D(image, dynamic_cast<const lib::Lut3DTransform&>(t), filter);
    default:
      return std::nullopt;
  }
}

}  // namespace

Node Translate(const Node& image, const lib::ConstProcessorRcPtr& processor, const std::string& subject,
               const TableFilter* filter) {
  if (image.spec().channel_count() < 3) {
    return AsColors(image, [&](const Node& colors) { return Translate(colors, processor, subject, filter); });
  }
  return Guarded(subject, [&] {
    const lib::ConstProcessorRcPtr optimized =
        processor->getOptimizedProcessor(lib::BIT_DEPTH_F32, lib::BIT_DEPTH_F32, lib::OPTIMIZATION_LOSSLESS);
    const lib::GroupTransformRcPtr transforms = optimized->createGroupTransform();
    const lib::ConstConfigRcPtr raw = lib::Config::CreateRaw();
    Node node = image;
    lib::GroupTransformRcPtr rest = lib::GroupTransform::Create();
    const auto below = [&] {
      return rest->getNumTransforms() == 0 ? node : ApplyCpuProcessor(node, raw->getProcessor(rest));
    };
    for (int i = 0; i < transforms->getNumTransforms(); ++i) {
      const lib::TransformRcPtr transform = transforms->getTransform(i);
      if (const std::optional<Node> next = OfTransform(below(), transform, filter)) {
        node = *next;
        rest = lib::GroupTransform::Create();
      } else {
        rest->appendTransform(transform);
      }
    }
    node = below();
    return node;
  });
}

}  // namespace tessera::ocio

namespace tessera {

Node ApplyProcessor(const Node& image, const OCIO_NAMESPACE::ConstProcessorRcPtr& processor) {
  if (!processor) throw Error("processor", "is null, expected one of OpenColorIO's processors");
  return ocio::Translate(image, processor, "processor");
}

}  // namespace tessera
