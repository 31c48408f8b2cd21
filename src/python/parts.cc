// Images of which a part is here, and which part a region of a result needs.
#include <pybind11/stl.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/origin.h"
#include "python/core.h"
#include "tessera/prepared_graph.h"

namespace tessera::python {
namespace {

Roi RoiOf(const std::array<int, 4>& corners) { return {corners[0], corners[1], corners[2], corners[3]}; }

// `samples`: the part from (x0, y0) on; none of it for a planner, which knows the image's type and channels.
Held FromPartOf(const std::optional<Samples>& samples, int x0, int y0, const std::array<int, 4>& window,
                int count, const std::vector<std::string>& channels, const std::string& type,
                py::object owner) {
  ConstImageView view(nullptr, Roi(), count, TypeNamed(type));
  if (samples) view = ViewOf(*samples, x0, y0);
  const Roi all = RoiOf(window);
  ImageSpec spec(all.width(), all.height(), count, view.type);
  spec.data_window = spec.display_window = all;
  if (!channels.empty()) NameChannels(channels, spec);
  graph::Origin origin;
  origin.kind = graph::Origin::Kind::kPixels, origin.owner = Kept(std::move(owner));
  return {graph::WithOrigin(FromPart(view, spec), std::move(origin))};
}

}  // namespace

void AddParts(py::module_& core) {
  core.def("from_part", &FromPartOf);
  py::class_<PreparedGraph>(core, "Prepared")
      .def(py::init([](const Held& image, const py::dict& options) {
        std::unique_ptr<PreparedGraph> prepared;
        Evaluate(options,
                 [&](const RenderOptions& o) { prepared = std::make_unique<PreparedGraph>(image.node, o); });
        return prepared;
      }))
      .def("required", [](const PreparedGraph& graph, const Held& source, const std::array<int, 4>& out) {
        return TupleOf(graph.RequiredRegion(source.node, RoiOf(out)));
      });
}

}  // namespace tessera::python
