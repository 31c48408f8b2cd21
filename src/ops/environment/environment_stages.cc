// How environment lookups are done for a run of pixels: normals to directions, directions to texels, what
// becomes of them.
#include "ops/environment/environment_stages.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ops/environment/lobe.h"
#include "ops/environment/lookup.h"
#include "ops/environment/mips.h"
#include "ops/environment/probes.h"

namespace tessera::ops {
namespace {

ReflectionSetup SetupOf(const EnvironmentParams& p, const Roi& display, bool positions) {
  ReflectionSetup s;
  s.direction = p.direction;
  s.fresnel = p.fresnel.has_value();
  s.reflectance = p.fresnel.value_or(1);
  s.codes = p.bits > 0 ? std::ldexp(1.0, p.bits) - 1 : 0;
  double largest = 0;
  for (size_t i = 0; i < 9; ++i) {
    s.matrix[i] = p.matrix[i / 3 * 4 + i % 3];
    largest = std::max(largest, std::fabs(s.matrix[i]));
  }
  // Directions have any length: keeping them in range costs nothing, and leaves rotations alone.
  if (largest > 0x1p20 || largest < 0x1p-20) {
    for (double& m : s.matrix) m /= largest;
  }
  for (size_t i = 0; i < 9; ++i) {
    const double* const a = s.matrix + i / 3 * 3;
    const double* const b = s.matrix + i % 3 * 3;
    s.rigid = s.rigid && std::fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - (i % 4 == 0 ? 1 : 0)) < 1e-3;
  }
  const auto set = [&s](const Vector3& base) { std::copy_n(base.begin(), 3, s.base); };
  const bool ray = p.camera && !p.camera->perspective();
  if (positions && !ray) {
    s.use_position = 1;
    const Vector3& eye = p.eye ? *p.eye : p.camera->eye();
    set({-eye[0], -eye[1], -eye[2]});
  } else if (p.camera) {
    // A ray's direction is affine in the pixel's place.
    const Vector3 at = p.camera->PixelRay(display, -0.5, -0.5).direction;
    const Vector3 right = p.camera->PixelRay(display, 0.5, -0.5).direction;
    const Vector3 down = p.camera->PixelRay(display, -0.5, 0.5).direction;
    set(at);
    for (size_t k = 0; k < 3; ++k) s.column[k] = right[k] - at[k], s.row[k] = down[k] - at[k];
  } else {
    set({-p.view[0], -p.view[1], -p.view[2]});
  }
  return s;
}

// What both stages share: lookups of runs of directions.
class EnvironmentLookups {
 public:
  EnvironmentLookups(const EnvironmentStagePlan& plan, const graph::StageContext& context)
      : positions_(plan.positions),
        map_(plan.map),
        exponent_(plan.params.lobe),
        filter_(plan.params.filter),
        anisotropy_(plan.params.anisotropy),
        alpha_(context.output.alpha),
        setup_(SetupOf(plan.params, context.output.display_window, plan.positions)),
        reflect_kernels_(ChooseReflectKernels()),
        kernels_(ChooseEnvironmentKernels()),
        mip_kernels_(ChooseMipKernels()),
        lobe_(ChooseLobe()) {}

  const PreparedEnvironment& map() const { return *map_; }
  bool positions() const { return positions_; }
  const ReflectionSetup& setup() const { return setup_; }
  const ReflectKernels& reflect_kernels() const { return reflect_kernels_; }
  const EnvironmentKernels& kernels() const { return kernels_; }
  const MipKernels& mip_kernels() const { return mip_kernels_; }

