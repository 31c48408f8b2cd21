// Phong's lighting: what is validated, and what is the same for every pixel.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/environment/environment_ops.h"
#include "ops/environment/point_stages.h"
#include "ops/environment/projection.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "tessera/error.h"
#include "tessera/ops/shade.h"
#include "tessera/render.h"

namespace tessera::ops {
namespace {

// x^e for x >= 0; 0 at 0 whatever e.
double PowerOf(double x, double e) { return x > 0 ? std::pow(x, e) : 0; }

PhongSetup SetupOf(const PhongParams& params, bool positions) {
  PhongSetup s;
  s.params = params;
  s.positions = positions;
  PhongParams& p = s.params;
  std::copy(p.light.begin(), p.light.end(), s.light);
  if (!p.point) p.light = Normalized(p.light);
  p.view = Normalized(p.view);
  p.spot_direction = Normalized(p.spot_direction);
  if (p.point && (p.spot_cutoff < 180 || p.spot_exponent > 0)) {
    s.spot_cosine = std::cos(p.spot_cutoff * std::numbers::pi / 180);
  }
  const Vector3 half = {p.light[0] + p.view[0], p.light[1] + p.view[1], p.light[2] + p.view[2]};
  // Opposite directions leave nothing but rounding.
  const Vector3 unit = Dot(half, half) > 1e-30 ? Normalized(half) : Vector3{};
  for (size_t k = 0; k < 3; ++k) s.halfway[k] = unit[k];
  if (p.table > 0) {
    const double codes = std::ldexp(1.0, p.bits) - 1;
    for (int i = 0; i < p.table; ++i) {
      const double v = PowerOf(static_cast<double>(i) / (p.table - 1), p.exponent);
      s.table.push_back(p.bits > 0 ? std::nearbyint(v * codes) / codes : v);
    }
  }
  return s;
}

class PhongOp final : public graph::OpWith<PhongParams> {
 public:
  PhongOp(const PhongParams& p, bool positions)
      : OpWith(p), positions_(positions), setup_(SetupOf(p, positions)) {}
  std::string Name() const override { return "phong"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireColor(Name(), inputs[0]);
    if (positions_) {
      graph::RequireColor(Name(), inputs[1]);
      graph::RequireSameWindow(Name(), inputs);
    }
    ImageSpec spec = inputs[0];
    spec.channels = {"R", "G", "B"};
    spec.alpha = -1;
    return spec;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakePhongStage(setup_);
  }

