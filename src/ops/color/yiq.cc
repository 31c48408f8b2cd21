// YIQ and its inverse.
#include "ops/color/color_ops.h"
#include "ops/modifiers.h"
#include "tessera/color_state.h"

namespace tessera {
namespace ops {
namespace {

constexpr Matrix3 kYiq = {{{0.299, 0.587, 0.114}, {0.596, -0.275, -0.321}, {0.212, -0.523, 0.311}}};

Matrix3 Inverse(const Matrix3& m) {
  const auto cofactor = [&m](size_t i, size_t j) {
    const size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[a][c] * m[b][d] - m[a][d] * m[b][c];
  };
  const double det = m[0][0] * cofactor(0, 0) + m[0][1] * cofactor(0, 1) + m[0][2] * cofactor(0, 2);
  Matrix3 inverse;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) inverse[i][j] = cofactor(j, i) / det;
  }
  return inverse;
}

}  // namespace

OpInfo YiqInfo() {
  OpInfo info;
  info.name = "yiq";
  info.family = "color";
  info.summary = "RGB to YIQ, or back";
  info.help =
      "Y = 0.299 R + 0.587 G + 0.114 B, I = 0.596 R - 0.275 G - 0.321 B, Q = 0.212 R - 0.523 G + 0.311 B, in "
      "the places of R, G, B; names and alpha are kept. inverse=1 goes back with the inverse of exactly "
      "these numbers, computed in double. I and Q are negative for many colours: store them as float or "
      "half. Source: McReynolds et al. 1997, 12.2.4.";
  info.bound = "4 u sum of |m v|";
  info.bound_u = 4;
  info.modifiers = {FlagModifier("inverse", "1: from YIQ to RGB")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Yiq(in[0], {a.Flag("inverse")});
  };
  info.examples = {"", "inverse=1"};
  return info;
}

}  // namespace ops

Node Yiq(const Node& image, const YiqParams& params) {
  const Node result =
      ops::MakeRgbNode("yiq", image, params.inverse ? ops::Inverse(ops::kYiq) : ops::kYiq, params);
  return WithColorState(result, {"", ColorStateOf(image.spec()).premultiplied});
}

}  // namespace tessera
