// The list of operations: one line for each, in the order of the help, and what components add to it.
#include "ops/registry.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <list>
#include <mutex>
#include <string_view>

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
#include "ops/grade/grade_ops.h"
#include "ops/lens/lens_ops.h"
#include "ops/lookup/lookup_ops.h"
#include "ops/noise/noise_ops.h"
#include "ops/restore/restore_ops.h"
#include "ops/shade/shade_ops.h"
#include "ops/volume/volume_ops.h"

namespace tessera::ops {
namespace {

std::vector<OpInfo> OwnRows() {
  return {
      AddInfo(),
      SubInfo(),
      MulInfo(),
      DivInfo(),
      MadInfo(),
      MinInfo(),
      MaxInfo(),
      AbsDiffInfo(),
      AddConstantInfo(),
      SubConstantInfo(),
      MulConstantInfo(),
      DivConstantInfo(),
      MinConstantInfo(),
      MaxConstantInfo(),
      AbsDiffConstantInfo(),
      AbsInfo(),
      InvertInfo(),
      ClampInfo(),
      ThresholdInfo(),
      QuantizeInfo(),
      FixNanInfo(),
      PremultiplyInfo(),
      RepremultiplyInfo(),
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
      RangeCompressInfo(),
      RangeExpandInfo(),
      ExposureInfo(),
      WhiteBalanceInfo(),
      GradeInfo(),
      CdlInfo(),
      LevelsInfo(),
      AutoLevelsInfo(),
      VibranceInfo(),
      CurvesInfo(),
      KeyInfo(),
      DespillInfo(),
      PowerConstantInfo(),
      CurveInfo(),
      TransferInfo(),
      ColorStateInfo(),
      ConvolveInfo(),
      EmbossInfo(),
      LaplacianInfo(),
      HighPassInfo(),
      BlurInfo(),
      SobelInfo(),
      UnsharpInfo(),
      BilateralInfo(),
      NonLocalMeansInfo(),
      DebandInfo(),
      MedianInfo(),
      DilateInfo(),
      ErodeInfo(),
      MorphologyInfo(),
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
      FlipInfo(),
      FlopInfo(),
      Rotate90Info(),
      Rotate180Info(),
      Rotate270Info(),
      TransposeInfo(),
      CircularShiftInfo(),
      TileableInfo(),
      ReorientInfo(),
      OriginInfo(),
      OriginOffsetInfo(),
      FullSizeInfo(),
      FullPixelsInfo(),
      CropToFullInfo(),
      RotateInfo(),
      ResampleInfo(),
      FitInfo(),
      PasteInfo(),
      MosaicInfo(),
      LensInfo(),
      AberrationInfo(),
      VignetteInfo(),
      GrainInfo(),
      TableInfo(),
      ColorMapInfo(),
      LookupInfo(),
      OverInfo(),
      ZOverInfo(),
      FillHolesInfo(),
      BlendInfo(),
      TextureEnvironmentInfo(),
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
      LightPointsInfo(),
      PaintInfo(),
      ConstantInfo(),
      CreateInfo(),
      CheckerInfo(),
      RampInfo(),
      FillInfo(),
      AddNoiseInfo(),
      WhiteNoiseInfo(),
      ValueNoiseInfo(),
      GradientNoiseInfo(),
      SimplexNoiseInfo(),
      CellNoiseInfo(),
      SparseNoiseInfo(),
      SpotNoiseInfo(),
      HashNoiseInfo(),
      GaborNoiseInfo(),
      NoiseAtInfo(),
      ShapedSpotsInfo(),
      SvgTurbulenceInfo(),
      SvgFractalNoiseInfo(),
      SvgTurbulenceAtInfo(),
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
      ChannelSumInfo(),
      MaxChannelInfo(),
      MinChannelInfo(),
      MeanInfo(),
      CropInfo(),
      CutInfo(),
      LicInfo(),
      SurfaceFieldInfo(),
      EqualizeInfo(),
      AovInfo(),
      DepthInfo(),
      PositionInfo(),
      TransformPointsInfo(),
      ReprojectInfo(),
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
      HeightOcclusionInfo(),
      HeightCurvatureInfo(),
      TangentNormalsInfo(),
      SurfaceBumpInfo(),
      CombineNormalsInfo(),
      VolumeInfo(),
  };
}

// The list, and earlier ones whose rows somebody may hold.
struct Lists {
  std::mutex mutex;
  std::vector<Component> components;
  std::list<std::vector<OpInfo>> all;
  std::atomic<const std::vector<OpInfo>*> newest = nullptr;
};
Lists& TheLists() {
  static Lists lists;
  return lists;
}

}  // namespace

const std::vector<OpInfo>& Registry() {
  Lists& lists = TheLists();
  if (const auto* const rows = lists.newest.load(std::memory_order_acquire)) return *rows;
  const std::lock_guard lock(lists.mutex);
  if (const auto* const rows = lists.newest.load(std::memory_order_acquire)) return *rows;
  std::vector<OpInfo> rows = OwnRows();
  for (const Component& component : lists.components) {
    const auto before =
        std::find_if(rows.begin(), rows.end(), [&](const OpInfo& op) { return op.name == component.behind; });
    std::vector<OpInfo> more = component.rows();
    rows.insert(before == rows.end() ? before : before + 1, std::make_move_iterator(more.begin()),
                std::make_move_iterator(more.end()));
  }
  lists.all.push_back(std::move(rows));
  lists.newest.store(&lists.all.back(), std::memory_order_release);
  return lists.all.back();
}

void AddComponent(const Component& component) {
  Lists& lists = TheLists();
  const std::lock_guard lock(lists.mutex);
  for (const Component& present : lists.components) {
    if (std::string_view(present.name) == component.name) return;
  }
  lists.components.push_back(component);
  lists.newest.store(nullptr, std::memory_order_release);
}

const OpInfo* FindOp(const std::string& name) {
  const std::vector<OpInfo>& rows = Registry();
  const auto row =
      std::find_if(rows.begin(), rows.end(), [&name](const OpInfo& op) { return op.name == name; });
  return row == rows.end() ? nullptr : &*row;
}

}  // namespace tessera::ops
