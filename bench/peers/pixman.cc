// pixman as a peer: premultiplied 8-bit pixels composited in place over a copy of the background, as it does
// everything; and the yardstick of two images read and one written.
#include "contestant.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <cstring>
#include <map>
#include <optional>

#include "tessera/render.h"
#include "tessera/targets.h"
#include "workers.h"

#if defined(TESSERA_BENCH_PIXMAN)
#include <pixman.h>
#endif

namespace tessera::bench {
namespace {

#if defined(TESSERA_BENCH_PIXMAN)
// pixman's operator for a step, where it has one.
std::optional<pixman_op_t> OperatorOf(const Step& step) {
  static const std::map<std::string, pixman_op_t> kModes = {{"over", PIXMAN_OP_OVER},
                                                            {"in", PIXMAN_OP_IN},
                                                            {"out", PIXMAN_OP_OUT},
                                                            {"atop", PIXMAN_OP_ATOP},
                                                            {"xor", PIXMAN_OP_XOR},
                                                            {"plus", PIXMAN_OP_ADD},
                                                            {"multiply", PIXMAN_OP_MULTIPLY},
                                                            {"screen", PIXMAN_OP_SCREEN},
                                                            {"overlay", PIXMAN_OP_OVERLAY},
                                                            {"color-dodge", PIXMAN_OP_COLOR_DODGE},
                                                            {"color-burn", PIXMAN_OP_COLOR_BURN},
                                                            {"soft-light", PIXMAN_OP_SOFT_LIGHT},
                                                            {"difference", PIXMAN_OP_DIFFERENCE},
                                                            {"hue", PIXMAN_OP_HSL_HUE},
                                                            {"luminosity", PIXMAN_OP_HSL_LUMINOSITY}};
  if (step.op() == "over") return PIXMAN_OP_OVER;
  if (step.op() != "blend") return std::nullopt;
  const auto found = kModes.find(step.arguments.Text("MODE"));
  return found == kModes.end() ? std::nullopt : std::optional(found->second);
}

class Pixman final : public Contestant {
 public:
  Pixman(const Setting& setting, pixman_op_t op)
      : op_(op), frame_(setting.frame), source_(Wrap(frame_.inputs[0])), target_(Wrap(frame_.output)) {}
  ~Pixman() override { pixman_image_unref(source_), pixman_image_unref(target_); }
  std::string Name() const override { return "pixman"; }
  // What it composites on is not part of its work.
  void Prepare() override {
    std::memcpy(frame_.output.view().data, frame_.inputs[1].view().data,
                4 * static_cast<size_t>(frame_.pixels()));
  }
  void Run() override {
    pixman_image_composite32(op_, source_, nullptr, target_, 0, 0, 0, 0, 0, 0, frame_.width, frame_.height);
  }

 private:
  static pixman_image_t* Wrap(const Image& image) {
    const ImageView v = image.view();
    return pixman_image_create_bits(PIXMAN_a8b8g8r8, v.roi.width(), v.roi.height(),
                                    reinterpret_cast<uint32_t*>(v.data), static_cast<int>(v.row_stride));
  }

  pixman_op_t op_;
  const Frame& frame_;
  pixman_image_t *source_, *target_;
};
#endif

// This library doing what pixman does: the background's pixels become the result.
class InPlace final : public Contestant {
 public:
  explicit InPlace(const Setting& setting) : frame_(setting.frame) {
    options_.threads = setting.threads;
    node_ = setting.task.Build({FromImage(frame_.inputs[0]), FromImage(frame_.output)}, frame_.output.spec());
  }
  std::string Name() const override { return "tessera in place"; }
  void Prepare() override {
    SetSimdTarget("auto");
    const ImageView from = frame_.inputs[1].view();
    std::memcpy(frame_.output.view().data, from.data,
                static_cast<size_t>(from.row_stride) * static_cast<size_t>(from.roi.height()));
  }
  void Run() override { RenderInto(node_, frame_.output.view(), options_); }

