// Lays a table out for the lookup kernels.
#include "ops/lookup/grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "base/paged_memory.h"
#include "model/table_axis.h"
#include "model/table_sample.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

// Above this many entries an image is read where it is: copying it would cost more than seams do.
constexpr int64_t kLargestCopy = int64_t{1} << 18;
// Differences of entries up to this one are finite.
constexpr float kLargest = 0x1p126f;
// Positions are floats: beyond this many entries they would no longer tell neighbours apart.
constexpr int kLongestAxis = 1 << 22;

std::vector<Wrap> Wraps(const LookupParams& params, size_t dims) {
  std::vector<Wrap> wraps;
  for (size_t a = 0; a < dims; ++a) wraps.push_back(model::WrapOf(params.wrap, static_cast<int>(a)));
  return wraps;
}

}  // namespace

void Grid::SetAxes(const std::vector<int>& sizes, TableAlign align) {
  sizes_ = sizes;
  align_ = align;
  dims_ = static_cast<int>(sizes.size());
  const std::vector<Wrap> wraps = Wraps(params_, sizes.size());
  const bool ends = align == TableAlign::kEnds, cubic = params_.filter == TableFilter::kCubic;
  for (int a = 0; a < dims_; ++a) {
    const auto i = static_cast<size_t>(a);
    if (sizes[i] > kLongestAxis) {
      throw DataError("lookup", "found " + std::to_string(sizes[i]) +
                                    " entries along an axis, expected at most " +
                                    std::to_string(kLongestAxis));
    }
    GridAxis& axis = axes_[a];
    axis.wrap = wraps[i];
    const float last = static_cast<float>(sizes[i] - 1);
    axis.scale = axis.per_unit = ends ? last : last + 1;
    if (params_.filter == TableFilter::kNearest) {
      axis.offset = ends ? 0.5f : 0.0f;
      const bool border = axis.wrap == Wrap::kBlack;
      axis.low = border ? -1.0f : 0.0f;
      axis.high = border ? last + 1 : last;
      // A repeating coordinate that float rounds up to the end of its period is at the first entry.
      if (axis.wrap == Wrap::kRepeat && !ends) axis.high = last + 1;
      axis.last = sizes[i];
    } else {
      axis.offset = ends ? 0.0f : -0.5f;
      const bool beyond = axis.wrap != Wrap::kClamp;
      const float reach = cubic ? (beyond ? 2.0f : 1.0f) : (beyond ? 1.0f : 0.0f);
      axis.low = -reach;
      axis.high = last + (cubic ? 1 : 0) + (beyond ? 1 : 0);
      axis.last = sizes[i] - 1 + (cubic ? 1 : 0);
    }
    axis.exact = (static_cast<int>(axis.scale) & (static_cast<int>(axis.scale) - 1)) == 0;
    if (sizes[i] == 1 && axis.wrap != Wrap::kGlClamp && axis.wrap != Wrap::kBlack) {
      // One entry everywhere: a lookup without this axis, bit for bit.
      axis.scale = axis.offset = 0;
    }
  }
  for (int c = 0; c < 4; ++c) {
    const auto k = static_cast<size_t>(c);
    border_[c] = k < params_.border.size() ? static_cast<float>(params_.border[k]) : 0.0f;
  }
}

void Grid::SetSummary() {
  edges_ = true;
  bytes_ = int64_t{4} * texel_;
  for (int a = 0; a < dims_; ++a) {
    const GridAxis& axis = axes_[a];
    edges_ = edges_ && axis.wrap == Wrap::kClamp && (whole_ || !axis.seams) && axis.low == 0;
    bytes_ += int64_t{4} * texel_ * axis.stride * (axis.last_stored - axis.first_stored);
  }
}

