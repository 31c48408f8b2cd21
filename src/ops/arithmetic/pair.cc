// Two images, sample by sample: add, subtract, multiply, divide, minimum, maximum, absolute difference.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/arithmetic/operands.h"
#include "ops/union.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/arithmetic/pair.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/pair-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

// Two samples to one; `Codes` is the same of 8-bit samples, correctly rounded.
using s::V;
using M = hn::Mask<s::D>;
struct AddF {
  static constexpr bool kSamplesAlike = true;
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return hn::Add(a, b); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) { return hn::SaturatedAdd(a, b); }
};
struct SubF {
  static constexpr bool kSamplesAlike = true;
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return hn::Sub(a, b); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) { return hn::SaturatedSub(a, b); }
};
struct MulF {
  static constexpr bool kSamplesAlike = true;
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return hn::Mul(a, b); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) {
    return s::FromEvenOdd(s::Div255(hn::Mul(s::Even(a), s::Even(b))),
                          s::Div255(hn::Mul(s::Odd(a), s::Odd(b))));
  }
};
struct DivF {
  static constexpr bool kSamplesAlike = true;
  HWY_INLINE V operator()(V a, V b, V, V, M) const {
    const V zero = hn::Zero(s::D());
    return hn::IfThenElse(hn::Eq(b, zero), zero, hn::Div(a, b));
  }
};
struct AbsDiffF {
  static constexpr bool kSamplesAlike = true;
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return hn::Abs(hn::Sub(a, b)); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) {
    return hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a));
  }
};
struct MinF {
  static constexpr bool kSamplesAlike = true;
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return s::MinNumber(a, b); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) { return hn::Min(a, b); }
};
struct MaxF {
  static constexpr bool kSamplesAlike = true;
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return s::MaxNumber(a, b); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) { return hn::Max(a, b); }
};

template <class F>
std::unique_ptr<graph::PointStage> MakePair() {
  return s::MakePairStage(F());
}
std::unique_ptr<graph::PointStage> MakeAdd() { return MakePair<AddF>(); }
std::unique_ptr<graph::PointStage> MakeSub() { return MakePair<SubF>(); }
std::unique_ptr<graph::PointStage> MakeMul() { return MakePair<MulF>(); }
std::unique_ptr<graph::PointStage> MakeDiv() { return MakePair<DivF>(); }
std::unique_ptr<graph::PointStage> MakeAbsDiff() { return MakePair<AbsDiffF>(); }
std::unique_ptr<graph::PointStage> MakeMin() { return MakePair<MinF>(); }
std::unique_ptr<graph::PointStage> MakeMax() { return MakePair<MaxF>(); }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeAdd);
HWY_EXPORT(MakeSub);
HWY_EXPORT(MakeMul);
HWY_EXPORT(MakeDiv);
HWY_EXPORT(MakeAbsDiff);
HWY_EXPORT(MakeMin);
HWY_EXPORT(MakeMax);

std::unique_ptr<graph::PointStage> Make(const std::string& name) {
  if (name == "add") return HWY_DYNAMIC_DISPATCH(MakeAdd)();
  if (name == "sub") return HWY_DYNAMIC_DISPATCH(MakeSub)();
  if (name == "mul") return HWY_DYNAMIC_DISPATCH(MakeMul)();
  if (name == "div") return HWY_DYNAMIC_DISPATCH(MakeDiv)();
  if (name == "absdiff") return HWY_DYNAMIC_DISPATCH(MakeAbsDiff)();
  if (name == "min") return HWY_DYNAMIC_DISPATCH(MakeMin)();
  return HWY_DYNAMIC_DISPATCH(MakeMax)();
}

class PairOp final : public graph::OpWith<NoParams> {
 public:
  explicit PairOp(const char* name) : OpWith({}), name_(name) {}
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = RequireSameShape(name_, inputs);
    spec.display_window = Union(spec.display_window, inputs[1].display_window);
    return spec;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return Make(name_);
  }

 private:
  const char* name_;
};

