// Counts the pixels whose coordinates have no place in a table.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "graph/render.h"
#include "model/table_axis.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/lookup.h"

namespace tessera {
namespace {

// Rows of coordinates in their order.
class LostSink final : public graph::RowSink {
 public:
  LostSink(std::vector<int> channels, int dims, const LookupParams& params)
      : channels_(std::move(channels)), dims_(dims), params_(params) {}

  void Write(const ConstImageView& rows) override {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      for (int x = rows.roi.x0; x < rows.roi.x1; ++x) {
        Count(reinterpret_cast<const float*>(rows.At(x, y)), x, y);
      }
    }
  }
  const LostCoordinates& lost() const { return lost_; }

 private:
  void Count(const float* pixel, int x, int y) {
    if (params_.mask >= 0 && (pixel[params_.mask] == 0 || std::isnan(pixel[params_.mask]))) return;
    ++lost_.pixels;
    float divisor = 1;
    if (params_.projective) divisor = pixel[channels_[static_cast<size_t>(dims_)]];
    const bool behind = !(divisor >= std::numeric_limits<float>::min());
    bool no_number = false;
    for (int a = 0; a < dims_ && !behind; ++a) {
      // A size matters to the reduction no more than the alignment does.
      const model::TableAxis axis{.wrap = model::WrapOf(params_.wrap, a)};
      no_number |= std::isnan(axis.Reduce(pixel[channels_[static_cast<size_t>(a)]] / divisor));
    }
    if (!behind && !no_number) return;
    if (lost_.behind + lost_.not_a_number == 0) lost_.first_x = x, lost_.first_y = y;
    ++(behind ? lost_.behind : lost_.not_a_number);
  }

  std::vector<int> channels_;
  int dims_;
  const LookupParams& params_;
  LostCoordinates lost_;
};

}  // namespace

std::string LostCoordinates::Summary() const {
  const auto of = " of " + std::to_string(pixels) + " pixels";
  if (not_a_number + behind == 0)
    return "all " + std::to_string(pixels) + " pixels have a place in the table";
  std::string text = std::to_string(not_a_number) + of + " have coordinates that are no numbers";
  if (behind > 0) text += ", " + std::to_string(behind) + " lie behind the projector";
  return text + "; the first at " + std::to_string(first_x) + "," + std::to_string(first_y);
}

LostCoordinates CountLostCoordinates(const Node& coords, int dims, const LookupParams& params,
                                     const RenderOptions& options) {
  if (dims < 1 || dims > 4) {
    throw Error("lookup", "found " + std::to_string(dims) + " dimensions, expected 1 to 4");
  }
  const auto needed = static_cast<size_t>(dims) + (params.projective ? 1 : 0);
  std::vector<int> channels = params.axes;
  for (int a = 0; channels.size() < needed; ++a) channels.push_back(a);
  std::vector<int> read = channels;
  if (params.mask >= 0) read.push_back(params.mask);
  const int present = coords.spec().channel_count();
  for (const int channel : read) {
    if (channel >= 0 && channel < present) continue;
    throw DataError("lookup", "found " + std::to_string(present) + " channels, expected channel " +
                                  std::to_string(channel) + " as a coordinate or mask");
  }
  LostSink sink(std::move(channels), dims, params);
  graph::RenderToSink(coords, PixelType::kFloat, sink, options);
  return sink.lost();
}

}  // namespace tessera