template <class Read>
void Grid::Copy(const std::vector<int>& sizes, TableAlign align, const graph::Workers* workers,
                const Read& read) {
  texel_ = channels_ == 1 ? 1 : 4;
  std::array<std::vector<int>, 4> entry_of;
  std::array<int64_t, 4> step = {};
  int64_t count = 1, rows = 1, origin = 0, stride = 1;
  for (int a = 0; a < 4; ++a) {
    const auto i = static_cast<size_t>(a);
    if (a >= dims_) {
      entry_of[i] = {0};
      continue;
    }
    const model::TableAxis axis{sizes[i], align, axes_[a].wrap};
    int pad = params_.filter == TableFilter::kCubic ? 3 : 1;
    if (pad == 1 && axis.wrap == Wrap::kClamp && sizes[i] > 1) {
      // Nothing lies beyond: the last cell is chosen at its own end, so that both of its entries are there.
      pad = 0;
      if (params_.filter != TableFilter::kNearest) axes_[a].last = sizes[i] - 2;
    }
    for (int k = -pad; k < sizes[i] + pad; ++k) {
      // OpenGL's clamp never shows the border to the nearest filter.
      const int inside = std::clamp(k, 0, sizes[i] - 1);
      entry_of[i].push_back(params_.filter == TableFilter::kNearest && axes_[a].wrap == Wrap::kGlClamp
                                ? inside
                                : axis.Entry(k));
    }
    const auto length = static_cast<int64_t>(entry_of[i].size());
    axes_[a].stride = static_cast<int32_t>(count);
    axes_[a].first_stored = -pad;
    axes_[a].last_stored = sizes[i] - 1 + pad;
    origin += pad * count;
    step[i] = stride;
    stride *= sizes[i];
    count *= length;
    if (a > 0) rows *= length;
    const int cells = sizes[i] - 1;
    ends_inside_ = (a == 0 || ends_inside_) && pad == 0 && align == TableAlign::kEnds;
    exact_ = (a == 0 || exact_) && cells > 0 && (cells & (cells - 1)) == 0;
    if (count > INT32_MAX)
      throw DataError("lookup", "found a table too large for its border, expected fewer than 2^31 entries");
  }
  // Texels are read in pairs and rows of four: what lies after the last one must exist.
  const auto floats = static_cast<size_t>(count) * static_cast<size_t>(texel_) + 16;
  Context& context = workers != nullptr ? workers->context() : Context::Default();
  memory_ = base::AllocateWhole(context, floats * sizeof(float), base::Access::kScattered);
  auto* const to = reinterpret_cast<float*>(memory_.get());
  std::fill_n(to + floats - 16, 16, 0.0f);
  std::vector<char> finite(static_cast<size_t>(rows), 1);
  const auto width = static_cast<int64_t>(entry_of[0].size());
  const auto copy_row = [&](int64_t row, int) {
    int64_t rest = row, from = 0;
    bool border = false;
    for (size_t a = 1; a < 4; ++a) {
      const auto length = static_cast<int64_t>(entry_of[a].size());
      const int entry = entry_of[a][static_cast<size_t>(rest % length)];
      rest /= length;
      border |= entry < 0;
      from += entry * step[a];
    }
    float* out = to + row * width * texel_;
    bool all_finite = true;
    for (int64_t k = 0; k < width; ++k, out += texel_) {
      const int entry = entry_of[0][static_cast<size_t>(k)];
      for (int c = 0; c < texel_; ++c) {
        out[c] = border || entry < 0 ? border_[c] : c < channels_ ? read(from + entry, c) : 0.0f;
        all_finite &= std::fabs(out[c]) <= kLargest;
      }
    }
    finite[static_cast<size_t>(row)] = all_finite;
  };
  if (workers != nullptr && count > 1 << 15) {
    workers->For(rows, copy_row);
  } else {
    for (int64_t row = 0; row < rows; ++row) copy_row(row, 0);
  }
  finite_ = std::find(finite.begin(), finite.end(), 0) == finite.end();
  whole_ = true;
  data_ = to + origin * texel_;
  SetSummary();
}

Grid::Grid(const Table& table, const LookupParams& params, const graph::Workers* workers)
    : channels_(table.channels()), params_(params), table_(table) {
  SetAxes(table.sizes(), table.align());
  if (table.storage() == PixelType::kFloat) {
    Copy(table.sizes(), table.align(), workers, [&table](int64_t i, int c) { return table.At(i, c); });
  } else {
    const std::vector<float> samples = table.Samples();
    Copy(table.sizes(), table.align(), workers,
         [&](int64_t i, int c) { return samples[static_cast<size_t>(i * channels_ + c)]; });
  }
}

Grid::Grid(const ConstImageView& image, const TableLayout& layout, const LookupParams& params,
           const graph::Workers* workers)
    : channels_(image.channels), params_(params), image_(image) {
  const std::vector<int> sizes = model::TableSizes(image.roi, image.channels, layout);
  SetAxes(sizes, layout.align);
  const int width = image.roi.width();
  const bool cubic = params.filter == TableFilter::kCubic;
  bool in_place = image.roi.pixels() > kLargestCopy && (channels_ == 1 || channels_ == 4) &&
                  image.pixel_stride == 4 * channels_ && image.row_stride % image.pixel_stride == 0 &&
                  image.row_stride > 0 && params.filter != TableFilter::kMipmap;
  for (const int n : sizes) in_place = in_place && n >= (cubic ? 4 : 2);
  if (!in_place) {
    Copy(sizes, layout.align, workers, [&](int64_t i, int c) {
      float v;
      std::memcpy(&v, image.data + (i / width) * image.row_stride + (i % width) * image.pixel_stride + 4 * c,
                  4);
      return v;
    });
    return;
  }
  texel_ = channels_;
  whole_ = false;
  finite_ = false;  // not known
  data_ = reinterpret_cast<const float*>(image.data);
  int64_t stride = 1;
  for (int a = 0; a < dims_; ++a) {
    axes_[a].stride = static_cast<int32_t>(stride);
    stride *= a == 0 ? image.row_stride / image.pixel_stride : sizes[static_cast<size_t>(a)];
    const int n = sizes[static_cast<size_t>(a)];
    const bool nearest = params.filter == TableFilter::kNearest;
    axes_[a].first_stored = 0;
    axes_[a].last_stored = n - 1;
    // The last cell is chosen at its own end, so that both of its entries are there.
    const bool edge = axes_[a].wrap == Wrap::kClamp;
    if (!cubic && !nearest) axes_[a].last = edge ? n - 2 : n - 1;
    axes_[a].seams = cubic || !edge;
  }
  SetSummary();
}

void Grid::SampleOne(const float* coords, float* result) const {
  const int width = image_.roi.width();
  model::TableEntries entries{sizes_, channels_, align_, {}};
  if (!table_.empty()) {
    entries.read = [this](int64_t i, int c) { return table_.At(i, c); };
  } else {
    entries.read = [this, width](int64_t i, int c) {
      float v;
      std::memcpy(
          &v, image_.data + (i / width) * image_.row_stride + (i % width) * image_.pixel_stride + 4 * c, 4);
      return v;
    };
  }
  double at[4] = {}, value[4] = {};
  for (int a = 0; a < dims_; ++a) at[a] = coords[a];
  model::SampleEntries(entries, params_, at, value);
  for (int c = 0; c < channels_; ++c) result[c] = static_cast<float>(value[c]);
}

}  // namespace tessera::ops
