// Preparation of environment maps.
#include "ops/environment/prepared.h"

#include <sstream>
#include <string>

#include "base/digest.h"
#include "ops/environment/lookup.h"
#include "tessera/context.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace ops {
namespace {

// The table of a lobe: of the same map the one that is kept, as where frames follow each other.
std::shared_ptr<const EnvironmentAtlas> KeptLobeTable(const ConstImageView& picture, int first,
                                                      const MapLayout& layout, const EnvironmentParams& p,
                                                      const graph::Workers& workers) {
  std::ostringstream key;
  key.precision(17);
  key << "lobe table " << base::DigestText(picture) << static_cast<int>(p.map) << ' ' << first << ' '
      << p.field_of_view << ' ' << p.lobe << ' ' << p.table << ' ' << SimdTarget();
  const auto side = static_cast<size_t>(p.table > 0 ? p.table : LobeTableSize(p.lobe)) + 2;
  return workers.context().Cached<EnvironmentAtlas>(key.str(), 6 * side * side * 4 * sizeof(float), [&] {
    return MakeLobeTable(picture, first, layout, p.lobe, p.table, workers);
  });
}

}  // namespace

PreparedEnvironment::PreparedEnvironment(const ConstImageView& picture, const EnvironmentParams& p, bool kept,
                                         const graph::Workers& workers) {
  const MapLayout layout =
      LayoutOf("envmap", p.map, picture.roi.width(), picture.roi.height(), p.field_of_view);
  empty = layout.faces.empty();
  for (int first = 0; first < picture.channels && !empty; first += 4) {
    if (p.lobe > 0 && p.table < 0) {
      samples.push_back(std::make_shared<const LobeSamples>(picture, first, layout, 0));
    } else if (p.lobe > 0) {
      atlases.push_back(KeptLobeTable(picture, first, layout, p, workers));
    } else {
      const auto atlas = std::make_shared<EnvironmentAtlas>(picture, first, layout, workers);
      if (p.filter != EnvironmentFilter::kBilinear)
        mips.push_back(std::make_shared<const EnvironmentMips>(*atlas, workers));
      if (kept) atlas->HoldHalves(ChooseEnvironmentKernels().to_half, workers);
      atlases.push_back(atlas);
    }
  }
}

}  // namespace ops

std::shared_ptr<const ops::PreparedEnvironment> EnvironmentTexture::Data::Prepared(
    const graph::Workers& workers) const {
  std::call_once(once, [&] {
    prepared = std::make_shared<const ops::PreparedEnvironment>(picture.view(), params, true, workers);
  });
  return prepared;
}

EnvironmentTexture::EnvironmentTexture(const Image& map, EnvironmentMap projection, double lobe, int table,
                                       EnvironmentFilter filter, double field_of_view) {
  const auto data = std::make_shared<Data>();
  data->picture = Render(FromImage(map));
  data->params.map = projection;
  data->params.lobe = lobe;
  data->params.table = table;
  data->params.filter = filter;
  data->params.field_of_view = field_of_view;
  ops::RequireFieldOfView("environment texture", "field_of_view", projection, field_of_view);
  ops::LayoutOf("environment texture", projection, map.spec().width(), map.spec().height(), field_of_view);
  data_ = data;
}

}  // namespace tessera