 private:
  const Frame& frame_;
  RenderOptions options_;
  Node node_;
};

// The wider of the two: what memory gives, not what instructions cost.
#if defined(__x86_64__)
// kCount images read and one written. Every image has load instructions of its own, as the prefetchers want
// it.
template <size_t kCount>
__attribute__((target("avx512f"))) void JoinLines512(const std::byte* const* from, std::byte* to,
                                                     size_t bytes) {
  for (size_t i = 0; i < bytes; i += 64) {
    __m512i sum = _mm512_loadu_si512(from[0] + i);
#pragma GCC unroll 16
    for (size_t k = 1; k < kCount; ++k) sum = _mm512_or_si512(sum, _mm512_loadu_si512(from[k] + i));
    _mm512_stream_si512(reinterpret_cast<__m512i*>(to + i), sum);
  }
  _mm_sfence();
}
template <size_t kCount>
void JoinLines(const std::byte* const* from, std::byte* to, size_t bytes) {
  for (size_t i = 0; i < bytes; i += 16) {
    __m128i sum = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from[0] + i));
#pragma GCC unroll 16
    for (size_t k = 1; k < kCount; ++k) {
      sum = _mm_or_si128(sum, _mm_loadu_si128(reinterpret_cast<const __m128i*>(from[k] + i)));
    }
    _mm_stream_si128(reinterpret_cast<__m128i*>(to + i), sum);
  }
  _mm_sfence();
}
#endif

// The yardstick of operations on two or sixteen images.
class Reads final : public Contestant {
 public:
  explicit Reads(const Setting& setting) : frame_(setting.frame), workers_(setting.threads) {
    bytes_ = static_cast<size_t>(frame_.pixels()) * 4 * PixelBytes(frame_.type) / 64 * 64;
  }
  static bool Fits(const Frame& frame) {
    return frame.plain() && (frame.inputs.size() == 2 || frame.inputs.size() == kMany);
  }
  std::string Name() const override {
    return frame_.inputs.size() == 2 ? "copy of two images into one" : "copy of sixteen images into one";
  }
  bool IsCopy() const override { return true; }
  void Run() override {
#if defined(__x86_64__)
    const bool wide = __builtin_cpu_supports("avx512f");
    const auto join = frame_.inputs.size() == 2 ? (wide ? JoinLines512<2> : JoinLines<2>)
                                                : (wide ? JoinLines512<kMany> : JoinLines<kMany>);
    workers_.Run([&](int i) {
      const size_t count = static_cast<size_t>(workers_.count()), index = static_cast<size_t>(i);
      const size_t first = bytes_ * index / count / 64 * 64, last = bytes_ * (index + 1) / count / 64 * 64;
      const std::byte* from[kMany] = {};
      for (size_t k = 0; k < frame_.inputs.size(); ++k) from[k] = frame_.inputs[k].view().data + first;
      join(from, frame_.output.view().data + first, last - first);
    });
#endif
  }

 private:
  static constexpr size_t kMany = 16;
  const Frame& frame_;
  size_t bytes_ = 0;
  Workers workers_;
};

}  // namespace

std::unique_ptr<Contestant> MakePixman(const Setting& setting) {
#if defined(TESSERA_BENCH_PIXMAN)
  const bool fits = setting.frame.plain() && setting.frame.type == PixelType::kUint8 &&
                    setting.frame.inputs.size() == 2 && setting.task.steps.size() == 1 &&
                    setting.threads == 1;
  if (fits) {
    if (const auto op = OperatorOf(setting.task.steps[0])) return std::make_unique<Pixman>(setting, *op);
  }
#else
  (void)setting;
#endif
  return nullptr;
}

std::unique_ptr<Contestant> MakeInPlace(const Setting& setting) {
  const bool fits = setting.frame.plain() && setting.frame.inputs.size() == 2 &&
                    setting.task.steps.size() == 1 &&
                    (setting.task.steps[0].op() == "over" || setting.task.steps[0].op() == "blend");
  return fits ? std::make_unique<InPlace>(setting) : nullptr;
}

std::unique_ptr<Contestant> MakeReads(const Setting& setting) {
#if defined(__x86_64__)
  return Reads::Fits(setting.frame) ? std::make_unique<Reads>(setting) : nullptr;
#else
  (void)setting;
  return nullptr;
#endif
}

}  // namespace tessera::bench
