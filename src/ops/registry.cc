// The list of operations: one line for each, in the order of the help.
#include "ops/registry.h"

#include <algorithm>

#include "ocio/ocio_ops.h"
#include "ops/accumulate/accumulate_ops.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/bump/bump_ops.h"
#include "ops/channels/channels_ops.h"
#include "ops/color/color_ops.h"
#include "ops/composite/composite_ops.h"
#include "ops/curve/curve_ops.h"
#include "ops/environment/environment_ops.h"
#include "ops/filter/filter_ops.h"
#include "ops/flow/flow_ops.h"
#include "ops/generate/generate_ops.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/lookup/lookup_ops.h"
#include "ops/noise/noise_ops.h"
#include "ops/shade/shade_ops.h"
#include "ops/volume/volume_ops.h"

namespace tessera::ops {

const std::vector<OpInfo>& Registry() {
  static const std::vector<OpInfo> kRows = {
      AddInfo(),
      SubInfo(),
      MulInfo(),
      MadInfo(),
      MinInfo(),
      MaxInfo(),
      AbsDiffInfo(),
      AddConstantInfo(),
      SubConstantInfo(),
      MulConstantInfo(),
      MinConstantInfo(),
      MaxConstantInfo(),
      AbsDiffConstantInfo(),
      AbsInfo(),
      InvertInfo(),
      ClampInfo(),
      QuantizeInfo(),
      PremultiplyInfo(),
      UnpremultiplyInfo(),
      ColorMatrixInfo(),
      SaturateInfo(),
      HueInfo(),
      LuminanceInfo(),
      CmyInfo(),
      CmykInfo(),
      YiqInfo(),
      InterpolateInfo(),
      BrightnessInfo(),
      ContrastInfo(),
      PowerConstantInfo(),
      CurveInfo(),
      TransferInfo(),
      LutInfo(),
      ColorConvertInfo(),
      OcioDisplayInfo(),
      OcioLookInfo(),
      OcioFileTransformInfo(),
      ConvolveInfo(),
      EmbossInfo(),
      LaplacianInfo(),
      HighPassInfo(),
      BlurInfo(),
      SobelInfo(),
      UnsharpInfo(),
      MedianInfo(),
      DilateInfo(),
      ErodeInfo(),
      AccumInfo(),
      AverageInfo(),
      ShiftAccumulateInfo(),
      DepthOfFieldInfo(),
      ResizeInfo(),
      MipInfo(),
      ZoomInfo(),
      ShiftInfo(),
      WarpInfo(),
      StWarpInfo(),
      DistortInfo(),
      TableInfo(),
      LookupInfo(),
      OverInfo(),
      ZOverInfo(),
      BlendInfo(),
      AlphaTestInfo(),
      DepthTestInfo(),
      StencilInfo(),
      DissolveInfo(),
      ThresholdsInfo(),
      RevealInfo(),
      ZCompositeInfo(),
      DepthComplexityInfo(),
      DecalsInfo(),
      EdgesInfo(),
      OutlineInfo(),
      HaloInfo(),
      AirbrushInfo(),
      PuffsInfo(),
      ConstantInfo(),
      CreateInfo(),
      CheckerInfo(),
      RampInfo(),
      WhiteNoiseInfo(),
      ValueNoiseInfo(),
      GradientNoiseInfo(),
      SimplexNoiseInfo(),
      CellNoiseInfo(),
      SparseNoiseInfo(),
      SpotNoiseInfo(),
      HashNoiseInfo(),
      NoiseAtInfo(),
      ShapedSpotsInfo(),
      SvgTurbulenceInfo(),
      SvgFractalNoiseInfo(),
      CloudsInfo(),
      MarbleInfo(),
      WoodInfo(),
      FireInfo(),
      SmokeInfo(),
      RipplesInfo(),
      GardnerInfo(),
      SelectChannelsInfo(),
      AppendChannelsInfo(),
      RenameChannelsInfo(),
      CropInfo(),
      LicInfo(),
      EqualizeInfo(),
      AovInfo(),
      DepthInfo(),
      PositionInfo(),
      TransformPointsInfo(),
      FogInfo(),
      LayerFogInfo(),
      ShadowInfo(),
      SoftShadowInfo(),
      DiffuseLightInfo(),
      SpotlightInfo(),
      SolidInfo(),
      EnvironmentInfo(),
      ConvertEnvironmentInfo(),
      PhongInfo(),
      NormalsInfo(),
      HeightNormalsInfo(),
      BumpInfo(),
      TangentNormalsInfo(),
      SurfaceBumpInfo(),
      CombineNormalsInfo(),
      VolumeInfo(),
  };
  return kRows;
}

const OpInfo* FindOp(const std::string& name) {
  const std::vector<OpInfo>& rows = Registry();
  const auto row =
      std::find_if(rows.begin(), rows.end(), [&name](const OpInfo& op) { return op.name == name; });
  return row == rows.end() ? nullptr : &*row;
}

}  // namespace tessera::ops