 private:
  bool positions_;
  PhongSetup setup_;
};

void Check(const PhongParams& p, bool positions) {
  RequireVector("phong", "light", p.light, !p.point);
  RequireVector("phong", "view", p.view, true);
  RequireVector("phong", "spot", p.spot_direction, true);
  if (p.eye) RequireVector("phong", "eye", *p.eye, false);
  if (!positions && (p.point || p.eye)) {
    throw Error("phong", std::string("found ") + (p.point ? "a point light" : "an eye") +
                             " without positions, expected them as a second image");
  }
  const auto range = [](const char* name, double v, double low, double high) {
    if (v >= low && v <= high) return;
    throw Error("phong", std::string("found ") + name + "=" + base::NumberText(v) + ", expected " +
                             base::NumberText(low) + " to " + base::NumberText(high));
  };
  range("exponent", p.exponent, 0, 10000);
  range("spotcutoff", p.spot_cutoff, 0, 180);
  range("spotexponent", p.spot_exponent, 0, 10000);
  range("bits", p.bits, 0, 24);
  for (const auto* list : {&p.ambient, &p.diffuse, &p.specular, &p.emission}) {
    for (const double v : *list) range("coefficient", v, -1e30, 1e30);
  }
  for (const double v : p.attenuation) range("attenuation", v, 0, 1e30);
  if (p.table < 0 || p.table == 1 || p.table > 1 << 20) {
    throw Error("phong", "found table=" + std::to_string(p.table) + ", expected 0 (none) or 2 to 1048576");
  }
  if (p.bits > 0 && p.table == 0) throw Error("phong", "found bits without a table, expected table=N");
}

std::array<double, 3> ColorOf(const std::vector<double>& v) {
  return v.size() == 1 ? std::array<double, 3>{v[0], v[0], v[0]} : std::array<double, 3>{v[0], v[1], v[2]};
}

}  // namespace

OpInfo PhongInfo() {
  OpInfo info;
  info.name = "phong";
  info.family = "environment";
  info.inputs = 1;
  info.operands = [](const Arguments& a) { return a.Flag("position") ? 2 : 1; };
  info.summary = "Light a normal image after Phong";
  info.help =
      "NORMAL --phong:light=x,y,z:exponent=E gives R,G,B = emission + a f (ambient + max(l.n,0) diffuse + "
      "[l.n > 0] h^E specular); h is max(s.n,0) with s = (l+v)/|l+v| (highlight=halfway) or max(r.l,0) with "
      "r the mirrored view (highlight=reflection). light= and view= point to a distant light and viewer. "
      "NORMAL POSITION --phong:position=1 takes a viewer's place, eye=, and with point=1 the light's place: "
      "a = 1/(kc + kl d + kq d^2) of attenuation=kc,kl,kq, and f a spotlight: max(cos,0)^spotexponent of the "
      "angle to spot=, its direction, within spotcutoff= half the cone's angle. spot= alone is SVG's default: "
      "the cosine, no cone. Normals and positions of an AOV file are found by their names. "
      "Coefficients are one number or "
      "three; specular=1 when only exponent is given.\n"
      "table=N reads the power from N entries as the papers do, bits=8 or 12 through a framebuffer of so "
      "many bits: the bands of 8 bits at exponent 50 are the papers'. Normals (and positions) that are 0, "
      "NaN or infinite give 0. Source: Phong 1975; Blinn 1977; McReynolds et al. 1997, 18.2.";
  info.bound = "4 u times the sum of the terms' magnitudes";
  info.bound_u = 4;
  const auto color = [](const char* name, const char* value, const char* help) {
    return NumbersModifier(name, value, {1, 3}, help);
  };
  info.modifiers = {
      NumbersModifier("light", "0,0,1", {3}, "to the light, or its place with point=1"),
      NumberModifier("exponent", "0", 0, 10000, "of the highlight"),
      color("ambient", "0", "coefficient"),
      color("diffuse", "1", "coefficient"),
      color("specular", "0", "coefficient; 1 where exponent= is given"),
      color("emission", "0", "added"),
      ChoiceModifier("highlight", {"halfway", "reflection"}, "its cosine"),
      OnlyWith("!eye", NumbersModifier("view", "0,0,1", {3}, "to a distant viewer")),
      FlagModifier("position", "positions are given, above the normals"),
      OnlyWith("position", NumbersModifier("eye", "", {3}, "the viewer's place")),
      OnlyWith("position", FlagModifier("point", "light= is a place")),
      OnlyWith("point", NumbersModifier("attenuation", "1,0,0", {3}, "constant, linear, quadratic")),
      OnlyWith("point", NumbersModifier("spot", "0,0,-1", {3}, "where a spotlight shines")),
      OnlyWith("point",
               NumberModifier("spotcutoff", "180", 0, 180, "half the cone's angle in degrees; 180: no cone")),
      OnlyWith("point", NumberModifier("spotexponent", "0", 0, 10000,
                                       "of the spot's cosine; 1 where spot= is given alone")),
      IntegerModifier("table", "0", 0, 1 << 20, "entries of a table of powers; 0: none"),
      OnlyWith("table", IntegerModifier("bits", "0", 0, 24, "of a framebuffer; 0: none"))};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    PhongParams p;
    p.light = VectorOf(a.Numbers("light"));
    p.view = VectorOf(a.Numbers("view"));
    if (a.Given("eye")) p.eye = VectorOf(a.Numbers("eye"));
    p.point = a.Flag("point");
    p.exponent = a.Number("exponent");
    p.ambient = ColorOf(a.Numbers("ambient")), p.diffuse = ColorOf(a.Numbers("diffuse"));
    p.specular = ColorOf(a.Numbers("specular")), p.emission = ColorOf(a.Numbers("emission"));
    if (a.Given("exponent") && !a.Given("specular")) p.specular = {1, 1, 1};
    if (a.Text("highlight") == "reflection") p.highlight = Highlight::kReflection;
    p.attenuation = ColorOf(a.Numbers("attenuation"));
    p.spot_direction = VectorOf(a.Numbers("spot"));
    p.spot_cutoff = a.Number("spotcutoff"), p.spot_exponent = a.Number("spotexponent");
    p.table = a.Integer("table"), p.bits = a.Integer("bits");
    // A direction and nothing more is SVG's spot.
    if (a.Given("spot") && !a.Given("spotcutoff") && !a.Given("spotexponent")) p.spot_exponent = 1;
    const Node normals = NormalsOf(in[0]);
    return in.size() == 2 ? Phong(normals, PositionsOf(in[1]), p) : Phong(normals, p);
  };
  info.examples = {"exponent=50 light=1,1,1",
                   "light=-2,1,0.5 ambient=0.1 diffuse=0.5,0.25,1 emission=0.25",
                   "exponent=7.5 highlight=reflection light=0.3,-0.2,1 view=0,1,2 specular=2,1,0",
                   "position=1 point=1 light=3,4,-5 eye=1,2,3 exponent=12 attenuation=1,0.5,0.25",
                   "position=1 point=1 light=0,0,5 spot=0.1,0,-1 spotcutoff=170 spotexponent=2 specular=1",
                   "position=1 point=1 light=0,0,5 spot=0.1,0,-1",
                   "exponent=20 table=256 light=1,0,1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Phong(const Node& normals, const PhongParams& params) {
  ops::Check(params, false);
  return graph::MakeNode(std::make_shared<const ops::PhongOp>(params, false), {normals});
}

Node Phong(const Node& normals, const Node& positions, const PhongParams& params) {
  ops::Check(params, true);
  return graph::MakeNode(std::make_shared<const ops::PhongOp>(params, true), {normals, positions});
}

Image PhongMap(EnvironmentMap map, int width, int height, const Vector3& light, double exponent,
               PixelType type) {
  ops::RequireVector("phong map", "light", light, true);
  const ops::MapLayout layout = ops::LayoutOf("phong map", map, width, height);
  const Vector3 to = Normalized(light);
  ImageSpec spec(width, height, 1);
  const Image image(spec);
  for (size_t face = 0; face < layout.faces.size(); ++face) {
    for (int j = 0; j < layout.height; ++j) {
      for (int i = 0; i < layout.width; ++i) {
        const Vector3 d = Normalized(ops::DirectionAt(layout, {static_cast<int>(face), i + 0.5, j + 0.5}));
        int x, y;
        ops::PictureTexel(layout, static_cast<int>(face), i, j, &x, &y);
        image.at<float>(x, y) = static_cast<float>(ops::PowerOf(Dot(d, to), exponent));
      }
    }
  }
  return type == PixelType::kFloat ? image : Render(FromImage(image), type);
}

FunctionTable PhongTable(int size, const Vector3& light, double exponent, PixelType storage) {
  ops::RequireVector("phong table", "light", light, true);
  if (size < 2 || size > 512) {
    throw Error("phong table", "found size=" + std::to_string(size) + ", expected 2 to 512");
  }
  const Vector3 to = Normalized(light);
  const auto power = [&](const double* c) {
    const Vector3 r = Normalized({2 * c[0] - 1, 2 * c[1] - 1, 2 * c[2] - 1});
    return ops::PowerOf(Dot(r, to), exponent);
  };
  FunctionTable built = TableFromFunction([&](const double* c, double* result) { *result = power(c); },
                                          {.sizes = {size, size, size}, .storage = storage, .probes = 1});
  // Near 0, where the power depends on nothing but the direction, a table knows nothing: what counts is a
  // shell.
  constexpr int kProbes = 50000;
  built.max_error = built.rms_error = 0;
  for (int k = 0; k < kProbes; ++k) {
    const auto part = [k](double step) { return std::fmod(0.5 + k * step, 1.0); };
    // Steps of the plastic number's powers spread evenly in three dimensions.
    const double z = 2 * part(0.8191725133961645) - 1, turn = 2 * std::numbers::pi * part(0.6710436067037893);
    const double length = 0.5 + 0.5 * part(0.5497004779019703), ring = length * std::sqrt(1 - z * z);
    const double at[3] = {(ring * std::cos(turn) + 1) / 2, (ring * std::sin(turn) + 1) / 2,
                          (length * z + 1) / 2};
    double got = 0;
    SampleTable(built.table, {}, at, &got);
    const double error = std::fabs(got - power(at));
    built.rms_error += error * error / kProbes;
    if (error > built.max_error) built.max_error = error, built.worst = {at[0], at[1], at[2], 0};
  }
  built.rms_error = std::sqrt(built.rms_error);
  return built;
}

}  // namespace tessera