  // Four channels of a run, in two passes so that runs may be interleaved.
  void Locate(int group, const ReflectionRun& run, int count, Places& places) const {
    if (map_->samples.empty()) {
      kernels_.locate(*map_->atlases[static_cast<size_t>(group)], run.directions, count, places);
    }
  }
  void Gather(int group, const ReflectionRun& run, const Places& places, int count, float* rgba) const {
    if (map_->samples.empty()) {
      kernels_.gather(*map_->atlases[static_cast<size_t>(group)], places, count, rgba);
    } else {
      const Directions& d = run.directions;
      lobe_(*map_->samples[static_cast<size_t>(group)], exponent_, false, d.x, d.y, d.z, count, rgba);
    }
  }
  // Mixes in what a row of a filtered mirror shows at its levels.
  void Filter(int group, const MirrorRow& row, const double* level, int count, float* rgba) const {
    mip_kernels_.mix(*map_->mips[static_cast<size_t>(group)], row, level, count, rgba);
  }
  bool footprints() const {
    return filter_ == EnvironmentFilter::kTrilinear || filter_ == EnvironmentFilter::kEwa;
  }
  void FindProbes(const MirrorRow& above, const MirrorRow& row, const MirrorRow& below, int count,
                  PixelProbes* probes) const {
    const ProbeFilter filter =
        filter_ == EnvironmentFilter::kEwa ? ProbeFilter::kEwa : ProbeFilter::kTrilinear;
    FindReflectionProbes(*map_->mips[0], filter, anisotropy_, above, row, below, count, probes);
  }
  // Replaces what pixels show that cover more than a texel.
  void GatherOver(int group, const PixelProbes* probes, int count, float* rgba) const {
    const auto k = static_cast<size_t>(group);
    Directions d;
    std::fill_n(d.x, kDirectionRun, 0.0), std::fill_n(d.y, kDirectionRun, 0.0);
    std::fill_n(d.z, kDirectionRun, 1.0);
    alignas(64) float texels[4 * kDirectionRun];
    const auto put = [&](int slot, const double(&at)[3], const Vector3& place) {
      d.x[slot] = at[0] + place[0], d.y[slot] = at[1] + place[1], d.z[slot] = at[2] + place[2];
    };
    GatherProbes<kDirectionRun, 4>(probes, count, rgba, put, [&](int level, int held) {
      kernels_.lookup(level == 0 ? *map_->atlases[k] : map_->mips[k]->cube(level), d, held, texels);
      return static_cast<const float*>(texels);
    });
  }
  // Fresnel's factor, and nothing where there is no normal.
  void Finish(int group, const ReflectionRun& run, int count, float* rgba) const {
    if (setup_.fresnel) {
      for (int i = 0; i < count; ++i) {
        for (int c = 0; c < 4; ++c) rgba[4 * i + c] *= 4 * group + c == alpha_ ? 1 : run.fresnel[i];
      }
    }
    if (run.all_valid) return;
    for (int i = 0; i < count; ++i) {
      if (run.valid[i] == 0) std::fill_n(rgba + 4 * i, 4, 0.0f);
    }
  }

 private:
  bool positions_;
  std::shared_ptr<const PreparedEnvironment> map_;
  double exponent_;
  EnvironmentFilter filter_;
  int anisotropy_;
  int alpha_;
  ReflectionSetup setup_;
  ReflectKernels reflect_kernels_;
  EnvironmentKernels kernels_;
  MipKernels mip_kernels_;
  LobeFunction lobe_;
};

class EnvironmentPointStage final : public graph::PointStage {
 public:
  EnvironmentPointStage(const EnvironmentStagePlan& plan, const graph::StageContext& context)
      : lookups_(plan, context) {}
  bool CanFuse(bool load, PixelType) const override { return !load; }

