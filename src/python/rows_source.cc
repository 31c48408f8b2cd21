// Images whose rows a Python function gives when they are needed.
#include <pybind11/stl.h>

#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "graph/origin.h"
#include "graph/source.h"
#include "python/core.h"
#include "tessera/error.h"

namespace tessera::python {
namespace {

// `function(y0, y1)` gives the Samples of those rows, counted from the image's first, and what keeps them.
class FunctionSource final : public graph::PixelSource {
 public:
  FunctionSource(py::object function, ImageSpec spec)
      : function_(Kept(std::move(function))), spec_(std::move(spec)) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "a function"; }
  std::unique_ptr<graph::RowReader> Open(int first, int last) const override {
    return std::make_unique<Reader>(*this, first, last);
  }

 private:
  class Reader final : public graph::RowReader {
   public:
    Reader(const FunctionSource& source, int first, int last) : source_(source), first_(first), last_(last) {}
    void Read(const ImageView& out) override {
      if (out.roi.empty()) return;
      const Roi& window = source_.spec_.data_window;
      const py::gil_scoped_acquire lock;
      const py::handle function(static_cast<PyObject*>(const_cast<void*>(source_.function_.get())));
      const auto given = function(out.roi.y0 - window.y0, out.roi.y1 - window.y0).cast<py::tuple>();
      const ImageView rows = ViewOf(given[0].cast<Samples>(), window.x0, out.roi.y0);
      if (rows.roi != out.roi || rows.channels != source_.spec_.channel_count() ||
          rows.type != source_.spec_.type) {
        throw Error("rows", "found " + std::to_string(rows.roi.height()) + " rows of " +
                                std::to_string(rows.roi.width()) + " x " + std::to_string(rows.channels) +
                                " samples of " + PixelTypeName(rows.type) + ", expected " +
                                std::to_string(out.roi.height()) + " of " + std::to_string(out.roi.width()) +
                                " x " + std::to_string(source_.spec_.channel_count()) + " of " +
                                PixelTypeName(source_.spec_.type));
      }
      const size_t sample = PixelBytes(rows.type);
      const bool packed = rows.channel_stride == static_cast<ptrdiff_t>(sample);
      for (int y = out.roi.y0; y < out.roi.y1; ++y) {
        for (int x = out.roi.x0; x < out.roi.x1; ++x) {
          std::byte* const to = out.At(x, y);
          if (packed) {
            std::memcpy(to, rows.At(x, y, first_), sample * static_cast<size_t>(last_ - first_));
            continue;
          }
          for (int c = first_; c < last_; ++c)
            std::memcpy(to + static_cast<size_t>(c - first_) * sample, rows.At(x, y, c), sample);
        }
      }
    }

   private:
    const FunctionSource& source_;
    const int first_, last_;
  };

  std::shared_ptr<const void> function_;
  ImageSpec spec_;
};

Held FromRows(py::object function, const std::array<int, 3>& shape, const std::string& type,
              const std::vector<std::string>& channels) {
  const auto [height, width, count] = shape;
  constexpr int kFarthest = 1 << 30;
  if (height < 1 || width < 1 || height > kFarthest || width > kFarthest || count < 1 || count > 1024) {
    throw Error("shape", "found " + std::to_string(height) + " x " + std::to_string(width) + " x " +
                             std::to_string(count) +
                             ", expected 1 to 2^30 rows and columns and 1 to 1024 channels");
  }
  ImageSpec spec(width, height, count, TypeNamed(type));
  if (!channels.empty()) NameChannels(channels, spec);
  graph::Origin origin;
  origin.kind = graph::Origin::Kind::kPixels;
  return {graph::WithOrigin(
      graph::MakeSource(std::make_shared<const FunctionSource>(std::move(function), std::move(spec))),
      std::move(origin))};
}

}  // namespace

void AddRowSources(py::module_& core) { core.def("from_rows", &FromRows); }

}  // namespace tessera::python
