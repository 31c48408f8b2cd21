// The stages that choose between pixels: tests, depth, stencil, threshold, mask.
#ifndef TESSERA_OPS_COMPOSITE_PICK_KERNELS_H_
#define TESSERA_OPS_COMPOSITE_PICK_KERNELS_H_

#include <memory>

#include "base/stage.h"
#include "ops/composite/blend_kernels.h"

namespace tessera::ops {

// The most images that are sorted by depth.
inline constexpr int kMostSorted = 256;

// All are point operations on any channels; images of one channel (alphas, depths, masks) are in all four
// planes. Inputs in this order: a, b, alpha a, alpha b, depth a, depth b
std::unique_ptr<graph::PointStage> MakeZOverStage(const ChannelRole (&roles)[4], bool zero_is_infinite);
// a, alpha a
std::unique_ptr<graph::PointStage> MakeAlphaTestStage(const AlphaTestParams& p);
// a, b, depth a, depth b
std::unique_ptr<graph::PointStage> MakeDepthTestStage(const ChannelRole (&roles)[4],
                                                      const DepthTestParams& p);
// a, b, stencil / stencil
std::unique_ptr<graph::PointStage> MakeStencilSelectStage(const StencilParams& p);
std::unique_ptr<graph::PointStage> MakeStencilUpdateStage(const StencilParams& p);
// a, b, pattern: b where pattern < threshold
std::unique_ptr<graph::PointStage> MakeThresholdStage(float threshold);
// a, b, mask
std::unique_ptr<graph::PointStage> MakeRevealStage();
// n images, n alphas, n depths (alphas are not read where `over` is false)
std::unique_ptr<graph::PointStage> MakeDepthMergeStage(int images, bool over, const ChannelRole (&roles)[4]);
// n depths
std::unique_ptr<graph::PointStage> MakeDepthCountStage(int images, float far);
// base, its alpha, n decals, n alphas
std::unique_ptr<graph::PointStage> MakeDecalStage(int decals, float threshold, const ChannelRole (&roles)[4]);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_COMPOSITE_PICK_KERNELS_H_
