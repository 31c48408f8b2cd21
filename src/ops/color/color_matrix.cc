// The colour matrix of 9 to 20 numbers, on premultiplied pixels too.
#include <bit>
#include <memory>
#include <string>
#include <vector>

#include "ops/color/color_ops.h"
#include "ops/modifiers.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/color/color_matrix.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

// Matrix on unpremultiplied colours; the input alpha comes back at the end. Alpha 0 skips both.
struct UnpremultipliedMatrixKernel {
  float m[4][5];
  float kept[4][4];  // all bits where there is a weight: a zero weight is none
  bool full, writes_alpha;

  HWY_INLINE s::V Term(s::V value, int i, int j, s::V sum) const {
    const s::D d;
    return hn::MulAdd(hn::And(value, hn::Set(d, kept[i][j])), hn::Set(d, m[i][j]), sum);
  }
  HWY_INLINE s::V Row(const s::Pixels& p, int i) const {
    s::V v = Term(p.r, i, 0, hn::Set(s::D(), m[i][4]));
    v = Term(p.g, i, 1, v);
    v = Term(p.b, i, 2, v);
    return full ? Term(p.a, i, 3, v) : v;
  }
  HWY_INLINE s::V Alpha(const s::Pixels& p) const {
    if (full) return Row(p, 3);
    const s::D d;
    return writes_alpha ? hn::MulAdd(p.a, hn::Set(d, m[3][3]), hn::Set(d, m[3][4])) : p.a;
  }
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    const s::D d;
    const s::V one = hn::Set(d, 1.0f);
    const s::V alpha = hn::IfThenElse(hn::Eq(p.a, hn::Zero(d)), one, p.a);
    const s::Pixels q{hn::Div(p.r, alpha), hn::Div(p.g, alpha), hn::Div(p.b, alpha), p.a};
    return {hn::Mul(Row(q, 0), alpha), hn::Mul(Row(q, 1), alpha), hn::Mul(Row(q, 2), alpha), Alpha(q)};
  }
};
std::unique_ptr<graph::PointStage> MakeUnpremultipliedMatrix(const double (&m)[4][5], bool full,
                                                             bool writes_alpha) {
  UnpremultipliedMatrixKernel k;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 5; ++j) k.m[i][j] = static_cast<float>(m[i][j]);
    for (int j = 0; j < 4; ++j) k.kept[i][j] = std::bit_cast<float>(k.m[i][j] == 0 ? 0u : ~0u);
  }
  k.full = full, k.writes_alpha = writes_alpha;
  return s::MakeFusedStage<1>(k);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(MakeUnpremultipliedMatrix);

class UnpremultipliedMatrixOp final : public graph::OpWith<ColorMatrixParams> {
 public:
  UnpremultipliedMatrixOp(ColorMatrixParams params, const AffineParams& affine)
      : OpWith(std::move(params)), affine_(affine) {}
  std::string Name() const override { return "ccmatrix"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireColor(Name(), inputs[0]);
    return inputs[0];
  }
  std::string Describe() const override { return "ccmatrix unpremult"; }
  bool ReadsAlpha() const override { return true; }
  bool WritesAlpha() const override {
    return affine_.structure == AffineClass::kFull || affine_.matrix[3][3] != 1 || affine_.matrix[3][4] != 0;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return HWY_DYNAMIC_DISPATCH(MakeUnpremultipliedMatrix)(
        affine_.matrix, affine_.structure == AffineClass::kFull, WritesAlpha());
  }

 private:
  AffineParams affine_;
};

// Rows of five, a column vector times each, as a square matrix and its bias.
ColorMatrixParams SvgMatrix(const std::vector<double>& rows, bool unpremult) {
  if (rows.size() != 20) {
    throw Error("ccmatrix", "found " + std::to_string(rows.size()) + " numbers, expected 20 with layout=svg");
  }
  std::vector<double> values;
  for (size_t i = 0; i < 16; ++i) values.push_back(rows[i / 4 * 5 + i % 4]);
  for (size_t i = 0; i < 4; ++i) values.push_back(rows[i * 5 + 4]);
  return {values, /*transpose=*/true, unpremult};
}

}  // namespace

