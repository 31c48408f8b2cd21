// The stages of blending, one factory for each group of modes.
#ifndef TESSERA_OPS_COMPOSITE_BLEND_KERNELS_H_
#define TESSERA_OPS_COMPOSITE_BLEND_KERNELS_H_

#include <cstdint>
#include <memory>

#include "base/stage.h"
#include "tessera/ops/composite.h"

namespace tessera::ops {

// What a plane of a block holds. Depth is never mixed: it is the front image's where that has alpha, else the
// other's.
enum class ChannelRole : uint8_t { kColor, kAlpha, kDepth };

// How a stage's planes come. kRgba: two inputs, planes R, G, B, A; may run on the pixels themselves. kPlanes:
// four inputs, both images' planes in any order of channels and both alphas, each in all four planes; `roles`
// and `constant` say what the planes are.
struct BlendPlanes {
  enum class Form : uint8_t { kRgba, kPlanes } form = Form::kRgba;
  ChannelRole roles[4] = {ChannelRole::kColor, ChannelRole::kColor, ChannelRole::kColor, ChannelRole::kAlpha};
};

// The six Porter-Duff operators from which the others follow by exchanging the images. kOverClamped limits
// alpha to [0, 1] first, as oiiotool does.
enum class PorterDuff : uint8_t { kOver, kOverClamped, kIn, kOut, kAtop, kXor, kPlus };
std::unique_ptr<graph::PointStage> MakePorterDuffStage(PorterDuff op, const BlendPlanes& planes);

// Separable modes of compositing in which every channel is treated by itself; kOverlay is kHardLight
// exchanged.
std::unique_ptr<graph::PointStage> MakeSeparableStage(BlendMode mode, const BlendPlanes& planes);

// kHue, kSaturation, kColor, kLuminosity: planes R, G, B, A only.
std::unique_ptr<graph::PointStage> MakeNonSeparableStage(BlendMode mode);

// An equation of GL with its factors, resolved from a mode.
struct GlBlend {
  enum class Equation : uint8_t { kAdd, kSubtract, kReverseSubtract, kMin, kMax } equation = Equation::kAdd;
  BlendFactor source = BlendFactor::kOne, destination = BlendFactor::kOne;
  BlendFactor source_alpha = BlendFactor::kOne, destination_alpha = BlendFactor::kOne;
};
// `constant`: the constant colour as the four planes see it; `constant_alpha` its alpha.
std::unique_ptr<graph::PointStage> MakeGlStage(const GlBlend& blend, const BlendPlanes& planes,
                                               const float (&constant)[4], float constant_alpha);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_COMPOSITE_BLEND_KERNELS_H_
