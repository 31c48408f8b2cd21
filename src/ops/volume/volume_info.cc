// The words of --volume: where the volume comes from, how it is seen, what is drawn.
#include <algorithm>
#include <charconv>
#include <string>
#include <vector>

#include "base/turn.h"
#include "ops/modifiers.h"
#include "ops/volume/volume_ops.h"
#include "ops/volume/words.h"
#include "tessera/error.h"
#include "tessera/mesh.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"

namespace tessera::ops {
namespace {

using namespace volume;  // NOLINT: the words of this command

// The volume is turned: its z points up, its y towards the viewer, its x to the left.
constexpr Matrix4 kUpright = {-1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1};

ParamInfo Numbers(const char* name, const char* value, int least, int most, const char* help) {
  ParamInfo p = ListModifier(name, value, most, -1e38, 1e38, help);
  p.min_count = least;
  return p;
}

const std::vector<std::string> kMethods = {"rays", "slices", "shells", "stacks", "shearwarp"};
const std::vector<std::string> kClassify = {"post", "pre", "preintegrated"};
const std::vector<std::string> kLookups = {"block", "channels", "4", "8", "exact"};

ImageSpec SizeOf(const std::string& text) {
  int side[2] = {0, 0};
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (int k = 0; k < 2; ++k) {
    const auto [next, error] = std::from_chars(at, end, side[k]);
    const bool last = k == 1;
    if (error != std::errc() || side[k] < 1 || side[k] > 65536 ||
        (last ? next != end : next == end || *next != 'x')) {
      throw Error("volume:size", "found \"" + text.substr(0, 40) + "\", expected WxH in pixels, as 640x480");
    }
    at = next + 1;
  }
  return ImageSpec(side[0], side[1], 4);
}

int Operands(const Arguments& a) {
  const bool made = a.Given("solid") || a.Given("file") || a.Given("mesh");
  return (made ? 0 : 1) + (a.Flag("scene") ? 1 : 0) + (a.Flag("with") ? 1 : 0);
}

// Whether a medium is lit as one.
bool Scatters(const Arguments& a) {
  return a.Given("shadow") || a.Given("phase") || a.Given("lights") || a.Given("lightsat");
}

// Further lights: six numbers each.
void AddLights(const Arguments& a, const char* name, bool point, VolumeScattering& scatter) {
  if (!a.Given(name)) return;
  const std::vector<double>& n = a.Numbers(name);
  if (n.size() % 6 != 0) {
    throw Error(std::string("volume:") + name,
                "found " + std::to_string(n.size()) + " numbers, expected x,y,z,r,g,b for each light");
  }
  for (size_t i = 0; i < n.size(); i += 6)
    scatter.lights.push_back({{n[i], n[i + 1], n[i + 2]}, point, {n[i + 3], n[i + 4], n[i + 5]}});
}

// What a mode does not look at is refused.
void RequireUsed(const Arguments& a) {
  static constexpr Use kModesOf[] = {{"iso", "iso solid bump melt fur fire hyper"},
                                     {"below", "iso solid bump melt fur fire hyper"},
                                     {"soft", "fur fire hyper"},
                                     {"color", "iso bump melt fur fire hyper"},
                                     {"step", "fur fire hyper over under attenuate xray mip"},
                                     {"termination", "fur fire hyper over under"},
                                     {"method", "fur fire hyper over under attenuate xray mip"},
                                     {"time", "melt fur fire hyper over under attenuate xray mip"},
                                     {"loop", "fire hyper over under attenuate xray mip"},
                                     {"freq", "solid bump melt fur fire"},
                                     {"amount", "bump melt fur fire"},
                                     {"drip", "melt"},
                                     {"root", "fur"},
                                     {"tip", "fur"},
                                     {"guard", "fur"},
                                     {"patches", "fur"},
                                     {"lookup", "fur fire hyper over under attenuate xray mip"},
                                     {"dmf", "fur fire hyper over under attenuate xray mip"},
                                     {"transfer", "fur fire hyper over under attenuate xray mip"},
                                     {"transferlength", "fur fire hyper over under attenuate xray"},
                                     {"classify", "over under attenuate xray"},
                                     {"shade", "fire hyper over under attenuate"},
                                     {"shadow", "fire hyper over under attenuate"},
                                     {"phase", "fire hyper over under attenuate"},
                                     {"shadowstep", "fire hyper over under attenuate"},
                                     {"shadowsize", "fire hyper over under attenuate"},
                                     {"lights", "fire hyper over under attenuate"},
                                     {"lightsat", "fire hyper over under attenuate"},
                                     {"blackbody", "fire hyper over under attenuate"},
                                     {"texture", "solid"},
                                     {"block", "solid"},
                                     {"ramp", "solid"},
                                     {"flat", "iso solid bump melt fur"},
                                     {"depth", "iso solid bump melt fur fire hyper over under"},
                                     {"aovs", "iso solid bump melt fur fire hyper over under"}};
  const std::string& mode = a.Text("mode");
  for (const Use& use : kModesOf) {
    if (!a.Given(use.name) || Holds(use.words, mode)) continue;
    Refuse(use.name, "mode=" + mode, std::string("one of the modes ") + use.words);
  }
  if (a.Given("light")) {
    if (a.Given("lightat")) Refuse("lightat", "light=", "one of them");
  }
  const bool scatters = Scatters(a);
  for (const char* name : {"light", "lightat", "ambient", "diffuse", "specular", "exponent", "color"}) {
    if (!a.Given(name)) continue;
    if (a.Flag("flat") && std::string(name) != "color") Refuse(name, "flat=1", "one of them");
    if (Holds("xray mip", mode)) Refuse(name, "mode=" + mode, "a mode that is lit");
    const bool lit = a.Flag("shade") || (scatters && !Holds("specular exponent", name));
    if (Holds("fire hyper over under attenuate", mode) && !lit) Refuse(name, "mode=" + mode, "shade=1 too");
  }
  for (const char* name : {"shadowstep", "shadowsize"}) {
    if (a.Given(name) && a.Number("shadow") == 0) Refuse(name, "no shadow=", "both");
  }
  const std::string& method = a.Text("method");
  if (a.Given("step") && Holds("stacks shearwarp", method))
    Refuse("step", "method=" + method, "the volume's own slices, or another method");
  if (a.Given("transferlength") && !a.Given("transfer")) Refuse("transferlength", "no transfer=", "both");
  if (a.Given("dmf") && mode == "fire") {
    if (a.Given("freq")) Refuse("freq", "dmf=", "it in the chain");
  }
  if (a.Given("view")) {
    for (const char* name : {"azimuth", "elevation", "fov", "zoom", "up"}) {
      if (a.Given(name)) Refuse(name, "view=", "one of them");
    }
  }
  if (a.Given("size") && a.Flag("scene")) Refuse("size", "scene=1", "the size of the depths below");
}
// From a volume's coordinates to the world's: upright, then turned around y, then moved.
Matrix4 PlaceOf(const Arguments& a, bool upright) {
  const auto [c, s] = base::TurnOf(a.Number("turn"));
  const std::vector<double>& at = a.Numbers("at");
  const Matrix4 place = {c, 0, s, at[0], 0, 1, 0, at[1], -s, 0, c, at[2], 0, 0, 0, 1};
  return upright ? place : Product(place, kUpright);
}

Node Make(std::span<const Node> inputs, const Arguments& a, const ImageSpec*) {
  const bool scene = a.Flag("scene"), with = a.Flag("with");
  if (with) {
    for (const char* name : {"size", "view", "azimuth", "elevation", "fov", "zoom", "scene"}) {
      if (a.Given(name)) {
        throw Error(kWordsName, std::string("found ") + name +
                                    "= beside with=1, expected it where the picture's first volume is");
      }
    }
  }
  RequireUsed(a);
  const Volume volume = VolumeOfWords(inputs, a);
  const ImageSpec spec = scene || with ? ImageSpec(inputs[0].spec()) : SizeOf(a.Text("size"));
  PlacedVolume placed;
  placed.volume = volume;
  VolumeParams& p = placed.params;
  p.mode = ChoiceOf<VolumeMode>(a, "mode", kModes);
  const double aspect = spec.width() / std::max<double>(spec.height(), 1);
  p.camera = a.Given("view") ? Camera::FromNumbers(a.Numbers("view"), "volume:view")
                             : OrbitCamera(volume, a.Number("azimuth"), a.Number("elevation"),
                                           a.Number("fov"), aspect, a.Number("zoom"));
  const bool upright = a.Given("view") || a.Text("up") != "z";
  placed.to_world = PlaceOf(a, upright);
  const bool density = p.mode >= VolumeMode::kOver;
  const bool solid_is_distance = a.Given("solid") || a.Given("mesh") || a.Given("distance");
  const bool field = p.mode >= VolumeMode::kMelt && !density;  // of distances
  if (field && !solid_is_distance && !a.Flag("below")) {
    throw Error(kWordsName,
                "found mode=" + a.Text("mode") +
                    " of a density, expected distance=LEVEL beside it (of the surface that is wanted), or "
                    "below=1 where the volume holds distances");
  }
  if (a.Given("iso")) {
    p.iso = a.Number("iso");
  } else if (!solid_is_distance && !density && !field) {
    const auto range = volume.Range();
    p.iso = 0.5 * (range[0] + range[1]);
  }
  p.inside_above = !solid_is_distance && !a.Flag("below");
  if (a.Given("soft")) p.soft = a.Number("soft");
  p.material.color = {a.Numbers("color")[0], a.Numbers("color")[1], a.Numbers("color")[2]};
  p.material.point = a.Given("lightat");
  p.material.light = VectorOf(a.Numbers(p.material.point ? "lightat" : "light"));
  p.material.flat = a.Flag("flat");
  p.material.ambient = a.Number("ambient");
  p.material.diffuse = a.Number("diffuse");
  p.material.specular = a.Number("specular");
  p.material.exponent = a.Number("exponent");
  p.step = a.Number("step");
  p.termination = a.Number("termination");
  p.method = ChoiceOf<VolumeMethod>(a, "method", kMethods);
  p.leap = a.Flag("leap");
  p.time = a.Number("time");
  p.loop = a.Number("loop");
  p.frequency = a.Number("freq");
  p.amount = a.Given("amount") ? a.Number("amount") : -1;
  p.drip = a.Given("drip") ? a.Number("drip") : -1;
  p.fur.root = VectorOf(a.Numbers("root"));
  p.fur.tip = VectorOf(a.Numbers("tip"));
  p.fur.guard = a.Number("guard");
  p.fur.patches = a.Number("patches");
  p.lookup = ChoiceOf<TurbulenceLookup>(a, "lookup", kLookups);
  p.classification = ChoiceOf<Classification>(a, "classify", kClassify);
  p.shade = a.Flag("shade");
  p.scatter.lit = Scatters(a);
  AddLights(a, "lights", false, p.scatter);
  AddLights(a, "lightsat", true, p.scatter);
  p.scatter.shadow = a.Number("shadow");
  p.scatter.phase = a.Number("phase");
  p.scatter.step = a.Number("shadowstep");
  p.scatter.size = a.Integer("shadowsize");
  if (a.Given("blackbody")) {
    const std::vector<double>& body = a.Numbers("blackbody");
    p.emission = {body[0], body[1], body.size() > 2 ? body[2] : 1};
  }
  p.depth = a.Flag("depth");
  p.aovs = a.Flag("aovs");
  if (p.mode == VolumeMode::kSolid) SetTexture(a, p);
  if (a.Given("dmf")) p.dmf = ParseDmf(a.Text("dmf"));
  for (Dmf& step : p.dmf) step.lookup = p.lookup;
  if (a.Given("transfer")) p.transfer = TransferOfWords(a.Text("transfer"));
  if (a.Given("transferlength")) p.transfer.length = a.Number("transferlength");
  const std::vector<double>& planes = a.Given("planes") ? a.Numbers("planes") : std::vector<double>{};
  if (planes.size() % 4 != 0) {
    throw Error("volume:planes",
                "found " + std::to_string(planes.size()) + " numbers, expected x,y,z,offset for each plane");
  }
  for (size_t i = 0; i < planes.size(); i += 4)
    p.planes.push_back({{planes[i], planes[i + 1], planes[i + 2]}, planes[i + 3]});
  if (!upright) {
    // Light and planes are the volume's own, as they are where nothing is turned.
    const auto turn = [](const Vector3& v) { return Vector3{-v[0], v[2], v[1]}; };
    p.material.light = turn(p.material.light);
    for (VolumeLight& light : p.scatter.lights) light.light = turn(light.light);
    for (CuttingPlane& plane : p.planes) plane.normal = turn(plane.normal);
  }
  const int samples = a.Integer("samples");
  if (with) return AddVolume(inputs[0], placed, samples);
  const PlacedVolume one[] = {placed};
  return scene ? RenderVolumes(spec, one, inputs[0], samples) : RenderVolumes(spec, one, samples);
}

}  // namespace

OpInfo VolumeInfo() {
  OpInfo info;
  info.name = kWordsName;
  info.family = kWordsName;
  info.inputs = 1;
  info.operands = Operands;
  info.summary =
      "A picture of a volume: a lit, textured or hypertextured distance field, or a density volume";
  info.help =
      "The volume: solid= (a distance field of dims= voxels), mesh= (the distance field of a closed "
      "Wavefront OBJ mesh, scaled to 1.6, where the library was built with OpenVDB), file= (OpenVDB and "
      "whatever else OpenImageIO reads as a volume, one of its grids by part=, slices numbered by # or "
      "%03d, an image of slices=, or raw samples where dims= and type= are given), or the top image, "
      "slices one above the other (slices=). distance=LEVEL turns a density volume into its distance field "
      "first. The longest side measures 2, centred at 0; y is up; files' slices come towards the viewer. A "
      "solid: sphere(x,y,z,r), ellipsoid, box(x,y,z,w,h,d half sizes), roundbox, torus(x,y,z,r,tube), "
      "capsule(x,y,z,x,y,z,r), cone(x,y,z,x,y,z,r,r), plane(x,y,z,offset), body, knot, joined by | "
      "(union), & (intersection), - (difference), |.1 and &.1 (blended), parentheses; quote it.\n"
      "mode: iso, solid, bump and melt show the surface at iso=, lit; fur, fire and hyper show the soft "
      "region iso to iso+soft of a distance field, density D = clamp((iso + soft - d) / soft) through the "
      "chain dmf=, which leaves nothing where D is 0: bias(b), gain(g), noise(amount,freq), "
      "turbulence(amount,freq), threshold(from,width), warp(amount,freq), lift(amount,freq), "
      "swell(amount,freq), a third number is an upward speed, a fourth how many times as high as wide the "
      "noise's features are; table(d,d',...) or table(FILE) maps densities by pairs. A step may be times "
      "where it acts: STEP*height(a,b) from 0 at a to 1 at b, as gradient (of the field), light (n.l), eye "
      "(n.v) and density, each with more pairs quantity,weight or a file of them too; "
      "STEP*half(x,y,z,offset,soft), STEP*sphere(x,y,z,r,soft) and STEP*band(low,high,soft) inside of a "
      "region, *~ outside of it. over, under, attenuate, xray and mip show a density through transfer= "
      "(value,r,g,b,opacity,... or a file of such lines; opacity of transferlength=), and before it dmf= "
      "with D from 0 where transfer= begins to 1 where it ends. Opacities are corrected for the length of "
      "the steps; attenuate is the mean of colour times opacity of transferlength= along the ray, mip the "
      "largest sample. time= animates melt, fur and fire.\n"
      "mode=solid takes its colour from texture= (marble and wood have values in [0,1], clouds about 0), "
      "or from a block= of one's own, by the colours of ramp= (value,r,g,b,... or a file as of transfer=). "
      "light= is a direction, lightat= a point; flat=1 leaves colours unlit.\n"
      "shadow=, phase=, lights= and lightsat= light a medium (fire, hyper, over, under, attenuate): its "
      "colours times ambient= + diffuse= times what reaches a place of light= or lightat=, dimmed by the "
      "medium on the way (held at shadowsize= nodes a side, so edges between nodes are blurred by one), "
      "times a share that phase= turns towards the eye; with shade=1 by the gradient too. "
      "blackbody=LOW,HIGH makes it glow, from LOW kelvin where transfer= begins to HIGH where it ends: of "
      "itself alone, or besides that light.\n"
      "Premultiplied R, G, B, A; depth=1 adds Z, aovs=1 Z, N.X, N.Y, N.Z, P.X, P.Y, P.Z and distance, "
      "where alpha passes 1/2 in media. The camera goes with the picture: --position, --envmap, --solid, "
      "--fog and --shadow find what they need. scene=1 takes the planar depths of opaque objects from the "
      "image below (its size is the picture's) and ends rays there. with=1 takes the picture of another "
      "--volume from below and puts this volume (at=, turn=) into it, up to 8: all media in one march, "
      "their extinctions added where they overlap, the nearest surface behind them; its size, camera and "
      "scene stay. lookup: how turbulence is read (one precomputed block, four channels, 4 or 8 lookups, "
      "or the noise itself at every sample), in fire and in the steps of dmf=: the same turbulence, with "
      "what interpolation leaves out (exact: nothing), 8 with four finer octaves. Words that a mode or a "
      "source has no use for are refused.\n"
      "Rays leap over what is provably empty; the pictures are the same bits with leap=0. method: where "
      "samples lie: rays, slices (planes), shells (spheres), stacks (the volume's own slices), or "
      "shearwarp (sheared slices, one warp; over and under alone, unlit).\n"
      "Source: Miller and Jones 2005; Perlin and Hoffert 1989; Lacroute and Levoy 1994; Kajiya and Von "
      "Herzen 1984; Henyey and Greenstein 1941; Krystek 1985; Wyman et al. 2013; McReynolds et al. 1997, "
      "13.";
  info.help += " With method=shearwarp the result is held in memory whole.";
  info.bound =
      "1e-5 at 256 samples, plus what moving the ray by 1e-4 voxel changes, plus termination * brightest "
      "colour where alpha passes 1 - termination; attenuate: plus what midpoints of the step miss of the "
      "integral; shadow: that of the nodes, between which it is linear; shearwarp: against the sheared "
      "picture, not against rays";
  info.bound_u = 168;
  info.modifiers = {
      TextModifier("solid", "a solid in words, see below"),
      TextModifier("mesh", "a closed mesh, Wavefront OBJ"),
      TextModifier("file", "a volume's file"),
      Numbers("dims", "128", 1, 3, "voxels: one number, or x,y,z"),
      ChoiceModifier("type", {"uint16", "uint8", "half", "float"}, "sample type of solids and raw files"),
      Numbers("spacing", "1,1,1", 3, 3, "proportions of a voxel"),
      NumberModifier(
          "range", "0", 0, 1e6,
          "distances kept by integer types, world units; 0 is an eighth of the longest side, or what the "
          "levels drawn need"),
      IntegerModifier("slices", "1", 1, 65536, "slices one above the other in an image"),
      IntegerModifier("channel", "0", 0, 1023, "channel of images"),
      TextModifier("part", "name or number of one of a file's grids or images"),
      IntegerModifier("header", "0", 0, 1e9, "bytes before raw samples"),
      FlagModifier("bigendian", "raw samples are big-endian"),
      FlagModifier("signed", "raw 16-bit samples have a sign"),
      NumberModifier("distance", "0.5", -1e30, 1e30, "make the distance field of this level first"),
      NumberModifier("memory", "0", 0, 1e9,
                     "MB of samples held at once, a larger volume is paged from a temporary file; 0 is what "
                     "--max-memory leaves, or all"),
      TextModifier("size", "WxH of the picture, pixels; default 300x300"),
      ChoiceModifier("mode", kModes, "what is drawn"),
      NumberModifier("iso", "0", -1e30, 1e30,
                     "level of the surface; of densities by default half their range"),
      FlagModifier("below", "densities below iso are inside"),
      NumberModifier("soft", "-1", -1, 1e6,
                     "width of the soft region, world units; -1 is what suits the mode"),
      Numbers("view", "", 16, 32, "world to clip, or world to camera and world to clip, row-major"),
      ChoiceModifier("up", {"y", "z"},
                     "axis of the volume that points up, with its z or y towards azimuth 0"),
      NumberModifier("azimuth", "25", -1e6, 1e6, "degrees around the volume"),
      NumberModifier("elevation", "15", -1e6, 1e6, "degrees above the horizon"),
      NumberModifier("fov", "30", 0, 170, "vertical field of view, degrees; 0 is a parallel camera"),
      NumberModifier("zoom", "1.5", 1e-3, 1e3, "1 shows all of the bounding sphere"),
      Numbers("color", "0.8,0.6,0.42", 3, 3, "material, linear"),
      Numbers("light", "-0.45,0.65,0.62", 3, 3, "direction towards the light, world"),
      Numbers("lightat", "", 3, 3, "where a light stands, world, in place of a direction"),
      FlagModifier("flat", "unlit: colours as they are"),
      NumberModifier("ambient", "0.25", 0, 1e3, "factor of ambient light"),
      NumberModifier("diffuse", "0.75", 0, 1e3, "factor of diffuse light"),
      NumberModifier("specular", "0.35", 0, 1e3, "factor of the highlight"),
      NumberModifier("exponent", "40", 0, 1e4, "sharpness of the highlight"),
      NumberModifier("step", "0", 0, 1e6,
                     "distance of samples, world units; 0 is a voxel (fur 1.25, fire 2.5)"),
      NumberModifier("termination", "0.001953125", 0, 1, "rays end at alpha 1 - this"),
      ChoiceModifier("method", kMethods, "where samples lie"),
      FlagModifier("leap", "leap over empty space", "1"),
      NumberModifier("time", "0", -1e5, 1e5, "seconds"),
      NumberModifier("loop", "0", 0, 1e6,
                     "seconds after which fire and dmf= repeat, speeds rounded to it; 0: never"),
      NumberModifier("freq", "0", 0, 1e5, "noise blocks per world unit; 0 is what suits the mode"),
      NumberModifier("amount", "0", -1e3, 1e3,
                     "melt: sag, fur: droop, fire: height of flames, world units; bump: k"),
      NumberModifier("drip", "0", 0, 1e3,
                     "melt: length of drops, world units; what suits the time where not given"),
      Numbers("root", "0.42,0.34,0.28", 3, 3, "fur: factors of color= at the roots"),
      Numbers("tip", "1.25,1.18,1.08", 3, 3, "fur: factors of color= at the tips"),
      NumberModifier("guard", "0.7", 0, 1, "fur: from even hair to a low undercoat that few hairs pass"),
      NumberModifier("patches", "0.25", 0, 1, "fur: how much colour changes from place to place"),
      ChoiceModifier("lookup", kLookups, "how turbulence is read"),
      ChoiceModifier("texture", {"marble", "wood", "clouds"}, "what mode=solid is made of"),
      TextModifier(
          "block",
          "a file of a cube of samples in place of that, repeated; an image of slices one above the other "
          "will do"),
      TextModifier("ramp", "its colours: value,r,g,b for each point, or a file"),
      TextModifier("dmf", "chain of density modulation functions, quoted"),
      TextModifier("transfer", "value,r,g,b,opacity for each point, or a file"),
      NumberModifier("transferlength", "0.01", 1e-9, 1e9, "world units that have the opacities"),
      ChoiceModifier("classify", kClassify,
                     "look up after, or before, interpolation, or between both ends of a step"),
      FlagModifier("shade", "light densities by their gradient"),
      NumberModifier("shadow", "0", 0, 1, "how much a medium shadows itself"),
      NumberModifier("phase", "0", -0.95, 0.95,
                     "g of Henyey and Greenstein: above 0 the medium is brighter before the light"),
      Numbers("lights", "", 6, 42, "further lights of a medium: x,y,z towards it and r,g,b, each"),
      Numbers("lightsat", "", 6, 42, "the same that stand at x,y,z"),
      Numbers(
          "blackbody", "", 2, 3,
          "light of a black body: kelvin where transfer= begins and where it ends, brightness of the latter"),
      NumberModifier("shadowstep", "0", 0, 1e6, "distance of samples towards the light; 0 is that of step="),
      IntegerModifier("shadowsize", "0", 0, 256,
                      "nodes along the longest side that hold the shadow; 0 is half the voxels, at most 64"),
      Numbers("planes", "", 4, 64, "cutting planes x,y,z,offset: kept where x*X + y*Y + z*Z >= offset"),
      FlagModifier("depth", "add a channel Z of planar depths"),
      FlagModifier("aovs", "add Z, normals N, positions P and the distance from the eye"),
      Numbers("at", "0,0,0", 3, 3, "where the volume's origin is in the world"),
      NumberModifier("turn", "0", -1e6, 1e6, "degrees that the volume is turned around its y before that"),
      FlagModifier("with", "the image below is a picture of volumes: this one is added, seen by its camera"),
      FlagModifier("scene", "the image below holds planar depths of opaque objects"),
      IntegerModifier("samples", "1", 1, 64, "jittered pictures that are averaged"),
  };
  for (ParamInfo& p : info.modifiers) {
    if (p.name == "type") p.choices = kTypes, p.default_value = "uint16";
    if (p.name == "view") p.counts = {16, 32};
    if (p.name == "size") p.default_value = "300x300";
  }
  info.examples = {
      "solid=body dims=24 size=24x20",
      "solid=body dims=24 size=22x20 mode=bump fov=0 type=half",
      "solid=knot dims=24 size=24x18 mode=solid type=float texture=wood",
      "solid=knot dims=24 size=20x18 mode=solid texture=clouds flat=1 aovs=1",
      "solid=body dims=24 size=20x18 aovs=1 lightat=1,1,1.5",
      "solid=knot dims=20 size=20x18 mode=under transfer=-.3,1,.5,.2,.6,.1,.2,.4,1,0 aovs=1",
      "solid=knot dims=20 size=20x18 mode=melt",
      "solid=sphere(0,0,0,.6) dims=20 size=20x18 mode=fur soft=0.25",
      "solid=sphere(0,0,0,.5) dims=20 size=20x18 mode=fire soft=0.2 termination=0 lookup=4",
      "solid=sphere(0,0,0,.5) dims=16 size=18x16 mode=hyper dmf=noise(.3,1),bias(.4),gain(.6) shade=1",
      "solid=knot dims=16 size=18x16 mode=under transfer=-.3,1,.9,.8,.5,.2,1,1,1,0 transferlength=.3 "
      "shadow=1 phase=.5 light=1,.4,.2",
      "solid=knot dims=16 size=18x16 mode=over transfer=-.3,1,.9,.8,.5,.2,.5,1,1,0 "
      "dmf=warp(.1,1),turbulence(.8,1)*height(-.5,.5),gain(.7)*~sphere(0,0,0,.4,.2),table(0,0,.5,.2,1,1)*light(-1,1)",
      "solid=sphere(0,0,0,.5) dims=16 size=18x16 mode=fire soft=.2 blackbody=1200,2600,3 shadow=1 "
      "color=1,1,1",
      "solid=sphere(0,0,0,.5) dims=16 size=18x16 mode=hyper lights=1,0,0,.9,.4,.1 lightsat=0,1,0,.1,.2,.9 "
      "shadow=1",
      "solid=sphere(0,0,0,.5) dims=16 size=18x16 mode=hyper dmf=noise(.3,1) shade=1 shadow=.8 shadowsize=6 "
      "lightat=1,1,0.5",
      "solid=knot dims=20 type=float size=22x18 mode=over transfer=-.3,1,.5,.2,.3,.1,.2,.4,1,0"};
  info.make = Make;
  return info;
}

}  // namespace tessera::ops