OpInfo ColorMatrixInfo() {
  OpInfo info;
  info.name = "ccmatrix";
  info.family = "color";
  info.summary = "Multiply by a colour matrix";
  info.help =
      "M is row-major: 9 numbers (3x3), 12 (3x3, then the bias of R,G,B), 16 (4x4) or 20 (4x4, then the bias "
      "of R,G,B,A). As in oiiotool a pixel is a row vector, (R,G,B,A) M + bias; transpose=1 transposes the "
      "matrix, giving the column form. An image without alpha takes part with the upper left 3x3 and the "
      "bias. layout=svg takes the 20 numbers as SVG's feColorMatrix and canvas libraries write them: a row "
      "of 5 for each of R,G,B,A, weights of R,G,B,A and then the bias. They apply it to unpremultiplied "
      "colours and limit the result: --unpremult --ccmatrix:layout=svg M --clamp:min=0:max=1 --premult. "
      "unpremult=1 divides R,G,B by alpha before and multiplies by the same alpha after; where alpha is 0 "
      "it does neither. NaN or infinity passes from a channel to those whose weight of it is not 0. Source: "
      "McReynolds et al. 1997, 12.2.4; W3C Filter Effects 1, feColorMatrix.";
  info.bound = "4 u (sum of |m v| + |bias|), 8 u with unpremult";
  info.bound_u = 8;
  ParamInfo m;
  m.name = "M";
  m.type = ParamType::kNumbers;
  m.help = "9, 12, 16 or 20 numbers, row-major";
  m.min_count = 9, m.max_count = 20;
  m.counts = {9, 12, 16, 20};
  info.arguments = {m};
  ParamInfo unpremult = FlagModifier("unpremult", "1: unpremultiply before, premultiply after");
  info.modifiers = {
      OnlyWith("!layout=svg", FlagModifier("transpose", "1: transpose the matrix (pixels as columns)")),
      ChoiceModifier("layout", {"square", "svg"}, "square: a matrix, then the bias; svg: four rows of five"),
      unpremult};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    if (a.Text("layout") == "svg") return ColorMatrix(in[0], SvgMatrix(a.Numbers("M"), a.Flag("unpremult")));
    return ColorMatrix(in[0], {a.Numbers("M"), a.Flag("transpose"), a.Flag("unpremult")});
  };
  info.examples = {"0.9,0.1,0,0,0.05,0.8,0.1,0,0.1,0.1,0.9,0,0,0,0,1",
                   "0.4,0.3,0.2,-0.1,0.8,0.3,0.05,0.2,1.1",
                   "1,0.2,0,0,1,0,0.3,0,1,0.1,-0.2,0.3 transpose=1",
                   "0.5,0,0,0.1,0,0.5,0,0,0,0,0.5,0,0,0.1,0,0.9,0.1,0.2,0.3,0.05",
                   "0.9,0.1,0,0,0.8,0.2,0.1,0,0.9 unpremult=1",
                   "0.9,0.1,0,0,0,0.8,0.2,0,0.1,0,0.9,0,0,0,0,0.5,0,0,0.1,0.2 unpremult=1",
                   "0.7,0.2,0.1,0.1,0.2,0.7,0.1,0,0.1,0.1,0.8,0.1,0.1,0.1,0,0.8",
                   "0.8,0.1,0.1,0,0.05,0,0.9,0,0.1,0,0.2,0,0.7,0,-0.1,0,0,0,0.9,0.1 layout=svg"};
  info.identity = "1,0,0,0,1,0,0,0,1";
  return info;
}

}  // namespace ops

Node ColorMatrix(const Node& image, const ColorMatrixParams& params) {
  const std::vector<double>& v = params.values;
  if (v.size() != 9 && v.size() != 12 && v.size() != 16 && v.size() != 20) {
    throw Error("ccmatrix", "found " + std::to_string(v.size()) + " numbers, expected 9, 12, 16 or 20");
  }
  for (const double number : v) ops::RequireFinite("ccmatrix", "matrix entry", number);
  const ImageSpec& spec = image.spec();
  const bool has_alpha = spec.alpha >= 3;
  ops::AffineParams p;
  p.channels = spec.channel_count(), p.alpha = spec.alpha;
  const size_t n = v.size() >= 16 ? 4 : 3;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j) {
      if ((i == 3 || j == 3) && !has_alpha) continue;
      p.matrix[i][j] = params.transpose ? v[i * n + j] : v[j * n + i];
    }
    if (v.size() > n * n && (i < 3 || has_alpha)) p.matrix[i][4] = v[n * n + i];
  }
  p.structure = ops::AffineClass::kRgb;
  for (int i = 0; i < 3; ++i) {
    if (p.matrix[i][3] != 0 || p.matrix[3][i] != 0) p.structure = ops::AffineClass::kFull;
  }
  if (params.unpremult && has_alpha) {
    return graph::MakeNode(std::make_shared<const ops::UnpremultipliedMatrixOp>(params, p), {image});
  }
  return graph::MakeNode(ops::MakeAffine("ccmatrix", std::move(p), params), {image});
}

}  // namespace tessera
#endif  // HWY_ONCE
