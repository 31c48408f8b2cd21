// Images for Python: files, arrays, operations; what an image is.
#include <pybind11/stl.h>

#include <array>
#include <cstring>
#include <map>
#include <memory>
#include <optional>

#include "graph/op.h"
#include "graph/origin.h"
#include "graph/source.h"
#include "ops/apply.h"
#include "python/core.h"
#include "tessera/color_state.h"
#include "tessera/error_kind.h"
#include "tessera/graph_json.h"
#include "tessera/io.h"
#include "tessera/metadata.h"

namespace tessera::python {
namespace {

constexpr int64_t kFarthest = 1 << 30;

ImageSpec SpecOf(const ConstImageView& view, const std::vector<std::string>& channels) {
  ImageSpec spec(view.roi.width(), view.roi.height(), view.channels, view.type);
  spec.data_window = spec.display_window = view.roi;
  if (!channels.empty()) NameChannels(channels, spec);
  return spec;
}

Held FromArray(const Samples& samples, const std::vector<std::string>& channels, int x0, int y0,
               const std::optional<std::array<int, 4>>& display, py::object owner) {
  const ConstImageView view = ViewOf(samples, x0, y0);
  ImageSpec spec = SpecOf(view, channels);
  if (display) spec.display_window = {(*display)[0], (*display)[1], (*display)[2], (*display)[3]};
  graph::Origin origin;
  origin.kind = graph::Origin::Kind::kPixels, origin.owner = Kept(std::move(owner));
  return {graph::WithOrigin(FromView(view, spec), std::move(origin))};
}

Held ReadFile(const std::string& file, int subimage, const std::string& part, bool all_formats) {
  const py::gil_scoped_release unlocked;
  ReadOptions options;
  options.subimage = subimage, options.part = part;
  if (all_formats) options.formats = Formats::kAll;
  return {Read(file, options)};
}

Held ApplyNamed(const std::string& name, const std::vector<Held>& images, const Values& values) {
  const py::gil_scoped_release unlocked;
  const ops::OpInfo& op = ops::OpNamed(name);
  if (op.generator) throw Error(name, "makes an image from nothing, expected a size");
  const ops::Arguments arguments = ops::ArgumentsNamed(op, values);
  const auto wanted = static_cast<size_t>(op.Operands(arguments));
  if (images.size() != wanted) {
    throw Error(name,
                "found " + std::to_string(images.size()) + " images, expected " + std::to_string(wanted));
  }
  std::vector<Node> inputs;
  for (const Held& image : images) inputs.push_back(image.node);
  return {ops::Apply(op, inputs, arguments, nullptr)};
}

Held Generate(const std::string& name, const std::array<int, 4>& window, int channels, const Values& values) {
  const py::gil_scoped_release unlocked;
  const ops::OpInfo& op = ops::OpNamed(name);
  if (!op.generator) throw Error(name, "takes images, expected one of the generators");
  if (channels < 1 || channels > 1024)
    throw Error("channels", "found " + std::to_string(channels) + ", expected 1 to 1024");
  const Roi roi{window[0], window[1], window[2], window[3]};
  if (roi.empty()) throw Error("size", "found no pixel, expected a width and a height of at least 1");
  ImageSpec spec(roi.width(), roi.height(), channels);
  spec.data_window = spec.display_window = roi;
  return {ops::Apply(op, {}, ops::ArgumentsNamed(op, values), &spec)};
}

// Numbers and strings as they are, everything else in words.
py::object ValueOf(const Attribute& a) {
  if (!a.strings.empty())
    return a.strings.size() == 1 ? py::object(py::str(a.strings[0])) : py::cast(a.strings);
  const auto number = [&a]<typename T>(T value) {
    std::memcpy(&value, a.bytes.data(), sizeof value);
    return py::cast(value);
  };
  if (a.type == "int" && a.bytes.size() == 4) return number(int32_t{});
  if (a.type == "uint" && a.bytes.size() == 4) return number(uint32_t{});
  if (a.type == "float" && a.bytes.size() == 4) return number(0.0F);
  if (a.type == "double" && a.bytes.size() == 8) return number(0.0);
  return py::str(AttributeText(a));
}

py::dict MetadataOf(const Held& image) {
  py::dict items;
  const auto& metadata = image.node.spec().metadata;
  if (metadata == nullptr) return items;
  for (const Attribute& a : *metadata) items[py::str(a.name)] = ValueOf(a);
  return items;
}

// Whether one of the graph's sources has pixels in that memory.
bool ReadsMemory(const Held& image, uintptr_t first, uintptr_t last) {
  std::vector<const graph::NodeData*> left = {image.node.data()}, seen;
  while (!left.empty()) {
    const graph::NodeData* const data = left.back();
    left.pop_back();
    if (std::find(seen.begin(), seen.end(), data) != seen.end()) continue;
    seen.push_back(data);
    for (const Node& input : data->inputs) left.push_back(input.data());
    if (data->op->Kind() != graph::OpKind::kSource) continue;
    const auto view = static_cast<const graph::SourceOp&>(*data->op).source().View();
    if (!view || view->roi.empty()) continue;
    auto low = reinterpret_cast<intptr_t>(view->data),
         high = low + static_cast<intptr_t>(PixelBytes(view->type));
    for (const ptrdiff_t reach :
         {view->channel_stride * (view->channels - 1), view->pixel_stride * (view->roi.width() - 1),
          view->row_stride * (view->roi.height() - 1)}) {
      (reach < 0 ? low : high) += reach;
    }
    if (low < static_cast<intptr_t>(last) && static_cast<intptr_t>(first) < high) return true;
  }
  return false;
}

// memoryview(image), and everything that asks for a buffer: new float pixels each time, made by the package.
int GetBuffer(PyObject* image, Py_buffer* view, int flags) {
  try {
    const py::object pixels = py::reinterpret_borrow<py::object>(image).attr("render")();
    return PyObject_GetBuffer(pixels.ptr(), view, flags);
  } catch (py::error_already_set& e) {
    e.restore();
  }
  view->obj = nullptr;
  return -1;
}

}  // namespace

PixelType TypeNamed(const std::string& name) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    if (name == PixelTypeName(type)) return type;
  }
  throw Error("type", "found \"" + name + "\", expected uint8, uint16, half or float");
}

