// Tables looked up entry by entry.
#include "reference/table_lookup.h"

#include <cmath>
#include <limits>
#include <optional>

namespace tessera::reference {

Wrap WrapOf(const LookupParams& p, size_t axis) {
  return p.wrap.empty() ? Wrap::kClamp : p.wrap[std::min(axis, p.wrap.size() - 1)];
}

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Tap {
  int64_t entry;  // -1: the border colour
  double weight;
};
// Walks an index into the table, one period or reflection at a time where there is one.
int64_t Wrapped(int64_t i, int64_t n, Wrap wrap, bool ends) {
  if (wrap == Wrap::kGlClamp || wrap == Wrap::kBlack) return i < 0 || i >= n ? -1 : i;
  if (wrap == Wrap::kClamp || n == 1) return std::clamp<int64_t>(i, 0, n - 1);
  // Entry n - 1 of a period's ends is entry 0 of the next one.
  if (wrap == Wrap::kRepeat && ends && i >= n) i -= (i / (n - 1)) * (n - 1);
  while (i < 0 || i >= n) {
    if (wrap == Wrap::kRepeat) {
      i += (i < 0 ? 1 : -1) * (ends ? n - 1 : n);
    } else if (i < 0) {
      i = ends ? -i : -1 - i;
    } else {
      i = ends ? 2 * (n - 1) - i : 2 * n - 1 - i;
    }
  }
  return i;
}

// The kernel k(x) of doc/maths/lookup.md.
double Kernel(CubicKernel kernel, double x) {
  const double b = kernel == CubicKernel::kMitchell ? 1.0 / 3 : kernel == CubicKernel::kBSpline ? 1 : 0;
  const double c = kernel == CubicKernel::kMitchell ? 1.0 / 3 : kernel == CubicKernel::kBSpline ? 0 : 0.5;
  x = std::fabs(x);
  if (x >= 2) return 0;
  if (x < 1) return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
  return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + (8 * b + 24 * c)) /
         6;
}

// The coordinate inside the wrap's period, in float as the contract says; nothing when it is not a number.
std::optional<double> Reduced(double coordinate, Wrap wrap) {
  const auto s = static_cast<float>(coordinate);
  float r = s;
  if (wrap == Wrap::kRepeat) r = s - std::floor(s);
  if (wrap == Wrap::kMirror) {
    r = static_cast<float>(s - 2.0 * std::floor(s / 2.0));
    if (r > 1) r = 2 - r;
  }
  if (std::isnan(r)) return std::nullopt;
  // Far outside is as good as just outside.
  const float reach = wrap == Wrap::kGlClamp ? 0.0f : 4.0f;
  return std::clamp(r, -reach, 1 + reach);
}

struct Place {
  int64_t first = 0;
  double fraction = 0;
};
// Where a reduced coordinate lies between entries; what is within the coordinate's own rounding of an entry
// is there.
Place PlaceOf(double s, int n, bool ends) {
  const double scaled = ends ? s * (n - 1) : s * n;
  double v = ends ? scaled : scaled - 0.5;
  const double entry = std::nearbyint(v), rounding = static_cast<float>(std::fabs(scaled)) / 0x1p24;
  if (std::fabs(static_cast<float>(v - entry)) <= rounding) v = entry;
  const double below = std::floor(v);
  return {static_cast<int64_t>(below), v - below};
}

std::vector<Tap> AxisTaps(double s, int n, bool ends, Wrap wrap, const LookupParams& p) {
  std::vector<Tap> taps;
  if (p.filter == TableFilter::kNearest) {
    auto i = static_cast<int64_t>(std::floor(ends ? s * (n - 1) + 0.5 : s * n));
    if (wrap == Wrap::kGlClamp) i = std::clamp<int64_t>(i, 0, n - 1);
    return {{Wrapped(i, n, wrap, ends), 1}};
  }
  const Place at = PlaceOf(s, n, ends);
  const bool cubic = p.filter == TableFilter::kCubic;
  for (int64_t k = cubic ? -1 : 0; k <= (cubic ? 2 : 1); ++k) {
    const double distance = std::fabs(static_cast<double>(k) - at.fraction);
    const double weight = cubic ? Kernel(p.cubic, distance) : 1 - distance;
    if (weight != 0) taps.push_back({Wrapped(at.first + k, n, wrap, ends), weight});
  }
  return taps;
}
class Gather {
 public:
  Gather(const Source& table, const LookupParams& p) : table_(table), p_(p) {
    found_.value.assign(static_cast<size_t>(table.channels), 0);
    found_.largest = found_.difference = found_.value;
    low_.assign(found_.value.size(), std::numeric_limits<double>::infinity());
    high_.assign(found_.value.size(), -std::numeric_limits<double>::infinity());
  }
  double Border(int c) const {
    return static_cast<size_t>(c) < p_.border.size() ? static_cast<float>(p_.border[static_cast<size_t>(c)])
                                                     : 0;
  }
  // Adds the entry with these indices, -1 for any that lies outside.
  void Add(const std::vector<int64_t>& index, double weight) {
    if (weight == 0) return;
    int64_t entry = 0;
    for (size_t a = index.size(); a-- > 0;) {
      entry = entry < 0 || index[a] < 0 ? -1 : entry * table_.sizes[a] + index[a];
    }
    for (int c = 0; c < table_.channels; ++c) {
      const auto k = static_cast<size_t>(c);
      const double v = entry < 0 ? Border(c) : table_.read(entry, c);
      found_.value[k] += weight * v;
      found_.largest[k] = std::max(found_.largest[k], std::fabs(v));
      low_[k] = std::min(low_[k], v), high_[k] = std::max(high_[k], v);
      found_.difference[k] = high_[k] - low_[k];
    }
  }
  // The product of every axis' taps.
  void AddAll(const std::vector<std::vector<Tap>>& taps, std::vector<int64_t>& index, double weight) {
    const size_t axis = index.size();
    if (axis == taps.size()) return Add(index, weight);
    for (const Tap& tap : taps[axis]) {
      index.push_back(tap.entry);
      AddAll(taps, index, weight * tap.weight);
      index.pop_back();
    }
  }
  const Found& found() const { return found_; }

