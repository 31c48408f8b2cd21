// Look-ups over footprints, in double.
#include "reference/footprint.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "reference/border.h"
#include "reference/point_loop.h"

namespace tessera::reference {
namespace {

bool Repeats(Wrap wrap) { return wrap == Wrap::kRepeat || wrap == Wrap::kMirror; }

// Half axes of the image of a unit circle and the direction of the longer one.
struct Axes {
  double longer, shorter, angle;
  explicit Axes(const FootprintPlace& p) {
    // Of the singular values the sum of squares and the product are known, so their sum and difference are.
    const double squares =
        p.x_by_x * p.x_by_x + p.y_by_x * p.y_by_x + p.x_by_y * p.x_by_y + p.y_by_y * p.y_by_y;
    const double product = std::fabs(p.x_by_x * p.y_by_y - p.y_by_x * p.x_by_y);
    longer = (std::sqrt(squares + 2 * product) + std::sqrt(std::max(0.0, squares - 2 * product))) / 2;
    shorter = longer > 0 ? product / longer : 0;
    angle = 0.5 *
            std::atan2(2 * (p.x_by_x * p.y_by_x + p.x_by_y * p.y_by_y),
                       p.x_by_x * p.x_by_x + p.x_by_y * p.x_by_y - p.y_by_x * p.y_by_x - p.y_by_y * p.y_by_y);
  }
  void Limit(double least, double most, double anisotropy) {
    longer = std::max(std::min(longer, most * anisotropy), least);
    shorter = std::max({std::min(shorter, most), least, longer / anisotropy});
  }
};

}  // namespace

Footprints::Footprints(const Call& call, const Roi& window, Wrap wrap, bool ewa, int anisotropy)
    : call_(call), window_(window), wrap_(wrap), ewa_(ewa), anisotropy_(anisotropy) {
  int levels = 1;
  for (int w = window.width(), h = window.height(); w > 1 || h > 1; ++levels) {
    w = Repeats(wrap) ? std::max(1, w / 2) : (w + 1) / 2,
    h = Repeats(wrap) ? std::max(1, h / 2) : (h + 1) / 2;
  }
  x_ = Levels(window.width(), levels), y_ = Levels(window.height(), levels);
  made_.resize(static_cast<size_t>(levels));
}

Footprints::Axis Footprints::Levels(int size, int levels) const {
  Axis axis{{size}, {1}};
  for (int k = 1; k < levels; ++k) {
    const int n = Repeats(wrap_) ? std::max(1, axis.count.back() / 2) : (axis.count.back() + 1) / 2;
    const double twice = std::pow(2.0, k);
    double cell = twice;
    if (Repeats(wrap_))
      cell = n > 1 ? static_cast<double>(size) / n : std::max(twice, static_cast<double>(size));
    axis.count.push_back(n), axis.cell.push_back(cell);
  }
  return axis;
}

// Pixels of the level before that pixel i covers, and how much of it each.
void Footprints::Overlap(const Axis& axis, int level, int i, Wrap wrap,
                         std::vector<std::pair<int, double>>* taps) {
  const auto k = static_cast<size_t>(level);
  const int before = axis.count[k - 1];
  if (!Repeats(wrap)) {
    for (const int j : {2 * i, 2 * i + 1}) {
      if (j < before || wrap == Wrap::kClamp) taps->emplace_back(std::min(j, before - 1), 0.5);
    }
    return;
  }
  const double ratio = static_cast<double>(before) / axis.count[k];
  for (int j = 0; j < before; ++j) {
    const double part = std::min(j + 1.0, (i + 1) * ratio) - std::max<double>(j, i * ratio);
    if (part > 1e-9) taps->emplace_back(j, part / ratio);
  }
}

const Footprints::Sample& Footprints::Level(int level, int i, int j) {
  auto& known = made_[static_cast<size_t>(level)];
  const auto at = known.find({i, j});
  if (at != known.end()) return at->second;
  Sample sample(static_cast<size_t>(call_.out.channels));
  if (level == 0) {
    for (int c = 0; c < call_.out.channels; ++c) {
      const double v = call_.in[0].at(window_.x0 + i, window_.y0 + j, c);
      sample[static_cast<size_t>(c)] = {v, std::fabs(v)};
    }
  } else {
    std::vector<std::pair<int, double>> columns, rows;
    Overlap(x_, level, i, wrap_, &columns), Overlap(y_, level, j, wrap_, &rows);
    for (const auto& [row, wy] : rows) {
      for (const auto& [column, wx] : columns) {
        const Sample& part = Level(level - 1, column, row);
        for (size_t c = 0; c < sample.size(); ++c)
          sample[c].first += wx * wy * part[c].first, sample[c].second += wx * wy * part[c].second;
      }
    }
  }
  return known.emplace(std::pair(i, j), std::move(sample)).first->second;
}

void Footprints::Add(const Sample& sample, double weight, double share, Looked* to) const {
  for (size_t c = 0; c < sample.size(); ++c) {
    to->value[c] += weight * sample[c].first;
    to->largest[c] = std::fmax(to->largest[c], share * sample[c].second);
  }
}

void Footprints::Bilinear(int level, double x, double y, double weight, Looked* to) {
  const auto k = static_cast<size_t>(level);
  const double u = (x + 0.5) / x_.cell[k] - 0.5, v = (y + 0.5) / y_.cell[k] - 0.5;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      auto column = static_cast<int64_t>(std::floor(u)) + i, row = static_cast<int64_t>(std::floor(v)) + j;
      const double wx = 1 - std::fabs(static_cast<double>(column) - u),
                   wy = 1 - std::fabs(static_cast<double>(row) - v);
      if (!Shown<int64_t>(column, 0, x_.count[k], wrap_) || !Shown<int64_t>(row, 0, y_.count[k], wrap_))
        continue;
      if (wx == 0 || wy == 0) continue;
      const Sample& sample = Level(level, static_cast<int>(column), static_cast<int>(row));
      const double within = std::min({wx, wy, weight > 0 ? 1.0 : 0.0});
      for (const auto& [value, size] : sample) to->undecided |= within < 1e-6 && !std::isfinite(value);
      Add(sample, weight * wx * wy, 1, to);
    }
  }
}

