// The list of operations: one line for each, in the order of the help.
#include "ops/registry.h"

#include <algorithm>

#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/channels/channels_ops.h"
#include "ops/color/color_ops.h"
#include "ops/generate/generate_ops.h"

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
      ConstantInfo(),
      CreateInfo(),
      CheckerInfo(),
      RampInfo(),
      SelectChannelsInfo(),
      AppendChannelsInfo(),
      RenameChannelsInfo(),
      CropInfo(),
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