  void Run(const graph::PointArgs& args) const override {
    const EnvironmentKernels& kernels = lookups_.kernels();
    alignas(64) float rgba[4 * kDirectionRun];
    const int runs = (args.count + kDirectionRun - 1) / kDirectionRun;
    const auto count = [&](int k) { return std::min(kDirectionRun, args.count - k * kDirectionRun); };
    if (lookups_.map().empty) {
      std::fill_n(rgba, 4 * kDirectionRun, 0.0f);
      for (int k = 0; k < runs; ++k) kernels.store(args, k * kDirectionRun, count(k), rgba);
      return;
    }
    // A run's texels are on their way while the next one's are sought.
    ReflectionRun run[2];
    Places places[2];
    for (int k = 0; k <= runs; ++k) {
      if (k < runs) {
        const int first = k * kDirectionRun;
        ReflectionRun& next = run[k % 2];
        kernels.natural(args.in[0], first, count(k), next.normal);
        if (lookups_.positions()) kernels.natural(args.in[1], first, count(k), next.position);
        lookups_.reflect_kernels().reflect(lookups_.setup(), args.x + first, args.y, count(k), next);
        lookups_.Locate(0, next, count(k), places[k % 2]);
      }
      if (k > 0) {
        const ReflectionRun& last = run[1 - k % 2];
        lookups_.Gather(0, last, places[1 - k % 2], count(k - 1), rgba);
        lookups_.Finish(0, last, count(k - 1), rgba);
        kernels.store(args, (k - 1) * kDirectionRun, count(k - 1), rgba);
      }
    }
  }

