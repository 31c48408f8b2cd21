// Binds a tile's views to the look-up kernel.
#include "ops/geometry/gather_stage.h"

#include <algorithm>

#include "tessera/error.h"

namespace tessera::ops {
namespace {

class GatherStage final : public graph::TileStage {
 public:
  GatherStage(const GatherSettings& s, const graph::StageContext& context)
      : settings_(s),
        source_(context.whole[0], FindFilter("warp", s.filter), s.wrap_x, s.wrap_y, s.renormalize,
                context.workers),
        run_(ChooseGather()) {}

  Roi InputRoi(int, const Roi& out) const override { return out; }
  graph::TileSize Preferred() const override { return {256, 64}; }
  void Run(const graph::TileArgs& args) const override {
    GatherJob job{source_, settings_.map, {}, 0, 0, args.out, args.channels, args.scratch, args.stream};
    if (settings_.map.from_image) {
      const std::span<const int> present = args.in_channels[1];
      const auto place = [&](int channel) {
        return static_cast<int>(std::find(present.begin(), present.end(), channel) - present.begin());
      };
      job.coordinates = args.in[1];
      job.channel_x = place(settings_.channel_x);
      job.channel_y = place(settings_.channel_y);
    }
    run_(job);
  }

 private:
  GatherSettings settings_;
  GatherSource source_;
  GatherFunction run_;
};

}  // namespace

std::unique_ptr<graph::TileStage> MakeGatherStage(const GatherSettings& settings,
                                                  const graph::StageContext& context) {
  return std::make_unique<GatherStage>(settings, context);
}

void RequireWarpFilter(const std::string& subject, const std::string& name) {
  if (!FindFilter(subject, name).separable) {
    throw Error(subject, "found the filter \"" + name + "\", expected a separable one");
  }
}

}  // namespace tessera::ops
