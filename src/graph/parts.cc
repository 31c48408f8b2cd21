// Pictures in parts: which pixels of sources a part of a result needs, and evaluations that have no others.
#include "graph/parts.h"

#include <algorithm>
#include <string>
#include <unordered_set>

#include "base/geometry_text.h"
#include "graph/little_memory.h"
#include "graph/source.h"
#include "graph/topology.h"
#include "tessera/error_kind.h"
#include "tessera/prepared_graph.h"

namespace tessera {
namespace graph {
namespace {

class PartSource final : public PixelSource {
 public:
  PartSource(const ConstImageView& part, ImageSpec spec) : part_(part), spec_(std::move(spec)) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "memory"; }
  std::optional<ConstImageView> View() const override { return part_; }

 private:
  ConstImageView part_;
  ImageSpec spec_;
};

bool IsPart(const PixelSource& source) {
  const auto view = source.View();
  return view && view->roi != source.spec().data_window;
}

}  // namespace

void RequireNoWholeOfPart(const Node& root) {
  std::unordered_set<const NodeData*> of_parts;
  for (const Node& node : TopologicalOrder(root)) {
    const NodeData& d = *node.data();
    if (d.op->Kind() == OpKind::kSource) {
      if (IsPart(static_cast<const SourceOp&>(*d.op).source())) of_parts.insert(&d);
      continue;
    }
    for (size_t k = 0; k < d.inputs.size(); ++k) {
      if (of_parts.count(d.inputs[k].data()) == 0) continue;
      of_parts.insert(&d);
      if (d.op->Kind() != OpKind::kWhole && !d.op->NeedsWhole(static_cast<int>(k))) continue;
      const LittleMemory* const little = AsLittleMemory(*d.op);
      const std::string other = little != nullptr ? little->InParts() : "";
      throw DataError(
          d.op->Name(),
          "found a part of image " + std::to_string(k) + ", all of which it needs (" + d.op->Describe() +
              "), expected " +
              (other.empty() ? "an operation that reads a region for a region, or the whole image" : other));
    }
  }
}

void RequireParts(const Plan& plan, const Roi& out) {
  const auto is_part = [](const PlannedSource& s) { return IsPart(*s.source); };
  if (std::none_of(plan.sources.begin(), plan.sources.end(), is_part)) return;
  const std::vector<Roi> regions = RequiredRegions(plan, out);
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    const auto view = plan.sources[k].source->View();
    if (!view || view->roi.Contains(regions[k])) continue;
    throw DataError("part", "found pixels " + base::GeometryText(view->roi) + " of an image, expected " +
                                base::GeometryText(regions[k]));
  }
}

}  // namespace graph

Node FromPart(const ConstImageView& part, const ImageSpec& spec) {
  if (part.channels != spec.channel_count() || !spec.data_window.Contains(part.roi)) {
    throw Error("part", "found pixels " + base::GeometryText(part.roi) + " of " +
                            std::to_string(part.channels) + " channels, expected a part of " +
                            base::GeometryText(spec.data_window) + " of " +
                            std::to_string(spec.channel_count()));
  }
  if (part.data == nullptr && !part.roi.empty()) throw Error("part", "found no pixels, expected an address");
  ImageSpec s = spec;
  s.type = part.type;
  return graph::MakeSource(std::make_shared<const graph::PartSource>(part, std::move(s)));
}

}  // namespace tessera
