// The registry row of line integral convolution: parameters as users write them.
#include <initializer_list>
#include <string>
#include <vector>

#include "ops/flow/flow_ops.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/ops/flow.h"

namespace tessera::ops {
namespace {

// The position of a choice among those of the row: the value of its enumeration.
template <class Enum>
Enum Chosen(const Arguments& a, const OpInfo& row, const std::string& name) {
  for (const ParamInfo& p : row.modifiers) {
    if (p.name != name) continue;
    for (size_t i = 0; i < p.choices.size(); ++i) {
      if (p.choices[i] == a.Text(name)) return static_cast<Enum>(i);
    }
  }
  return Enum{};
}

[[noreturn]] void Refuse(const std::string& name, const std::string& with, const std::string& expected) {
  throw Error("lic", "found " + name + " with " + with + ", expected " + expected);
}
// Modifiers that others would silence.
void CheckTogether(const Arguments& a) {
  const auto refuse = [&](std::initializer_list<const char*> names, const std::string& with,
                          const char* expected) {
    for (const char* name : names) {
      if (a.Given(name)) Refuse(std::string(name) + "=", with, expected);
    }
  };
  if (a.Flag("input")) {
    refuse({"size", "noise", "spot", "seed", "alpha"}, "input=1", "the library's own noise");
    if (a.Text("magnitude") == "noise") Refuse("magnitude=noise", "input=1", "the library's own noise");
  }
  const bool frames = a.Integer("animate") > 0;
  if (a.Given("weights")) refuse({"kernel", "animate"}, "weights=", "one of them");
  if (frames && a.Given("kernel") && a.Text("kernel") != "ripple")
    Refuse("kernel=" + a.Text("kernel"), "animate=", "kernel=ripple");
  if (!frames) refuse({"frame"}, "no animate=", "both");
  if (!frames && (a.Text("kernel") != "ripple" || a.Given("weights"))) {
    const std::string kernel = a.Given("weights") ? "weights=" : "kernel=" + a.Text("kernel");
    refuse({"phase", "waves"}, kernel, "kernel=ripple");
  }
  const bool own = !a.Flag("input") && !a.Flag("speed");
  if (a.Text("contrast") != "rescale" && !(a.Text("contrast") == "auto" && own))
    refuse({"gain"}, "contrast=" + a.Text("contrast"), "contrast=rescale");
  if (a.Text("integrator") == "cell") {
    refuse({"step", "speed", "sampling"}, "integrator=cell",
           "another integrator: it has a tap for every pixel");
  }
}

LicParams ParamsOf(const Arguments& a, const OpInfo& row) {
  CheckTogether(a);
  LicParams p;
  p.length = a.Number("length"), p.step = a.Number("step");
  constexpr LicIntegrator kIntegrators[] = {LicIntegrator::kAdaptive, LicIntegrator::kEuler,
                                            LicIntegrator::kMidpoint, LicIntegrator::kRk4,
                                            LicIntegrator::kCell};
  p.integrator = kIntegrators[static_cast<size_t>(Chosen<LicIntegrator>(a, row, "integrator"))];
  p.kernel = Chosen<LicKernel>(a, row, "kernel");
  p.phase = a.Number("phase"), p.waves = a.Number("waves");
  if (a.Given("weights")) p.kernel = LicKernel::kUser, p.weights = a.Numbers("weights");
  p.method = Chosen<LicMethod>(a, row, "method");
  p.wrap = WrapNamed(a.Text("wrap"));
  p.contrast = Chosen<LicContrast>(a, row, "contrast");
  p.gain = a.Number("gain");
  p.magnitude = Chosen<LicMagnitude>(a, row, "magnitude");
  p.noise = Chosen<LicNoise>(a, row, "noise");
  p.spot = a.Integer("spot"), p.seed = static_cast<uint32_t>(a.Number("seed"));
  p.linear = a.Text("sampling") == "linear";
  p.speed = a.Flag("speed"), p.y_up = a.Flag("yup"), p.bicubic = a.Flag("bicubic"), p.alpha = a.Flag("alpha");
  p.units = Chosen<LicUnits>(a, row, "units");
  p.scale_x = a.Numbers("scale")[0], p.scale_y = a.Numbers("scale").back();
  p.smallest = a.Number("smallest");
  p.passes = a.Integer("passes");
  if (a.Given("size")) {
    p.width = static_cast<int>(a.Numbers("size")[0]), p.height = static_cast<int>(a.Numbers("size").back());
  }
  if (a.Integer("animate") > 0) p = LicFrame(p, a.Integer("frame"), a.Integer("animate"));
  return p;
}

}  // namespace

OpInfo LicInfo() {
  OpInfo info;
  info.name = "lic";
  info.family = "flow";
  info.summary = "Line integral convolution along a vector field";
  info.help =
      "FIELD's first two channels are a vector's components, x right and y down, at the centres of the "
      "pixels. Each pixel of the result is the weighted mean of a texture along the streamline through it, "
      "length pixels each way, rounded to whole steps, with a tap every step. The texture is noise of its own in [0,1] (one "
      "channel), or with input=1 the image below the field on the stack (all of its channels). A field of "
      "another size is brought to the picture's.\n"
      "integrator=adaptive takes Runge-Kutta steps of up to ten pixels, twenty where the field is smooth, "
      "with taps in between by cubic Hermite polynomials: end points of smooth fields within 1e-3 pixels at "
      "length 100. euler, midpoint and rk4 take one step a tap. cell goes from pixel to pixel with one tap "
      "each, slopes rounded to 20 bits (Cabral and Leedom 1993). method=fast shares lines between pixels, "
      "which pays from a length of 40: on white noise at length 20 RMS 12/1024 from direct with "
      "sampling=linear, 31/1024 with nearest.\n"
      "NaN, infinity and alpha 0 in the field are masked: lines end there, the pixels are 0. A zero vector "
      "leaves the texture as it is; vectors shorter than smallest times the longest are zero. Lines that "
      "leave the image end and the weights used are renormalised (wrap=stop).\n"
      "The mean of so many samples of noise is nearly grey (deviation .06 at the default length). "
      "contrast=rescale multiplies deviations from the noise's mean so that they are gain times the noise's, "
      "as kernel, step, spot and noise let one expect for a whole line (of magnitude=length: the pixel's); "
      "vectors of 0 keep the noise. Lines that borders or sinks cut short have more contrast, about 2 of 100 "
      "pixels leave [0,1]. contrast=none gives the plain mean, as input=1 and speed=1 do unless told.\n"
      "kernel=tent and hann fall to 0 at length; box and ramp end there.\n"
      "A mask of its own is appended to the field as alpha: FIELD MASK --chnames A --chappend --lic. "
      "passes=2 makes lines sharper: ten times themselves less nine times the mean of 3 x 3 pixels, masked ones "
      "left out, convolved once more along the same lines, contrast=equalize unless none is asked for (Okada and "
      "Kao 1997). Colour by any scalar: FIELD --lic --ch 0,0,0 SCALAR --colormap viridis --mul; a mask with colour: FIELD "
      "--lic:alpha=1 --ch 0,0,0,1 PICTURE --over. Vectors on the surfaces of a scene are --surfacefield's.\n"
      "animate=N with a # output writes N frames from 1 that loop: kernel=ripple, phase (frame-1)/N. A "
      "field that changes in time is a sequence of files, each frame the lines of its own moment.\n"
      "Source: Cabral and Leedom 1993; Stalling and Hege 1995; Heidrich et al. 1999, 3.";
  info.help +=
      "\n\nAll images are held in memory whole, for lines go anywhere, and so is the result of shared lines and "
      "of contrast=equalize.";
  info.bound =
      "what positions off by 1e-3 pixels (adaptive; 1e-4 others) and by the errors of the steps that may be "
      "taken can change; undecided where a line's end, or a quarter of what it reads, hangs on that; "
      "method=fast: twice what lines half a pixel beside differ by, or six standard deviations of their noise";
  info.bound_u = 1;
  info.inputs = 1;
  info.operands = [](const Arguments& a) { return a.Flag("input") ? 2 : 1; };
  ParamInfo weights =
      ListModifier("weights", "1", 200001, 0, 1e30,
                   "a kernel of your own: an odd number of weights, farthest tap backward first");
  ParamInfo scale = ListModifier(
      "scale", "1", 2, "factors on the vectors' components, one or X,Y: pixels per unit of the field");
  ParamInfo size =
      ListModifier("size", "0", 2, 0, 1 << 20, "width,height of the result where it is not the field's");
  info.modifiers = {
      NumberModifier("length", "20", 0, 100000, "pixels each way (taps for integrator=cell)"),
      NumberModifier("step", "1", 1.0 / 16, 16, "pixels between taps"),
      ChoiceModifier("integrator", {"adaptive", "euler", "midpoint", "rk4", "cell"},
                     "how lines are followed"),
      ChoiceModifier("kernel", {"box", "tent", "hann", "ramp", "ripple"}, "weights along the line"),
      NumberModifier("phase", "0", -1e6, 1e6, "of the ripple, in turns"),
      NumberModifier("waves", "2", 0, 1000, "of the ripple within the kernel"),
      weights,
      ChoiceModifier("method", {"auto", "direct", "fast"},
                     "a line from every pixel, or shared ones; auto shares from length 64"),
      WrapModifier({"stop", "clamp", "repeat"}, "stop", "lines that leave the image"),
      ChoiceModifier("contrast", {"auto", "none", "rescale", "equalize"},
                     "auto: rescale for own noise; none: the plain mean"),
      NumberModifier("gain", "0.75", 0, 100, "share of the noise's contrast that contrast=rescale puts back"),
      ChoiceModifier("magnitude", {"none", "color", "noise", "length"},
                     "shows |f| by colour, by the noise's spots, by lengths"),
      ChoiceModifier("noise", {"white", "filtered", "sparse"}, "the texture where there is no image"),
      IntegerModifier("spot", "1", 1, 64, "pixels across a cell of the noise"),
      IntegerModifier("seed", "0", 0, 4294967295.0, "of the noise"),
      ChoiceModifier("sampling", {"nearest", "linear"}, "the texture between its pixels"),
      FlagModifier("speed", "lines as long as |f| times the length"),
      ChoiceModifier("units", {"pixels", "normalized", "latlong"},
                     "of the components; latlong: east and north on a whole map, lines cross the date line"),
      scale,
      FlagModifier("yup", "the second component points up"),
      FlagModifier("bicubic", "a field of another size by Catmull-Rom"),
      NumberModifier("smallest", "1e-6", 0, 1, "shorter vectors, as a share of the longest, are zero"),
      FlagModifier("alpha", "adds an alpha channel, 0 where masked"),
      size,
      FlagModifier("input", "convolves the image below the field"),
      IntegerModifier("passes", "1", 1, 2, "2: sharpened and convolved once more, contrast=equalize"),
      IntegerModifier("animate", "0", 0, 100000, "number of frames of a loop"),
      IntegerModifier("frame", "1", 1, 100000, "which of them; counted by the # of the output"),
  };
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    static const OpInfo kRow = LicInfo();
    const LicParams p = ParamsOf(a, kRow);
    return in.size() == 2 ? Lic(in[0], in[1], p) : Lic(in[0], p);
  };
  info.examples = {"",
                   "integrator=rk4 length=7 kernel=hann wrap=repeat",
                   "integrator=cell length=10 kernel=ripple phase=0.25 contrast=none",
                   "integrator=euler step=0.5 length=5 kernel=ramp wrap=clamp sampling=linear",
                   "integrator=midpoint length=6 magnitude=color alpha=1 kernel=tent",
                   "method=fast length=12 contrast=none",
                   "method=fast length=6 noise=filtered spot=2 step=0.5 gain=0.5",
                   "length=9 magnitude=noise contrast=rescale",
                   "length=6 passes=2 contrast=none",
                   "length=8 noise=sparse spot=2 magnitude=length yup=1 step=2"};
  return info;
}

}  // namespace tessera::ops
