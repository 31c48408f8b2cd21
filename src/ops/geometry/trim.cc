// The window that holds what is not zero: one pass over the image.
#include <algorithm>
#include <climits>
#include <memory>

#include "graph/render.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"

namespace tessera {
namespace {

class NonZeroSink final : public graph::RowSink {
 public:
  void Write(const ConstImageView& rows) override {
    const int64_t samples = int64_t{rows.roi.width()} * rows.channels;
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      const auto* const row = reinterpret_cast<const float*>(rows.At(rows.roi.x0, y));
      const auto is_zero = [](float v) { return v == 0; };
      const int64_t first = std::find_if_not(row, row + samples, is_zero) - row;
      if (first == samples) continue;
      int64_t last = samples - 1;
      while (row[last] == 0) --last;
      const Roi here{rows.roi.x0 + static_cast<int>(first / rows.channels), y,
                     rows.roi.x0 + static_cast<int>(last / rows.channels) + 1, y + 1};
      window_ = Union(window_, here);
    }
  }
  const Roi& window() const { return window_; }

 private:
  Roi window_;
};

}  // namespace

Roi NonZeroWindow(const Node& image, const RenderOptions& options) {
  const Roi& all = image.spec().data_window;
  if (all.empty()) return {};
  NonZeroSink sink;
  graph::RenderToSink(image, PixelType::kFloat, sink, options);
  return sink.window().empty() ? Roi{all.x0, all.y0, all.x0 + 1, all.y0 + 1} : sink.window();
}

Node Trim(const Node& image, const RenderOptions& options) {
  const Roi window = NonZeroWindow(image, options);
  return window == image.spec().data_window ? image : Crop(image, window);
}

}  // namespace tessera