void Footprints::Ellipse(int level, const FootprintPlace& place, double weight, Looked* to) {
  const auto k = static_cast<size_t>(level);
  Axes axes(place);
  axes.Limit(Cell(k), 4 * Cell(made_.size() - 1), anisotropy_);
  const double cosine = std::cos(axes.angle), sine = std::sin(axes.angle);
  const double u = (place.x + 0.5) / x_.cell[k] - 0.5, v = (place.y + 0.5) / y_.cell[k] - 0.5;
  const double wide = std::hypot(axes.longer * cosine, axes.shorter * sine) / x_.cell[k] + 1e-6,
               high = std::hypot(axes.longer * sine, axes.shorter * cosine) / y_.cell[k] + 1e-6;
  struct Tap {
    int column, row;
    double weight;
  };
  std::vector<Tap> taps;
  double sum = 0;
  int64_t seen = 0;
  for (auto j = static_cast<int64_t>(std::ceil(v - high)); static_cast<double>(j) <= v + high; ++j) {
    for (auto i = static_cast<int64_t>(std::ceil(u - wide)); static_cast<double>(i) <= u + wide; ++i) {
      const double dx = (static_cast<double>(i) - u) * x_.cell[k],
                   dy = (static_cast<double>(j) - v) * y_.cell[k];
      const double along = (dx * cosine + dy * sine) / axes.longer,
                   across = (dy * cosine - dx * sine) / axes.shorter;
      const double square = along * along + across * across;
      if (square > 1 + 1e-6) continue;
      const double w = std::max(0.0, std::exp(-2 * square) - std::exp(-2.0));
      sum += w, ++seen;
      int64_t column = i, row = j;
      if (!Shown<int64_t>(column, 0, x_.count[k], wrap_) || !Shown<int64_t>(row, 0, y_.count[k], wrap_))
        continue;
      if (square > 1 - 1e-5) {
        for (const auto& [value, size] : Level(level, static_cast<int>(column), static_cast<int>(row)))
          to->undecided |= !std::isfinite(value);
      }
      if (w > 0) taps.push_back({static_cast<int>(column), static_cast<int>(row), w});
    }
  }
  for (const Tap& tap : taps) Add(Level(level, tap.column, tap.row), weight * tap.weight / sum, 1, to);
  to->share = std::max(to->share, 1 + static_cast<double>(seen) / 128);
}