py::tuple TupleOf(const Roi& r) { return py::make_tuple(r.x0, r.y0, r.x1, r.y1); }

std::shared_ptr<const void> Kept(py::object object) {
  return {object.release().ptr(), [](const void* kept) {
            if (Py_IsInitialized() == 0) return;
            const py::gil_scoped_acquire lock;
            Py_DECREF(static_cast<PyObject*>(const_cast<void*>(kept)));
          }};
}

void NameChannels(const std::vector<std::string>& channels, ImageSpec& spec) {
  if (channels.size() != spec.channels.size()) {
    throw Error("channels", "found " + std::to_string(channels.size()) + " names, expected " +
                                std::to_string(spec.channels.size()));
  }
  spec.channels = channels, spec.alpha = spec.ChannelIndex("A");
}

ImageView ViewOf(const Samples& samples, int x0, int y0) {
  if (samples.shape.size() != 3 || samples.strides.size() != 3)
    throw Error("array", "found " + std::to_string(samples.shape.size()) + " axes, expected 3");
  const int64_t height = samples.shape[0], width = samples.shape[1], channels = samples.shape[2];
  if (height < 1 || width < 1 || height > kFarthest || width > kFarthest)
    throw Error("array", "found " + std::to_string(height) + " rows of " + std::to_string(width) +
                             " pixels, expected 1 to 2^30 of both");
  if (channels < 1 || channels > 1024)
    throw Error("array", "found " + std::to_string(channels) + " channels, expected 1 to 1024");
  if (std::abs(int64_t{x0}) > kFarthest || std::abs(int64_t{y0}) > kFarthest)
    throw Error("origin", "found a coordinate beyond 2^30");
  const PixelType type = TypeNamed(samples.type);
  const auto bytes = static_cast<int64_t>(PixelBytes(type));
  for (const int64_t stride : samples.strides) {
    if (stride % bytes != 0 || samples.address % static_cast<uintptr_t>(bytes) != 0)
      throw Error("array", "found samples that are not aligned, expected multiples of " +
                               std::to_string(bytes) + " bytes; copy it first");
  }
  const Roi roi{x0, y0, x0 + static_cast<int>(width), y0 + static_cast<int>(height)};
  return {reinterpret_cast<std::byte*>(samples.address),
          roi,
          static_cast<int>(channels),
          type,
          samples.strides[2],
          samples.strides[1],
          samples.strides[0]};
}

void AddImages(py::module_& core) {
  py::class_<Samples>(core, "Samples")
      .def(py::init<uintptr_t, std::vector<int64_t>, std::vector<int64_t>, std::string>());
  py::class_<Held>(core, "Image", py::custom_type_setup([](PyHeapTypeObject* type) {
                     type->as_buffer.bf_getbuffer = &GetBuffer;
                     type->ht_type.tp_as_buffer = &type->as_buffer;
                   }))
      .def(py::init<const Held&>())
      .def_property_readonly("data_window", [](const Held& h) { return TupleOf(h.node.spec().data_window); })
      .def_property_readonly("display_window",
                             [](const Held& h) { return TupleOf(h.node.spec().display_window); })
      .def_property_readonly("channels", [](const Held& h) { return h.node.spec().channels; })
      .def_property_readonly("alpha", [](const Held& h) { return h.node.spec().alpha; })
      .def_property_readonly("type", [](const Held& h) { return PixelTypeName(h.node.spec().type); })
      .def_property_readonly("metadata", &MetadataOf)
      .def_property_readonly("color_space", [](const Held& h) { return ColorStateOf(h.node.spec()).space; })
      .def("_reads_memory", &ReadsMemory);
  core.def("read", &ReadFile);
  core.def("subimages", [](const std::string& file) { return Subimages(file); });
  core.def("from_array", &FromArray);
  core.def("to_json", [](const Held& image) {
    GraphJson graph = ToJson(image.node);
    std::vector<std::pair<std::string, Held>> inputs;
    for (auto& [name, node] : graph.inputs) inputs.emplace_back(name, Held{node});
    return py::make_tuple(graph.text, inputs);
  });
  core.def("from_json", [](const std::string& text, const std::map<std::string, Held>& images) {
    const py::gil_scoped_release unlocked;
    std::map<std::string, Node> nodes;
    for (const auto& [name, image] : images) nodes[name] = image.node;
    return Held{FromJson(text, nodes)};
  });
  core.def("graph_inputs", &GraphInputs);
  core.def("as_input",
           [](const Held& image, const std::string& name) { return Held{AsInput(image.node, name)}; });
  core.def("apply", &ApplyNamed);
  core.def("generate", &Generate);
}

}  // namespace tessera::python