 private:
  EnvironmentLookups lookups_;
};

class EnvironmentTileStage final : public graph::TileStage {
 public:
  EnvironmentTileStage(const EnvironmentStagePlan& plan, const graph::StageContext& context)
      : lookups_(plan, context), map_channels_(context.output.channel_count()) {}
  Roi InputRoi(int, const Roi& out) const override { return Inflate(out, reach(), reach()); }
  // Normals of 0: no neighbours.
  Wrap InputBorder(int) const override { return Wrap::kBlack; }
  graph::TileSize Preferred() const override { return {512, 8}; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& roi = args.out.roi;
    if (lookups_.map().empty) {
      for (int y = roi.y0; y < roi.y1; ++y) {
        std::fill_n(reinterpret_cast<float*>(args.out.At(roi.x0, y)),
                    ptrdiff_t{roi.width()} * args.out.channels, 0.0f);
      }
      return;
    }
    const Inputs inputs(args, lookups_.positions() ? 2 : 1);
    if (!lookups_.map().mips.empty()) return RunFiltered(args, inputs);
    ReflectionRun run;
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; x += kDirectionRun) {
        const int count = std::min(kDirectionRun, roi.x1 - x);
        Reflect(args, inputs, x, y, count, run);
        Shade(args, x, y, count, run, nullptr, nullptr, nullptr);
      }
    }
  }

 private:
  // Where the vectors' three channels are.
  struct Inputs {
    Inputs(const graph::TileArgs& args, size_t count) {
      for (size_t k = 0; k < count; ++k) {
        const std::span<const int> held = args.in_channels[k];
        for (int c = 0; c < 3; ++c) {
          at[k][c] = static_cast<int>(std::find(held.begin(), held.end(), c) - held.begin());
        }
      }
    }
    int at[2][3] = {};
  };

  int reach() const { return lookups_.map().mips.empty() ? 0 : 1; }
  void Reflect(const graph::TileArgs& args, const Inputs& inputs, int x, int y, int count,
               ReflectionRun& run) const {
    const auto planes = [&](size_t k, float(*plane)[kDirectionRun]) {
      lookups_.reflect_kernels().planes(reinterpret_cast<const float*>(args.in[k].At(x, y)),
                                        args.in[k].channels, inputs.at[k], count, plane);
    };
    planes(0, run.normal);
    if (lookups_.positions()) planes(1, run.position);
    lookups_.reflect_kernels().reflect(lookups_.setup(), x, y, count, run);
  }
  // Columns of as many pixels as a run has with its neighbours, three rows at a time.
  void RunFiltered(const graph::TileArgs& args, const Inputs& inputs) const {
    const Roi& roi = args.out.roi;
    ReflectionRun runs[3];
    MirrorRow rows[3];
    alignas(64) double level[kDirectionRun];
    PixelProbes probes[kDirectionRun];
    for (int x = roi.x0; x < roi.x1; x += kMirrorPixels) {
      const int count = std::min(kMirrorPixels, roi.x1 - x);
      for (int y = roi.y0 - 1; y <= roi.y1; ++y) {
        const auto of = [](int row) { return ((row % 3) + 3) % 3; };
        ReflectionRun& run = runs[of(y)];
        std::fill_n(run.valid, kDirectionRun, 0.0f);
        Reflect(args, inputs, x - 1, y, count + 2, run);
        for (int i = count + 2; i < kDirectionRun; ++i) {
          run.directions.x[i] = run.directions.y[i] = 0, run.directions.z[i] = 1, run.valid[i] = 0;
        }
        lookups_.mip_kernels().normalize(run, rows[of(y)]);
        if (y <= roi.y0) continue;
        // The row before, whose neighbours are known by now, without the pixel on its left.
        ReflectionRun& middle = runs[of(y - 1)];
        const MirrorRow& row = rows[of(y - 1)];
        if (lookups_.footprints()) {
          lookups_.FindProbes(rows[of(y - 2)], row, rows[of(y)], count, probes);
        } else {
          lookups_.mip_kernels().levels(*lookups_.map().mips[0], rows[of(y - 2)], row, rows[of(y)], count,
                                        level);
        }
        Directions& d = middle.directions;
        if (lookups_.footprints()) {  // as they are: a pixel that needs no more has a plain mirror's bits
          std::copy_n(d.x + 1, kDirectionRun - 1, d.x);
          std::copy_n(d.y + 1, kDirectionRun - 1, d.y);
          std::copy_n(d.z + 1, kDirectionRun - 1, d.z);
        } else {
          std::copy_n(row.x + 1, kDirectionRun - 1, d.x);
          std::copy_n(row.y + 1, kDirectionRun - 1, d.y);
          std::copy_n(row.z + 1, kDirectionRun - 1, d.z);
          d.moderate = true;
        }
        std::copy_n(middle.valid + 1, kDirectionRun - 1, middle.valid);
        std::copy_n(middle.fresnel + 1, kDirectionRun - 1, middle.fresnel);
        Shade(args, x, y - 1, count, middle, lookups_.footprints() ? nullptr : &row, level,
              lookups_.footprints() ? probes : nullptr);
      }
    }
  }
  // All channels of a run.
  void Shade(const graph::TileArgs& args, int x, int y, int count, const ReflectionRun& run,
             const MirrorRow* row, const double* level, const PixelProbes* probes) const {
    const int channels = args.out.channels;
    auto* const out = reinterpret_cast<float*>(args.out.At(x, y));
    bool direct = channels == 4 && map_channels_ == 4;
    for (int c = 0; c < channels; ++c) direct = direct && args.channels[static_cast<size_t>(c)] == c;
    alignas(64) float buffer[4 * kDirectionRun];
    Places places;
    for (int g = 0; g < (map_channels_ + 3) / 4; ++g) {
      float* const rgba = direct ? out : buffer;
      // Where all is seen from afar, the map itself is not.
      if (row == nullptr || *std::min_element(level, level + count) < 1) {
        lookups_.Locate(g, run, count, places);
        lookups_.Gather(g, run, places, count, rgba);
      }
      if (row != nullptr) lookups_.Filter(g, *row, level, count, rgba);
      if (probes != nullptr) lookups_.GatherOver(g, probes, count, rgba);
      lookups_.Finish(g, run, count, rgba);
      for (int c = 0; c < channels && !direct; ++c) {
        const int channel = args.channels[static_cast<size_t>(c)];
        if (channel / 4 != g) continue;
        for (int i = 0; i < count; ++i) out[ptrdiff_t{i} * channels + c] = buffer[4 * i + channel % 4];
      }
    }
  }
  EnvironmentLookups lookups_;
  int map_channels_;
};

}  // namespace

std::unique_ptr<graph::PointStage> MakeEnvironmentPointStage(const EnvironmentStagePlan& plan,
                                                             const graph::StageContext& context) {
  return std::make_unique<EnvironmentPointStage>(plan, context);
}
std::unique_ptr<graph::TileStage> MakeEnvironmentTileStage(const EnvironmentStagePlan& plan,
                                                           const graph::StageContext& context) {
  return std::make_unique<EnvironmentTileStage>(plan, context);
}

}  // namespace tessera::ops
