// Tangent-space normal maps on surfaces, and surface and bump normals combined.
#include "ops/bump/frame.h"

#include <cmath>
#include <string>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/bump/bump_ops.h"
#include "ops/environment/environment_ops.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

ImageSpec RequireNormals(const std::string& op, std::span<const ImageSpec> inputs) {
  for (const ImageSpec& input : inputs) graph::RequireColor(op, input);
  graph::RequireSameWindow(op, inputs);
  return inputs[0];
}

class TangentNormalsOp final : public graph::OpWith<TangentNormalsParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "tangentnormals"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    return RequireNormals(Name(), inputs);
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakeTangentStage(params());
  }
};

class SurfaceBumpOp final : public graph::OpWith<SurfaceBumpParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "surfacebump"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    return RequireNormals(Name(), inputs);
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakeSurfaceStage(params());
  }
};

class CombineNormalsOp final : public graph::OpWith<CombineNormalsParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "combinenormals"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    return RequireNormals(Name(), inputs);
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakeCombineStage(params());
  }
};

}  // namespace

OpInfo TangentNormalsInfo() {
  OpInfo info;
  info.name = "tangentnormals";
  info.family = "bump";
  info.inputs = 3;
  info.summary = "Put a tangent-space normal map on a surface";
  info.help =
      "MAP NORMAL TANGENT --tangentnormals: the map's (a,b,c), codes (n+1)/2 unless packed=0, become a T + b "
      "B + c N of unit length; T is the tangent made perpendicular to N, B = N x T (T x N with "
      "lefthanded=1). A tangent along N or of length 0 leaves N; a normal that is 0 or not finite gives 0. "
      "inverse=1 brings directions (packed=0: as they are) into the frame: (v.T, v.B, v.N). Other channels "
      "of the map pass. Source: McReynolds et al. 1997, 8.3.1.";
  info.bound = "4 u times the length of (a,b,c)";
  info.bound_u = 4;
  info.modifiers = {FlagModifier("packed", "the first image holds codes in [0,1]", "1"),
                    FlagModifier("lefthanded", "B = T x N"),
                    FlagModifier("inverse", "into the surface's frame")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return TangentNormals(in[0], NormalsOf(in[1]), in[2],
                          {a.Flag("packed"), a.Flag("lefthanded"), a.Flag("inverse")});
  };
  info.examples = {"", "packed=0 lefthanded=1", "packed=0 inverse=1", "inverse=1 lefthanded=1"};
  return info;
}

OpInfo SurfaceBumpInfo() {
  OpInfo info;
  info.name = "surfacebump";
  info.family = "bump";
  info.inputs = 4;
  info.summary = "Put a normal map on a surface by the surface's derivatives";
  info.help =
      "MAP NORMAL PU PV --surfacebump, after Blinn: PU and PV are the derivatives of the position by the "
      "surface's parameters u and v, of any length and angle. The map's (a,b,c) = (-f_u,-f_v,1) of a height "
      "f along the normal, codes (n+1)/2 unless packed=0, become normalise(c |PU x PV| N + s (a (PV x N) + b "
      "(N x PU))), s = scale=, negative where PU x PV points against N. PU and PV without area leave N; a "
      "normal that is 0 or not finite gives 0. Other channels of the map pass. Source: Blinn 1978; Peercy "
      "et al. 1997, equations 1 to 6.";
  info.bound = "4 u";
  info.bound_u = 4;
  info.modifiers = {FlagModifier("packed", "the first image holds codes in [0,1]", "1"),
                    NumberModifier("scale", "1", -1e30, 1e30, "of the heights")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return SurfaceBump(in[0], NormalsOf(in[1]), in[2], in[3], {a.Flag("packed"), a.Number("scale")});
  };
  info.examples = {"", "packed=0 scale=0.3"};
  return info;
}

OpInfo CombineNormalsInfo() {
  OpInfo info;
  info.name = "combinenormals";
  info.family = "bump";
  info.inputs = 2;
  info.summary = "Bend normals by the normals of a bump";
  info.help =
      "NORMAL BUMP --combinenormals K: normalise(K V + B) of the unit vectors V and B, equation 7 of the "
      "hypertexture paper; larger K is smoother (B at right angles tilts by 45 degrees at K=1, 27 at 2, 7 at "
      "8); V where the sum is shorter than 1e-6. method=tilt: normalise(V - K (B - (B.V) V)) of a gradient B "
      "of any length, which tilts by less than 90 degrees. Unpack codes first (--normals:unpack=1). A normal "
      "V that is 0 or not finite gives 0. Source: Miller and Jones 2005, "
      "equation 7.";
  info.bound = "4 u";
  info.bound_u = 4;
  info.arguments = {
      NumberModifier("K", "", -1e6, 1e6, "weight of the surface's normal (sum), of the gradient (tilt)")};
  info.modifiers = {ChoiceModifier("method", {"sum", "tilt"}, "how they are combined")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return CombineNormals(
        NormalsOf(in[0]), NormalsOf(in[1]),
        {a.Number("K"), a.Text("method") == "tilt" ? CombineMethod::kTilt : CombineMethod::kSum});
  };
  info.examples = {"2", "0.5", "-0.75 method=tilt"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node TangentNormals(const Node& map, const Node& normals, const Node& tangents,
                    const TangentNormalsParams& params) {
  return graph::MakeNode(std::make_shared<const ops::TangentNormalsOp>(params), {map, normals, tangents});
}

Node SurfaceBump(const Node& map, const Node& normals, const Node& pu, const Node& pv,
                 const SurfaceBumpParams& params) {
  if (!(std::fabs(params.scale) <= 1e30)) {
    throw Error("surfacebump", "found scale=" + base::NumberText(params.scale) + ", expected -1e30 to 1e30");
  }
  return graph::MakeNode(std::make_shared<const ops::SurfaceBumpOp>(params), {map, normals, pu, pv});
}

Node CombineNormals(const Node& normals, const Node& bump, const CombineNormalsParams& p) {
  const bool sum = p.method == CombineMethod::kSum;
  if (!(sum ? p.k > 0 && p.k <= 1e6 : p.k >= -1e6 && p.k <= 1e6)) {
    throw Error("combinenormals", "found k=" + base::NumberText(p.k) + ", expected " +
                                      (sum ? "more than 0, at most 1000000" : "-1000000 to 1000000"));
  }
  return graph::MakeNode(std::make_shared<const ops::CombineNormalsOp>(p), {normals, bump});
}

}  // namespace tessera
