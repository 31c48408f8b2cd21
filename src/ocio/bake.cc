// Bakes any transform of colours into a shaper curve and a 3-D table, and measures what that costs in
// accuracy.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "graph/op.h"
#include "ocio/color_difference.h"
#include "ocio/config.h"
#include "tessera/color_state.h"
#include "tessera/error.h"
#include "tessera/ocio.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"

namespace tessera {
namespace {

constexpr int kTile = 64;
constexpr double kToe = 0x1p-8;  // below, the shaper is linear

struct Domain {
  double low = 0, high = 1;
  bool shaped = false;
};

Image FloatImage(const Roi& roi, const ImageSpec& like) {
  ImageSpec spec = like;
  spec.data_window = roi;
  spec.type = PixelType::kFloat;
  return Image(spec);
}

// f(rgb) for every pixel of `roi`.
template <class F>
void ForEachColor(const Node& node, const Roi& roi, F f) {
  const Image image = FloatImage(roi, node.spec());
  RenderInto(node, image.view());
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) f(&image.at<float>(x, y));
  }
}

// The range of the finite colours.
Domain RangeOf(const Node& image) {
  constexpr int kRows = 64;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const Roi& window = image.spec().data_window;
  for (int y = window.y0; y < window.y1; y += kRows) {
    ForEachColor(image, {window.x0, y, window.x1, std::min(y + kRows, window.y1)}, [&](const float* rgb) {
      for (int c = 0; c < 3; ++c) {
        if (!std::isfinite(rgb[c])) continue;
        low = std::min(low, double{rgb[c]}), high = std::max(high, double{rgb[c]});
      }
    });
  }
  if (!(low <= high)) return {};
  return {low, high, false};
}

// The shaper before it is brought to [0,1]: odd, smooth, a line up to kToe and logarithmic beyond.
CurveFormula ShaperFormula() {
  const double per_octave = 1 / std::log(2.0);
  CurveFormula f;
  f.kind = CurveFormula::Kind::kLog;
  f.in_scale = 1 / kToe, f.out_offset = per_octave;
  f.join = kToe, f.slope = per_octave / kToe;
  f.negatives = Negatives::kMirror;
  return f;
}
double Shaped(double x) {
  const double size = std::fabs(x), per_octave = 1 / std::log(2.0);
  return std::copysign(size < kToe ? size / kToe * per_octave : std::log2(size / kToe) + per_octave, x);
}
double Unshaped(double s) {
  const double size = std::fabs(s), per_octave = 1 / std::log(2.0);
  return std::copysign(size < per_octave ? size * kToe / per_octave : kToe * std::exp2(size - per_octave), s);
}

Node ToUnitRange(const Node& image, double low, double high) {
  const double scale = 1 / (high - low), bias = -low / (high - low);
  return ColorMatrix(image, {{scale, 0, 0, 0, scale, 0, 0, 0, scale, bias, bias, bias}});
}

Table TableOf(const std::function<Node(const Node&)>& transform, const Domain& domain, int size,
              const ColorState& color) {
  std::vector<float> axis;
  for (int i = 0; i < size; ++i) {
    const double s = static_cast<double>(i) / (size - 1);
    const double low = domain.shaped ? Shaped(domain.low) : domain.low;
    const double high = domain.shaped ? Shaped(domain.high) : domain.high;
    const double at = low + s * (high - low);
    axis.push_back(static_cast<float>(domain.shaped ? Unshaped(at) : at));
  }
  ImageSpec spec(size, size * size, 4);
  SetColorState(spec, color);  // the transform may start from it
  const Image lattice(spec);
  for (int y = 0; y < size * size; ++y) {
    for (int x = 0; x < size; ++x) {
      float* const pixel = &lattice.at<float>(x, y);
      pixel[0] = axis[static_cast<size_t>(x)], pixel[1] = axis[static_cast<size_t>(y % size)];
      pixel[2] = axis[static_cast<size_t>(y / size)], pixel[3] = 1;
    }
  }
  const Image result = Render(transform(FromImage(lattice)));
  std::vector<float> samples;
  for (int y = 0; y < size * size; ++y) {
    for (int x = 0; x < size; ++x)
      samples.insert(samples.end(), &result.at<float>(x, y), &result.at<float>(x, y) + 3);
  }
  return Table({size, size, size}, 3, samples, TableAlign::kEnds);
}

