// Registry rows of the composite family, and what its operations share: the op itself, windows, channels with
// a role.
#ifndef TESSERA_OPS_COMPOSITE_COMPOSITE_OPS_H_
#define TESSERA_OPS_COMPOSITE_COMPOSITE_OPS_H_

#include <algorithm>
#include <any>
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/composite/blend_kernels.h"
#include "ops/registry.h"

namespace tessera::ops {

OpInfo OverInfo();
OpInfo ZOverInfo();
OpInfo FillHolesInfo();
OpInfo BlendInfo();
OpInfo TextureEnvironmentInfo();
OpInfo AlphaTestInfo();
OpInfo DepthTestInfo();
OpInfo StencilInfo();
OpInfo DissolveInfo();
OpInfo ThresholdsInfo();
OpInfo RevealInfo();
OpInfo ZCompositeInfo();
OpInfo DepthComplexityInfo();
OpInfo DecalsInfo();
OpInfo EdgesInfo();
OpInfo OutlineInfo();
OpInfo HaloInfo();
OpInfo AirbrushInfo();
OpInfo PuffsInfo();
OpInfo LightPointsInfo();
OpInfo PaintInfo();

// A point operation of this family: what tells them apart is only the stage.
class CompositeOp final : public graph::Op {
 public:
  struct Traits {
    std::string name, description;
    std::any parameters;
    ImageSpec spec;     // of the result
    bool rgba = false;  // kColor, planes R, G, B, A; else kChannel
    std::function<std::unique_ptr<graph::PointStage>(const graph::StageContext&)> make;
  };
  explicit CompositeOp(Traits traits) : t_(std::move(traits)) {}

  std::string Name() const override { return t_.name; }
  std::string Describe() const override { return t_.description.empty() ? t_.name : t_.description; }
  graph::OpKind Kind() const override { return t_.rgba ? graph::OpKind::kColor : graph::OpKind::kChannel; }
  const std::any& Parameters() const override { return t_.parameters; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override { return t_.spec; }
  bool ReadsAlpha() const override { return true; }
  bool WritesAlpha() const override { return t_.spec.alpha >= 0; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    return t_.make(context);
  }

 private:
  Traits t_;
};
Node MakeCompositeNode(CompositeOp::Traits traits, std::vector<Node> inputs);

// All of `images` grown to the window that covers them; Error where channel counts differ. The first one's
// spec, with that window and a display window that covers all of theirs, is the result's.
struct Layers {
  std::vector<Node> images;
  ImageSpec spec;
};
Layers MakeLayers(const std::string& op, const std::vector<Node>& images);

// The one channel of an image.
Node ChannelOf(const Node& image, int channel);
// The image's alpha as one channel; 1 where it has none.
Node AlphaOf(const Node& image);
// The depth channel: by name or number, or where `channel` is empty the first whose name ends in Z or depth;
// -1 when there is none and none was asked for.
int FindDepth(const std::string& op, const ImageSpec& spec, const std::string& channel);
// The same; Error lists the channels when there is none.
int RequireDepth(const std::string& op, const ImageSpec& spec, const std::string& channel);

// The roles of the planes of a stage; `depth` is the depth channel or -1.
std::array<ChannelRole, 4> RolesOf(const graph::StageContext& context, int depth);

// A modifier that names a depth channel.
ParamInfo DepthModifier();
// The place of `word` among `words`, which has it.
template <typename Enum>
Enum ChoiceOf(const std::vector<std::string>& words, const std::string& word) {
  return static_cast<Enum>(std::find(words.begin(), words.end(), word) - words.begin());
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_COMPOSITE_COMPOSITE_OPS_H_