// A second image of one channel (a matte, a shadow) goes with every channel of the first one.
Node Pair(const char* name, const Node& a, const Node& b) {
  Node second = b;
  if (a && b && b.spec().channel_count() == 1 && a.spec().channel_count() > 1) {
    std::vector<ChannelChoice> copies;
    for (const std::string& channel : a.spec().channels) copies.push_back({0, 0, channel});
    second = SelectChannels(b, copies);
  }
  return graph::MakeNode(std::make_shared<const PairOp>(name), OnUnion({a, second}));
}

// What the seven rows have in common.
OpInfo Row(const char* name, const char* summary, const char* formula, const char* hard_cases) {
  OpInfo info;
  info.name = name;
  info.family = "arithmetic";
  info.inputs = 2;
  info.summary = summary;
  info.help =
      std::string("Each sample of the result is ") + formula +
      ", where A is the lower and B the upper image of the stack; alpha and further channels are treated "
      "like the others. The result covers both images' windows, data and display, as oiiotool's; a pixel that "
      "one of them does not have is 0 there. Both need the same number of channels (--ch makes it equal); a B "
      "of one channel goes with every channel of A. The result keeps the names, alpha and metadata of A.\n" +
      hard_cases;
  info.bound = "1 rounding: u * |result|";
  info.bound_u = 1;
  info.examples = {""};
  return info;
}

constexpr char kIeee[] =
    "NaN and infinities follow IEEE 754. Nothing is clamped: integer outputs saturate when they are written.";
constexpr char kNumberWins[] =
    "A number wins over NaN; the result is NaN only where both are. Samples keep their bits.";

}  // namespace

OpInfo AddInfo() {
  OpInfo info = Row("add", "Add two images", "A + B", kIeee);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Add(in[0], in[1]); };
  return info;
}
OpInfo SubInfo() {
  OpInfo info = Row("sub", "Subtract the upper image from the lower", "A - B", kIeee);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Sub(in[0], in[1]); };
  return info;
}
OpInfo MulInfo() {
  OpInfo info = Row("mul", "Multiply two images", "A * B", kIeee);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Mul(in[0], in[1]); };
  return info;
}
OpInfo DivInfo() {
  OpInfo info =
      Row("div", "Divide the lower image by the upper", "A / B",
          "Where B is 0, of either sign, the result is 0 whatever A is, NaN and infinity included, as "
          "oiiotool's; else NaN and infinities follow IEEE 754. Nothing is clamped: a quotient beyond "
          "float's range is infinite.");
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Div(in[0], in[1]); };
  return info;
}
OpInfo AbsDiffInfo() {
  OpInfo info = Row("absdiff", "Absolute difference of two images", "|A - B|", kIeee);
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return AbsDiff(in[0], in[1]);
  };
  return info;
}
OpInfo MinInfo() {
  OpInfo info = Row("min", "The smaller sample of two images", "min(A, B)", kNumberWins);
  info.bound = "exact";
  info.bound_u = 0;
  info.identity = " ";  // without a word, of a picture and itself
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Min(in[0], in[1]); };
  return info;
}
OpInfo MaxInfo() {
  OpInfo info = Row("max", "The larger sample of two images", "max(A, B)", kNumberWins);
  info.bound = "exact";
  info.bound_u = 0;
  info.identity = " ";  // without a word, of a picture and itself
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Max(in[0], in[1]); };
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Add(const Node& a, const Node& b) { return ops::Pair("add", a, b); }
Node Sub(const Node& a, const Node& b) { return ops::Pair("sub", a, b); }
Node Mul(const Node& a, const Node& b) { return ops::Pair("mul", a, b); }
Node Div(const Node& a, const Node& b) { return ops::Pair("div", a, b); }
Node AbsDiff(const Node& a, const Node& b) { return ops::Pair("absdiff", a, b); }
Node Min(const Node& a, const Node& b) { return ops::Pair("min", a, b); }
Node Max(const Node& a, const Node& b) { return ops::Pair("max", a, b); }

}  // namespace tessera
#endif  // HWY_ONCE
