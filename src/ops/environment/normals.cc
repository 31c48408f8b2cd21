// Normal images: packed and unpacked, transformed, mirrored, normalised.
#include <algorithm>
#include <memory>

#include "graph/op.h"
#include "ops/environment/environment_ops.h"
#include "ops/environment/point_stages.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"

namespace tessera::ops {
namespace {

NormalsSetup SetupOf(const NormalsParams& p) {
  NormalsSetup s;
  if (p.unpack) s.in_scale = 2, s.in_bias = -1;
  s.out_scale = (p.flip ? -1 : 1) * (p.pack ? 0.5 : 1);
  s.out_bias = p.pack ? 0.5 : 0;
  s.normalize = p.normalize;
  if (p.matrix) {
    const Matrix4& m = *p.matrix;
    const Matrix4 upper = {m[0], m[1], m[2], 0, m[4], m[5], m[6], 0, m[8], m[9], m[10], 0, 0, 0, 0, 1};
    const Matrix4 inverse = Inverse(upper, "normals matrix");
    for (size_t i = 0; i < 9; ++i) s.matrix[i] = inverse[i % 3 * 4 + i / 3];
    s.turned = true;
  }
  if (p.reflect) {
    const Vector3 v = Normalized(*p.reflect);
    std::copy(v.begin(), v.end(), s.view);
    s.reflected = true;
  }
  return s;
}

class NormalsOp final : public graph::OpWith<NormalsParams> {
 public:
  explicit NormalsOp(const NormalsParams& p) : OpWith(p), setup_(SetupOf(p)) {}
  std::string Name() const override { return "normals"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireColor(Name(), inputs[0]);
    return inputs[0];
  }
  bool IsIdentity() const override {
    const NormalsParams& p = params();
    return !p.unpack && !p.matrix && !p.reflect && !p.normalize && !p.flip && !p.pack;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakeNormalsStage(setup_);
  }

 private:
  NormalsSetup setup_;
};

}  // namespace

OpInfo NormalsInfo() {
  OpInfo info;
  info.name = "normals";
  info.family = "environment";
  info.summary = "Pack, unpack, transform, mirror and normalise normals";
  info.help =
      "Acts on the first three channels, or on an AOV file's normals alone, in this order: unpack=1 takes "
      "codes, n = 2 c - 1; matrix= is the "
      "matrix of positions, and normals take the inverse transpose of its upper 3x3 (a singular one is "
      "refused); reflect=x,y,z mirrors the direction to the viewer, 2 (n.v) n - v (n.n); unit length "
      "(normalize=0 leaves it); flip=1 turns round; pack=1 gives codes, c = (n + 1)/2, for storage as "
      "integers. Zero normals stay 0 (packed 1/2), NaN stays NaN. Computed in double: any length will do. "
      "Other channels pass. Source: Heidrich et al. 1999, 6.";
  info.bound = "2 u * |result| (packed: 2 u)";
  info.bound_u = 2;
  info.modifiers = {FlagModifier("unpack", "from codes in [0,1]"),
                    NumbersModifier("matrix", "", {9, 16}, "of positions, row-major"),
                    NumbersModifier("reflect", "", {3}, "to the viewer"),
                    FlagModifier("normalize", "to unit length", "1"),
                    FlagModifier("flip", "turn round"),
                    FlagModifier("pack", "to codes in [0,1]")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    NormalsParams p;
    p.unpack = a.Flag("unpack"), p.normalize = a.Flag("normalize"), p.flip = a.Flag("flip"),
    p.pack = a.Flag("pack");
    if (a.Given("matrix")) p.matrix = MatrixOf(a.Numbers("matrix"));
    if (a.Given("reflect")) p.reflect = VectorOf(a.Numbers("reflect"));
    return TransformNormals(NormalsOf(in[0]), p);
  };
  info.examples = {"", "unpack=1 matrix=1,0,0,0,2,0,0,0,0.5", "pack=1 flip=1", "reflect=0,0,1 normalize=0",
                   "unpack=1 normalize=0 pack=1 matrix=0.8,0.6,0,1,-0.6,0.8,0,2,0,0,1,3,0,0,0,1"};
  info.identity = "normalize=0";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node TransformNormals(const Node& normals, const NormalsParams& params) {
  if (params.reflect) ops::RequireVector("normals", "reflect", *params.reflect, true);
  return graph::MakeNode(std::make_shared<const ops::NormalsOp>(params), {normals});
}

}  // namespace tessera