Footprints::Looked Footprints::Look(const FootprintPlace& place, int more) {
  Looked looked;
  looked.value.assign(static_cast<size_t>(call_.out.channels), 0);
  looked.largest = looked.value;
  if (window_.empty() || !(std::fabs(place.x) < 0x1p40 && std::fabs(place.y) < 0x1p40)) return looked;
  Axes axes(place);
  if (!(axes.longer < 0x1p150)) return looked;
  axes.Limit(1, 4 * Cell(made_.size() - 1), anisotropy_);
  const double ratio = axes.longer / axes.shorter - 0x1p-20;
  const int probes = static_cast<int>(std::clamp(std::ceil(ratio) + more, 1.0, anisotropy_));
  const double width = ewa_ ? axes.shorter / 2 : axes.longer / probes;
  size_t k = 0;
  while (k + 1 < made_.size() && Cell(k + 1) <= width) ++k;
  const double next = k + 1 < made_.size() ? std::max(0.0, (width - Cell(k)) / (Cell(k + 1) - Cell(k))) : 0;
  const auto level = static_cast<int>(k);
  for (const auto& [at, weight] : {std::pair(level, 1 - next), std::pair(level + 1, next)}) {
    if (weight == 0) continue;
    if (ewa_) {
      Ellipse(at, place, weight, &looked);
      continue;
    }
    for (int i = 0; i < probes; ++i) {
      const double along = axes.longer * ((i + 0.5) / probes - 0.5);
      Bilinear(at, place.x + along * std::cos(axes.angle), place.y + along * std::sin(axes.angle),
               weight / probes, &looked);
    }
    looked.share = 1 + probes / 16.0;
  }
  looked.share += level / 2.0;
  return looked;
}

void Footprints::Put(int x, int y, const FootprintPlace& place) {
  FootprintPlace near = place;
  // From here on in pixels of the window. Integers reach that far; what repeats is brought back.
  const auto bring = [this](double at, int size) {
    if (!Repeats(wrap_)) return std::fabs(at) < 0x1p40 ? std::clamp(at, -0x1p27, 0x1p27) : at;
    const double period = wrap_ == Wrap::kMirror ? 2.0 * size : size;
    return std::fabs(at) < 0x1p40 ? at - period * std::floor(at / period) : at;
  };
  near.x = bring(place.x - window_.x0, window_.width());
  near.y = bring(place.y - window_.y0, window_.height());
  if (ewa_) {
    for (double* const v : {&near.x_by_x, &near.x_by_y, &near.y_by_x, &near.y_by_y}) *v *= 0.75;
  }
  const Looked here = Look(near, 0);
  std::vector<double> apart(here.value.size());
  const auto against = [&](const Looked& there) {
    for (size_t c = 0; c < apart.size(); ++c)
      apart[c] = std::max(apart[c], std::fabs(there.value[c] - here.value[c]));
  };
  if (call_.scale != nullptr && std::isfinite(near.x)) {
    const double far = std::max(place.off_x, place.off_y);
    for (const int side : {0, 1, 2, 3}) {
      if (!(far > 0x1p-30)) break;
      FootprintPlace aside = near;
      aside.x += (side % 2 != 0 ? 1 : -1) * place.off_x, aside.y += (side / 2 != 0 ? 1 : -1) * place.off_y;
      against(Look(aside, 0));
    }
    // How many look-ups there are hangs on a ratio.
    Axes axes(near);
    axes.Limit(1, 4 * Cell(made_.size() - 1), anisotropy_);
    const double ratio = axes.longer / axes.shorter - 0x1p-20;
    if (!ewa_ && std::fabs(ratio - std::round(ratio)) < 1e-8) {
      against(Look(near, 1)), against(Look(near, -1));
    }
  }
  for (int c = 0; c < call_.out.channels; ++c) {
    const auto k = static_cast<size_t>(c);
    call_.out.at(x, y, c) = here.value[k];
    if (call_.scale != nullptr)
      call_.scale->at(x, y, c) = std::max(here.largest[k] * here.share, kSmallestScale);
    if (apart[k] > 0) call_.Undecided(x, y, c, apart[k]);
  }
  if (here.undecided) call_.Undecided(x, y);
}

}  // namespace tessera::reference
