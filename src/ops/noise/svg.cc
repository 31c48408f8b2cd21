// SVG 1.1's feTurbulence: the specification's lattice and gradients, rows made by the grid kernel.
#include "ops/noise/svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/noise/field.h"
#include "ops/noise/kernels.h"
#include "ops/noise/noise_ops.h"
#include "tessera/ops/noise.h"

namespace tessera::ops {
namespace {

class SvgStage final : public graph::TileStage {
 public:
  SvgStage(const SvgTurbulenceParams& p, const ImageSpec& spec)
      : params_(p),
        spec_(spec),
        kernels_(FindNoiseKernels()),
        grid_(FindGridKernels()),
        lattice_(p.seed),
        x_(p.base_frequency[0], p.stitch, p.frame.x0, p.frame.width()),
        y_(p.base_frequency[1], p.stitch, p.frame.y0, p.frame.height()) {
    const Roi& w = spec.data_window;
    const size_t padded = static_cast<size_t>(w.width() / kNoiseBatch + 2) * kNoiseBatch;
    for (int k = 0; k < p.octaves && !w.empty(); ++k) {
      Columns c;
      for (int x = w.x0; x < w.x1; ++x) {
        const SvgAxis::Place place = x_.At(x, k);
        const bool same =
            !c.cell.empty() && c.cell[c.cell.size() - 2] == place.low && c.cell.back() == place.high;
        if (!same) {
          if (c.cell.empty() || c.cell.back() != place.low) c.cell.push_back(place.low);
          c.cell.push_back(place.high);
        }
        c.left.push_back(static_cast<int32_t>(c.cell.size()) - 2);
        c.fraction.push_back(place.fraction);
      }
      c.left.resize(padded, c.left.back());
      c.fraction.resize(padded, 0.0f);
      c.fade.resize(padded);
      kernels_.fade(c.fraction.data(), static_cast<int>(padded), static_cast<int>(NoiseFade::kCubic),
                    c.fade.data());
      octaves_.push_back(std::move(c));
    }
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }
  graph::TileSize Preferred() const override { return {spec_.width(), 64}; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& r = args.out.roi;
    if (r.empty()) return;
    const auto width = static_cast<size_t>(r.width());
    const int channels = static_cast<int>(args.channels.size());
    base::ArenaVector<float*> planes(args.scratch);
    for (int i = 0; i < channels; ++i) planes.push_back(args.scratch.Allocate<float>(width + kNoisePadding));
    size_t most = 2;
    for (const Columns& c : octaves_) most = std::max(most, c.cell.size());
    most += 2 * kNoisePadding;
    GridLatticeRow low, high;
    for (GridLatticeRow* row : {&low, &high}) {
      row->gx = args.scratch.Allocate<float>(most);
      row->gy = args.scratch.Allocate<float>(most);
      row->rest = args.scratch.Allocate<float>(most);
      std::fill_n(row->rest, most, 0.0f);
    }
    float* const scratch = args.scratch.Allocate<float>(4 * most);
    const auto from = static_cast<size_t>(r.x0 - spec_.data_window.x0);
    base::ArenaVector<GridColumns> tile(args.scratch);
    for (const Columns& c : octaves_) {
      tile.push_back(TileColumns(grid_, c.left, c.fraction, c.fade, from, width, args.scratch));
    }
    const bool sum = params_.fractal_noise;
    for (int y = r.y0; y < r.y1; ++y) {
      for (int i = 0; i < channels; ++i) {
        const int channel = args.channels[static_cast<size_t>(i)];
        float* const out = planes[static_cast<size_t>(i)];
        std::fill_n(out, width, sum ? 0.5f : 0.0f);
        for (size_t k = 0; k < octaves_.size() && channel < 4; ++k) {
          const Columns& c = octaves_[k];
          const SvgAxis::Place place = y_.At(y, static_cast<int>(k));
          GridRow row;
          row.columns = tile[k];
          const int first = row.columns.first, last = first + row.columns.count;
          Fill(c, first, last, channel, place.low, low);
          Fill(c, first, last, channel, place.high, high);
          row.count = r.width();
          row.lower = low;
          row.upper = high;
          row.fraction = place.fraction;
          row.fade = place.fraction * place.fraction * (3 - 2 * place.fraction);
          row.sum = sum ? NoiseSum::kFbm : NoiseSum::kTurbulence;
          row.weight = static_cast<float>(std::ldexp(sum ? 0.5 : 1.0, -static_cast<int>(k)));
          row.add = true;
          row.out = out;
          row.scratch = scratch;
          grid_.row(row);
        }
        for (size_t x = 0; x < width; ++x) out[x] = std::clamp(out[x], 0.0f, 1.0f);
        if (channel >= 4) std::fill_n(out, width, 0.0f);
      }
      kernels_.interleave(planes.data(), channels, r.width(), reinterpret_cast<float*>(args.out.At(r.x0, y)));
    }
  }

