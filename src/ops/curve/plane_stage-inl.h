// The stage of operations on single samples: runs each plane's work, by table where samples are codes.
#if defined(TESSERA_OPS_CURVE_PLANE_STAGE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_CURVE_PLANE_STAGE_INL_H_
#undef TESSERA_OPS_CURVE_PLANE_STAGE_INL_H_
#else
#define TESSERA_OPS_CURVE_PLANE_STAGE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <functional>
#include <memory>

#include "base/block.h"
#include "base/stage.h"
#include "simd/fused-inl.h"
#include "simd/gather-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::V;

// What work makes of the samples of 8-bit pixels.
class ByteTable {
 public:
  template <class Work>
  explicit ByteTable(const Work& work) {
    for (int c = 0; c < kCodes; ++c) results_[c] = static_cast<float>(c) / (kCodes - 1);
    work(results_, results_, kCodes);
  }
  // work(samples, samples, count), looked up where a whole vector's samples are code / 255.
  template <class Work>
  void Run(const Work& work, float* samples, int count) const {
    const s::D d;
    const s::DI di;
    for (int i = 0; i < count; i += s::kLanes) {
      const V v = hn::Load(d, samples + i);
      const s::VI code =
          hn::And(hn::NearestInt(hn::Mul(v, hn::Set(d, kCodes - 1.0f))), hn::Set(di, kCodes - 1));
      const V sample = s::FromUnorm8(hn::ConvertTo(d, code));
      // Bit by bit: minus zero is none.
      if (HWY_LIKELY(hn::AllTrue(di, hn::Eq(hn::BitCast(di, sample), hn::BitCast(di, v))))) {
        hn::Store(s::GatherFloats(results_, code), d, samples + i);
      } else {
        work(samples + i, samples + i, s::kLanes);
      }
    }
  }

 private:
  static constexpr int kCodes = 256;
  alignas(64) float results_[kCodes];
};

// Runs each active plane's work(in, out, count), Work::Of(plane), from and to planes or interleaved pixels.
template <class Work>
class PlaneStage final : public graph::PointStage {
 public:
  template <class Plane>
  PlaneStage(const Plane (&planes)[4], bool bytes, Context& context) {
    for (int p = 0; p < 4; ++p) {
      alike_[p] = p > 0 && planes[p] == planes[p - 1];
      work_[p] = alike_[p] ? work_[p - 1] : Work::Of(planes[p], context);
      const bool looks_up = bytes && work_[p].active() && !work_[p].quick();
      if (looks_up && !alike_[p]) tables_[p] = std::make_shared<ByteTable>(work_[p]);
    }
  }
  bool CanFuse(bool, PixelType) const override { return true; }
  bool AnyLength() const override { return true; }
  std::unique_ptr<graph::PointStage> OfSamples(int channels) const override {
    if (!work_[0].active() || !std::all_of(alike_ + 1, alike_ + channels, std::identity())) return nullptr;
    auto stage = std::make_unique<PlaneStage>(*this);
    for (int p = 1; p < 4; ++p) {
      stage->work_[p] = work_[0];
      stage->alike_[p] = true;
      stage->tables_[p] = nullptr;
    }
    return stage;
  }
  void Run(const graph::PointArgs& args) const override {
    // Results may lie where other planes' samples do, so that all are read before any is written.
    // Short chunks: reading and writing memory goes on beside the arithmetic. Floats, whose lines are the
    // most, in shorter ones.
    constexpr int kChunk = 64;
    static_assert(kBlockPixels % kChunk == 0);
    const bool floats = args.source.read != nullptr && args.source.type == PixelType::kFloat;
    const int chunk = floats ? kChunk / 2 : kChunk;
    alignas(64) float samples[4 * kChunk];
    const s::D d;
    for (int first = 0; first < args.count; first += chunk) {
      const int count = std::min(chunk, args.count - first);
      float* const planes[4] = {samples, samples + count, samples + 2 * count, samples + 3 * count};
      s::LoadChunk(args, first, count, planes);
      // Planes with the same curve are one run: its tables are loaded once.
      for (int p = 0, next = 1; p < 4; p = next) {
        for (next = p + 1; next < 4 && alike_[next]; ++next) continue;
        if (tables_[p]) {
          tables_[p]->Run(work_[p], planes[p], (next - p) * count);
        } else if (work_[p].active()) {
          work_[p](planes[p], planes[p], (next - p) * count);
        }
      }
      s::StoreChunk(args, first, count, [&](int i) HWY_ATTR {
        return s::Pixels{hn::Load(d, planes[0] + i), hn::Load(d, planes[1] + i), hn::Load(d, planes[2] + i),
                         hn::Load(d, planes[3] + i)};
      });
    }
  }

 private:
  Work work_[4];
  bool alike_[4];  // the plane before has the same
  std::shared_ptr<const ByteTable> tables_[4];
};

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