// Tiles spread evenly over the window (the R2 sequence), or the whole window where it is no larger than they
// are.
std::vector<Roi> SampleTiles(const Roi& window, int count) {
  if (window.pixels() <= int64_t{count} * kTile * kTile) {
    std::vector<Roi> bands;
    for (int y = window.y0; y < window.y1; y += kTile) {
      bands.push_back({window.x0, y, window.x1, std::min(y + kTile, window.y1)});
    }
    return bands;
  }
  std::vector<Roi> tiles;
  double u = 0.5, v = 0.5;
  for (int i = 0; i < count; ++i) {
    const int x = window.x0 + static_cast<int>(u * std::max(0, window.width() - kTile));
    const int y = window.y0 + static_cast<int>(v * std::max(0, window.height() - kTile));
    tiles.push_back(Intersection({x, y, x + kTile, y + kTile}, window));
    u = std::fmod(u + 0.7548776662466927, 1.0), v = std::fmod(v + 0.5698402909980532, 1.0);
  }
  return tiles;
}

BakeReport Compare(const Node& exact, const Node& baked, int tiles) {
  BakeReport report;
  double squares = 0;
  int64_t values = 0;
  for (const Roi& tile : SampleTiles(exact.spec().data_window, tiles)) {
    const Image want = FloatImage(tile, exact.spec()), got = FloatImage(tile, baked.spec());
    RenderInto(exact, want.view());
    RenderInto(baked, got.view());
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        const float *const a = &want.at<float>(x, y), *const b = &got.at<float>(x, y);
        ++report.pixels;
        for (int c = 0; c < 3; ++c) {
          const double error = std::fabs(double{a[c]} - b[c]);
          if (!std::isfinite(error)) continue;
          report.max_error = std::max(report.max_error, error);
          squares += error * error;
          ++values;
        }
        report.max_ciede2000 =
            std::max(report.max_ciede2000, ocio::Ciede2000(ocio::LabOfSrgb(a), ocio::LabOfSrgb(b)));
      }
    }
  }
  if (values > 0) report.rms_error = std::sqrt(squares / static_cast<double>(values));
  return report;
}

}  // namespace

std::string BakeReport::Summary() const {
  char text[256];
  std::snprintf(
      text, sizeof text,
      "domain [%.4g, %.4g] %s; on %lld pixels max error %.3g, RMS error %.3g, largest CIEDE2000 %.3g", low,
      high, shaped ? "through a logarithmic shaper" : "as it is", static_cast<long long>(pixels), max_error,
      rms_error, max_ciede2000);
  return text;
}

Node Bake(const Node& image, const std::function<Node(const Node&)>& transform, const BakeParams& params,
          BakeReport* report) {
  if (params.size < 2 || params.size > 129) {
    throw Error("bake", "found a size of " + std::to_string(params.size) + ", expected 2 to 129");
  }
  if (params.tiles < 1)
    throw Error("bake", "found " + std::to_string(params.tiles) + " tiles, expected at least 1");
  if (image.spec().channel_count() < 3) {
    return AsColors(image, [&](const Node& colors) { return Bake(colors, transform, params, report); });
  }
  if (!std::isfinite(params.low) || !std::isfinite(params.high))
    throw Error("bake", "expected a finite domain");

  Domain domain = params.low < params.high ? Domain{params.low, params.high, false} : RangeOf(image);
  if (params.low >= params.high && domain.low >= 0 && domain.high <= 1) domain = {0, 1, false};
  if (domain.low == domain.high) domain.high = std::nextafter(static_cast<float>(domain.high), 3.4e38f) + 1;
  domain.shaped = domain.low < 0 || domain.high > 1;

  const Table table = TableOf(transform, domain, params.size, ColorStateOf(image.spec()));
  Node shaped = image;
  if (domain.shaped) {
    shaped = ToUnitRange(ApplyCurve(image, {{ShaperFormula()}}), Shaped(domain.low), Shaped(domain.high));
  } else if (domain.low != 0 || domain.high != 1) {
    shaped = ToUnitRange(image, domain.low, domain.high);
  }
  const Node exact = transform(image);
  const Node baked = WithColorState(ApplyTable3D(shaped, table), ColorStateOf(exact.spec()));
  if (report != nullptr) {
    *report = Compare(exact, baked, params.tiles);
    report->low = domain.low, report->high = domain.high, report->shaped = domain.shaped;
  }
  return baked;
}

}  // namespace tessera