 private:
  const Source& table_;
  const LookupParams& p_;
  Found found_;
  std::vector<double> low_, high_;
};

// Whether positions are exact: products with a power of two, from which half an entry is taken where that is
// exact too.
bool ExactPositions(int n, bool ends, Wrap wrap) {
  const int cells = ends ? n - 1 : n;
  return (cells & (cells - 1)) == 0 && (ends || wrap == Wrap::kClamp);
}

}  // namespace

Found LookUp(const Source& table, const LookupParams& p, const std::vector<double>& coords) {
  Gather gather(table, p);
  const auto judged = [&] {
    Found found = gather.found();
    const auto dims = static_cast<int>(table.sizes.size());
    if (p.filter == TableFilter::kCubic) {
      found.units = 8 * dims * std::pow(1.25, dims - 1);  // the rounding of positions included
      return found;
    }
    found.units = dims < 4 ? 3 : 4;
    for (int a = 0; a < dims; ++a) {
      const auto k = static_cast<size_t>(a);
      if (ExactPositions(table.sizes[k], table.ends, WrapOf(p, k))) continue;
      found.position_units += 0.5;
    }
    return found;
  };
  std::vector<double> reduced;
  for (size_t a = 0; a < table.sizes.size(); ++a) {
    const std::optional<double> s = Reduced(coords[a], WrapOf(p, a));
    if (!s) {
      Found none;
      for (int c = 0; c < table.channels; ++c) {
        none.value.push_back(p.propagate_nan && !p.projective ? kNaN : gather.Border(c));
        none.largest.push_back(std::fabs(gather.Border(c)));
        none.difference.push_back(0);
      }
      return none;
    }
    reduced.push_back(*s);
  }
  const size_t dims = reduced.size();
  if (p.filter == TableFilter::kTetrahedral) {
    // The vertices of the simplex: for each distinct fraction t, the corner that has stepped along every axis
    // whose fraction is at least t; its weight is the gap down to the next fraction.
    std::vector<Place> places;
    std::vector<double> levels = {1, 0};
    for (size_t a = 0; a < dims; ++a) {
      places.push_back(PlaceOf(reduced[a], table.sizes[a], table.ends));
      levels.push_back(places.back().fraction);
    }
    std::sort(levels.begin(), levels.end(), std::greater<>());
    for (size_t k = 0; k + 1 < levels.size(); ++k) {
      const double middle = 0.5 * (levels[k] + levels[k + 1]);
      std::vector<int64_t> index;
      for (size_t a = 0; a < dims; ++a) {
        const int64_t i = places[a].first + (places[a].fraction > middle ? 1 : 0);
        index.push_back(Wrapped(i, table.sizes[a], WrapOf(p, a), table.ends));
      }
      gather.Add(index, levels[k] - levels[k + 1]);
    }
    return judged();
  }
  std::vector<std::vector<Tap>> taps;
  for (size_t a = 0; a < dims; ++a)
    taps.push_back(AxisTaps(reduced[a], table.sizes[a], table.ends, WrapOf(p, a), p));
  std::vector<int64_t> index;
  gather.AddAll(taps, index, 1);
  return judged();
}
Source SourceOf(const Table& table) {
  return {table.sizes(), table.channels(), table.align() == TableAlign::kEnds,
          [&table](int64_t entry, int c) { return double{table.At(entry, c)}; }};
}

Source SourceOf(const ImageD& image, const TableLayout& layout) {
  Source source;
  source.channels = image.channels;
  source.ends = layout.align == TableAlign::kEnds;
  const int width = image.roi.width();
  int slices = 1;
  for (const int n : layout.slices) slices *= n;
  source.sizes = {width};
  const bool row = layout.dims == 1 || (layout.dims == 0 && layout.slices.empty() && image.roi.height() == 1);
  if (!row) {
    source.sizes.push_back(image.roi.height() / slices);
    source.sizes.insert(source.sizes.end(), layout.slices.begin(), layout.slices.end());
  }
  source.read = [&image](int64_t entry, int c) {
    return image.samples[static_cast<size_t>(entry * image.channels + c)];
  };
  return source;
}
}  // namespace tessera::reference