 private:
  struct Columns {
    std::vector<int> cell;
    std::vector<int32_t> left;
    std::vector<float> fraction, fade;
  };
  void Fill(const Columns& c, int first, int last, int channel, int row, const GridLatticeRow& out) const {
    for (int i = first; i < last; ++i) {
      const auto column =
          static_cast<size_t>(lattice_.selector[static_cast<size_t>(c.cell[static_cast<size_t>(i)])]);
      const auto point = static_cast<size_t>(lattice_.selector[column + static_cast<size_t>(row)]);
      const std::array<float, 2>& g = lattice_.gradient[static_cast<size_t>(channel)][point];
      out.gx[i - first] = g[0];
      out.gy[i - first] = g[1];
    }
  }

  SvgTurbulenceParams params_;
  ImageSpec spec_;
  NoiseKernels kernels_;
  GridKernels grid_;
  SvgLattice lattice_;
  SvgAxis x_, y_;
  std::vector<Columns> octaves_;
};

class SvgOp final : public graph::OpWith<SvgTurbulenceParams> {
 public:
  SvgOp(const ImageSpec& spec, SvgTurbulenceParams params) : OpWith(std::move(params)), spec_(spec) {}
  std::string Name() const override { return params().fractal_noise ? "fractalnoise" : "turbulence"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override { return spec_; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<SvgStage>(params(), spec_);
  }

 private:
  ImageSpec spec_;
};

OpInfo SvgRow(const char* name, const char* summary) {
  OpInfo info;
  info.name = name;
  info.family = "noise";
  info.generator = true;
  info.inputs = 0;
  info.summary = summary;
  info.help =
      "SVG 1.1's feTurbulence to the letter: Park and Miller's generator fills a permutation of 256 and "
      "unit gradients for each of four channels; cubic fade; octave k has weight 2^-k. Channel c of pixel "
      "(x, y) is the specification's turbulence(c, (x, y)), for fractalnoise (sum + 1) / 2, clamped to "
      "[0,1]; channels beyond the fourth are 0. Results are not premultiplied and in linearRGB, as the "
      "specification has them before its colour conversion.\n"
      "Source: SVG 1.1, section 15.24.";
  info.bound = "1e-5 * sum of weights, and the seed's rules exactly";
  info.bound_u = 84;
  info.modifiers = SvgModifiers();
  info.examples = {"", "seed=7 basefreq=0.02,0.11 octaves=4"};
  return info;
}
template <bool kFractal>
Node MakeSvg(std::span<const Node>, const Arguments& a, const ImageSpec* output) {
  return SvgTurbulence(*output, SvgArguments(a, kFractal));
}

}  // namespace

std::vector<ParamInfo> SvgModifiers() {
  return {NumberModifier("seed", "0", -2147483648.0, 2147483647.0, "start of the generator, truncated"),
          ListModifier("basefreq", "0.05", 2, 0, 1e6, "cycles per pixel: x,y or one for both"),
          IntegerModifier("octaves", "1", 0, 64, "number of octaves"),
          FlagModifier("stitch", "adjust the frequencies so that the frame tiles")};
}
SvgTurbulenceParams SvgArguments(const Arguments& a, bool fractal_noise) {
  const std::vector<double>& f = a.Numbers("basefreq");
  return {.fractal_noise = fractal_noise,
          .seed = a.Number("seed"),
          .base_frequency = {f[0], f.back()},
          .octaves = a.Integer("octaves"),
          .stitch = a.Flag("stitch")};
}

void CheckSvg(const std::string& op, const SvgTurbulenceParams& params) {
  for (double f : params.base_frequency) {
    if (!(f >= 0 && f <= 1e6))
      throw Error(op, "found base frequency " + base::NumberText(f) + ", expected 0 to 1e6");
  }
  if (!std::isfinite(params.seed)) {
    throw Error(op, "found a seed of " + base::NumberText(params.seed) + ", expected a finite number");
  }
  if (params.octaves < 0 || params.octaves > 64) {
    throw Error(op, "found " + std::to_string(params.octaves) + " octaves, expected 0 to 64");
  }
}

OpInfo SvgTurbulenceInfo() {
  OpInfo info = SvgRow("turbulence", "SVG's feTurbulence, type turbulence");
  info.make = MakeSvg<false>;
  return info;
}
OpInfo SvgFractalNoiseInfo() {
  OpInfo info = SvgRow("fractalnoise", "SVG's feTurbulence, type fractalNoise");
  info.make = MakeSvg<true>;
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node SvgTurbulence(const ImageSpec& spec, const SvgTurbulenceParams& params) {
  const char* const name = params.fractal_noise ? "fractalnoise" : "turbulence";
  if (spec.channels.empty()) throw Error(name, "found no channels, expected at least one");
  ops::CheckSvg(name, params);
  SvgTurbulenceParams p = params;
  p.frame = spec.display_window.empty() ? spec.data_window : spec.display_window;
  return graph::MakeNode(std::make_shared<const ops::SvgOp>(spec, p), {});
}

}  // namespace tessera
