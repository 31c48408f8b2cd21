// What a medium is at a point: a value of the field, or hypertexture's density, its classification, and a
// normal.
#if defined(TESSERA_OPS_VOLUME_MEDIUM_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_MEDIUM_INL_H_
#undef TESSERA_OPS_VOLUME_MEDIUM_INL_H_
#else
#define TESSERA_OPS_VOLUME_MEDIUM_INL_H_
#endif

#include <hwy/highway.h>

#include <cmath>

#include "ops/volume/chain-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

// What of the light reaches position p (voxels) through the medium, 1 where nothing is shadowed.
inline HWY_NOINLINE V Reaching(const OpacityView& o, float strength, const Vec3& p) {
  if (o.nodes == nullptr) return Set(1);
  Cell c;
  const auto axis = [&](V v, int a, VI& whole) HWY_ATTR {
    const V at = hn::MulAdd(v, Set(o.times[a]), Set(o.plus[a]));
    const V inside = hn::Min(hn::Max(at, hn::Zero(D())), Set(o.last[a]));
    const V floor = hn::Floor(inside);
    whole = WholeOf(floor);
    return hn::Sub(inside, floor);
  };
  c.f.x = axis(p.x, 0, c.i);
  c.f.y = axis(p.y, 1, c.j);
  c.f.z = axis(p.z, 2, c.k);
  const V through = Trilinear(o.nodes, o.row, o.slice, Places(IndexOf(c, o.row, o.slice)), c.f);
  return hn::MulAdd(Set(strength), through, Set(1 - strength));
}
// Of light from l, the share that goes to the eye against that of all directions' mean. The denominator is
// (1 - |g|)^2 + |g| |l +- e|^2, which loses no digits where it is small.
HWY_INLINE V Phase(float g, const Vec3& l, const Vec3& to_eye) {
  if (g == 0) return Set(1);
  const V sign = Set(g > 0 ? 1.0f : -1.0f);
  const float size = std::fabs(g);
  const Vec3 sum = AddScaled(l, to_eye, sign);
  const V below = hn::MulAdd(Dot(sum, sum), Set(size), Set((1 - size) * (1 - size)));
  return hn::Div(Set((1 - size) * (1 + size)), hn::Mul(below, hn::Sqrt(below)));
}

// What further lights add to a sample of this colour.
inline HWY_NOINLINE void AddLights(const MediumArgs& args, const Vec3& p, const Sample& sample,
                                   const Vec3& to_eye, const s::Pixels& own, s::Pixels& c) {
  for (const FurtherLight& further : args.further) {
    const Light& light = further.light;
    const Vec3 l = ToLight(args.rays, light, p);
    const V there = hn::Mul(Reaching(further.opacity, args.shadow, p), Phase(args.phase, l, to_eye));
    Shine shine = {Set(light.diffuse), hn::Zero(D())};
    if (args.look == Look::kLit) shine = Lit(light, l, sample.normal, to_eye);
    const auto add = [&](V color, int k, V& to) HWY_ATTR {
      const V lit =
          hn::MulAdd(hn::Mul(color, Set(args.hyper ? args.light.color[k] : 1)), shine.lit, shine.gloss);
      to = hn::MulAdd(hn::Mul(lit, there), Set(light.color[k]), to);
    };
    add(own.r, 0, c.r);
    add(own.g, 1, c.g);
    add(own.b, 2, c.b);
  }
}

// Colour of a sample as it is lit.
inline HWY_NOINLINE void Illuminate(const MediumArgs& args, const Vec3& p, const Sample& sample,
                                    const Vec3& to_eye, s::Pixels& c) {
  const V zero = hn::Zero(D()), one = Set(1);
  const Vec3 l = ToLight(args.rays, args.light, p);
  if (args.look == Look::kScattered) {
    const V there = hn::Mul(Reaching(args.opacity, args.shadow, p), Phase(args.phase, l, to_eye));
    const V lit = hn::MulAdd(there, Set(args.light.diffuse), Set(args.light.ambient));
    c.r = hn::Mul(c.r, hn::Mul(lit, Set(args.hyper ? args.light.color[0] : 1)));
    c.g = hn::Mul(c.g, hn::Mul(lit, Set(args.hyper ? args.light.color[1] : 1)));
    c.b = hn::Mul(c.b, hn::Mul(lit, Set(args.hyper ? args.light.color[2] : 1)));
  } else if (args.look == Look::kLit) {
    Shine shine = Lit(args.light, l, sample.normal, to_eye);
    if (args.opacity.nodes != nullptr || args.phase != 0) {
      const V there = hn::Mul(Reaching(args.opacity, args.shadow, p), Phase(args.phase, l, to_eye));
      const V ambient = hn::Mul(Set(args.light.ambient), hn::MulAdd(sample.normal.y, Set(0.3f), one));
      shine.lit = hn::MulAdd(hn::Sub(shine.lit, ambient), there, ambient);
      shine.gloss = hn::Mul(shine.gloss, there);
    }
    c.r = hn::MulAdd(c.r, hn::Mul(shine.lit, Set(args.hyper ? args.light.color[0] : 1)), shine.gloss);
    c.g = hn::MulAdd(c.g, hn::Mul(shine.lit, Set(args.hyper ? args.light.color[1] : 1)), shine.gloss);
    c.b = hn::MulAdd(c.b, hn::Mul(shine.lit, Set(args.hyper ? args.light.color[2] : 1)), shine.gloss);
  } else if (args.light.flat) {
    c.r = hn::Mul(c.r, Set(args.light.color[0]));
    c.g = hn::Mul(c.g, Set(args.light.color[1]));
    c.b = hn::Mul(c.b, Set(args.light.color[2]));
  } else {
    // Kajiya and Kay: light across the strand, darker towards the roots.
    const V cosine = Dot(sample.normal, l), view = Dot(sample.normal, to_eye);
    const V across = hn::Sqrt(hn::Max(hn::NegMulAdd(cosine, cosine, one), zero));
    const V aside = hn::Sqrt(hn::Max(hn::NegMulAdd(view, view, one), zero));
    const V facing = hn::MulAdd(cosine, Set(0.5f), Set(0.5f));
    const V height =
        Clamp01(hn::Sub(one, hn::Mul(hn::Sub(Set(args.outer), sample.distance), Set(args.per_width))));
    const V occlusion =
        hn::MulAdd(height, Set(static_cast<float>(1 - kFurRoot)), Set(static_cast<float>(kFurRoot)));
    const V diffuse =
        hn::Mul(hn::Mul(Set(args.light.diffuse), facing), hn::MulAdd(across, Set(0.6f), Set(0.4f)));
    const V lit = hn::Mul(occlusion, hn::Add(diffuse, Set(args.light.ambient)));
    const V gleam =
        Power(hn::Max(hn::NegMulAdd(cosine, view, hn::Mul(across, aside)), zero), args.light.exponent);
    const V gloss =
        hn::Mul(hn::Mul(Set(args.light.specular), gleam), hn::Mul(hn::Mul(facing, facing), occlusion));
    // From the colour of roots to that of tips.
    const V patched = hn::Mul(lit, hn::MulAdd(sample.patch, Set(args.fur_patches), one));
    const auto colored = [&](V own, int k) HWY_ATTR {
      const V along = hn::MulAdd(height, Set(args.fur_rise[k]), Set(args.fur_root[k]));
      return hn::MulAdd(hn::Mul(hn::Mul(own, Set(args.light.color[k])), along), patched, gloss);
    };
    c.r = colored(c.r, 0);
    c.g = colored(c.g, 1);
    c.b = colored(c.b, 2);
  }
}
// The medium's own light: all of it where nothing else lights it.
inline HWY_NOINLINE void Glow(const MediumArgs& args, const Sample& sample, s::Pixels& c) {
  const s::Pixels own = ColorOf(args.emission, sample.value);
  const bool alone = args.look == Look::kPlain;
  c.r = alone ? own.r : hn::Add(c.r, own.r);
  c.g = alone ? own.g : hn::Add(c.g, own.g);
  c.b = alone ? own.b : hn::Add(c.b, own.b);
}
HWY_INLINE void Shade(const MediumArgs& args, const Vec3& p, const Sample& sample, const Vec3& to_eye,
                      s::Pixels& c) {
  if (args.look != Look::kPlain) {
    const s::Pixels own = c;
    Illuminate(args, p, sample, to_eye, c);
    if (!args.further.empty()) AddLights(args, p, sample, to_eye, own, c);
  }
  if (args.emission.entries != nullptr) Glow(args, sample, c);
}

// Hair: where the noise at a strand's foot is strong. The foot lies along the gradient, and up where
// strands droop.
inline HWY_NOINLINE NoisePlace FootOf(const MediumArgs& args, const Vec3& p, Sample& r, V t) {
  const D d;
  const RaySet& set = args.rays;
  const V height = hn::Sub(Set(1), t);
  const Vec3 lean = {Set(args.fur_lean[0]), Set(args.fur_lean[1]), Set(args.fur_lean[2])};
  const Vec3 across = AddScaled(lean, r.normal, hn::Neg(Dot(lean, r.normal)));
  const V back = hn::Neg(hn::Max(hn::Sub(r.distance, Set(args.outer - 1 / args.per_width)), hn::Zero(d)));
  const V bend = hn::Mul(Set(-args.droop), hn::Mul(height, height));
  const auto axis = [&](V v, V n, V l, float spacing) HWY_ATTR {
    const V along = hn::Mul(n, back);
    return hn::MulAdd(hn::MulAdd(l, bend, along), Set(1 / spacing), v);
  };
  const Vec3 foot = {axis(p.x, r.normal.x, across.x, set.spacing[0]),
                     axis(p.y, r.normal.y, across.y, set.spacing[1]),
                     axis(p.z, r.normal.z, across.z, set.spacing[2])};
  // The strand's direction: the surface's normal, bent.
  const V tilt = hn::Mul(Set(2 * args.droop * args.per_width), height);
  const NoisePlace at = LocateNoise(args.fur, foot);
  PrefetchNoise(args.fur, at);
  r.patch = NoiseValue(args.fur, foot, static_cast<float>(kFurPatch));
  r.normal = Unit(AddScaled(r.normal, across, tilt));
  return at;
}
HWY_INLINE V Strands(const MediumArgs& args, const NoisePlace& foot, V t) {
  const V n = Clamp01(hn::MulAdd(NoiseAt(args.fur, foot), Set(static_cast<float>(kFurSpread)), Set(0.5f)));
  // The higher, the fewer: strands taper, and most end where the undercoat does.
  const V height = hn::Sub(Set(1), t);
  const V over = Clamp01(hn::Mul(hn::Sub(height, Set(static_cast<float>(kFurUnder))), Set(4)));
  const V step = hn::Mul(hn::Mul(over, over), hn::NegMulAdd(over, Set(2), Set(3)));
  const V thin =
      hn::MulAdd(height, Set(static_cast<float>(kFurThin[1])), Set(static_cast<float>(kFurThin[0])));
  const V least = hn::MulAdd(step, Set(static_cast<float>(kFurGuard) * args.fur_guard), thin);
  const V strand = Clamp01(hn::Mul(hn::Sub(n, least), Set(static_cast<float>(kFurSharp))));
  const V end = hn::Min(hn::Mul(t, Set(static_cast<float>(kFurEnd))), Set(1));
  return hn::IfThenElse(hn::Ge(t, Set(1)), t, hn::Mul(strand, end));  // below the skin all is solid
}

template <typename T>
class Medium {
 public:
  explicit Medium(const MediumArgs& args)
      : args_(args), samples_(static_cast<const T*>(args.field.samples)) {}

  HWY_INLINE V Value(const Vec3& p) const {
    const Field& f = args_.field;
    const Cell c = Locate(f, p);
    const V code = TrilinearAt(f, samples_, c);
    return hn::MulAdd(code, Set(f.scale), Set(f.bias));
  }
  HWY_INLINE ValueAndGradient ValueGradient(const Vec3& p) const {
    const Field& f = args_.field;
    const Cell c = Locate(f, p);
    ValueAndGradient r = TrilinearGradientAt(f, samples_, c);
    r.value = hn::MulAdd(r.value, Set(f.scale), Set(f.bias));
    r.gradient = Scaled(r.gradient, Set(f.scale));
    return r;
  }

  // Lit colour and extinction of a density volume where the ray has come `along`, for the segment of `half`
  // before and behind.
  HWY_INLINE s::Pixels Density(const Ray& ray, V along, V half, const Vec3& to_eye) const {
    const Vec3 p = At(ray, along);
    Sample sample;
    s::Pixels c;
    if (!args_.steps.empty()) {
      sample = Modulated(p);
      c = ColorOf(args_.transfer, sample.value);
      Shade(args_, p, sample, to_eye, c);
      return c;
    }
    const bool lit = args_.look == Look::kLit;
    if (lit) {
      const ValueAndGradient v = ValueGradient(p);
      sample.value = v.value;
      sample.normal = WorldNormal(args_.rays, v.gradient, -1);  // denser is inside
    }
    if (args_.classification == Classification::kPre) {
      c = Classified(p);
    } else if (args_.classification == Classification::kPreIntegrated) {
      c = Integrated(Value(At(ray, hn::Sub(along, half))), Value(At(ray, hn::Add(along, half))));
    } else {
      if (!lit) sample.value = Value(p);
      c = ColorOf(args_.transfer, sample.value);
    }
    Shade(args_, p, sample, to_eye, c);
    return c;
  }

  // Samples of K sets of lanes: each stage is done for all of them before the next, so that one's reads go on
  // while another waits. Lanes in which there is no density leave their set; false: none is left.
  template <int K>
  HWY_INLINE bool Hyper(const Vec3 (&p)[K], M (&lanes)[K], Sample (&r)[K]) const {
    const Field& f = args_.field;
    const D d;
    Vec3 q[K];
    V turbulence[K], t[K];
    for (int k = 0; k < K; ++k) q[k] = p[k], turbulence[k] = hn::Zero(d);
    for (const DmfStep& step : args_.steps) {
      if (step.kind == Kind::kLift && step.lookup == TurbulenceLookup::kBlock && step.weights.empty()) {
        // Flames: without a call, so that the vectors stay in registers.
        NoisePlace at[K];
        for (int k = 0; k < K; ++k) {
          at[k] = LocateNoise(step.noise, p[k]);
          PrefetchNoise(step.noise, at[k]);
        }
        for (int k = 0; k < K; ++k) {
          turbulence[k] = NoiseAt(step.noise, at[k]);
          q[k].y = hn::NegMulAdd(turbulence[k], Set(step.amount), q[k].y);
        }
      } else if (Moves(step.kind)) {
        for (int k = 0; k < K; ++k) {
          const Vec3 from = p[k];
          Vec3 to = q[k];
          V found = turbulence[k];
          Move(args_, step, from, to, found);
          q[k] = to, turbulence[k] = found;
        }
      }
    }
    const auto none = [&]() HWY_ATTR {
      M any = lanes[0];
      for (int k = 1; k < K; ++k) any = hn::Or(any, lanes[k]);
      return hn::AllFalse(d, any);
    };
    const bool lit = args_.look == Look::kLit || args_.look == Look::kFur || args_.normals;
    GradientLines<T> lines[K];
    for (int k = 0; k < K; ++k) {
      const Cell c = Locate(f, q[k]);
      V code;
      if (lit) {
        lines[k] = GradientLinesAt(f, samples_, c);
        code = lines[k].Value(c.f);
      } else {
        code = TrilinearAt(f, samples_, c);
      }
      r[k].distance = hn::MulAdd(code, Set(f.scale), Set(f.bias));
      const V inside = hn::Sub(Set(args_.outer), r[k].distance);
      t[k] = args_.per_width > 0 ? Clamp01(hn::Mul(inside, Set(args_.per_width)))
                                 : hn::IfThenElseZero(hn::Ge(inside, hn::Zero(d)), Set(1));
      if (args_.zero_stays) lanes[k] = hn::And(lanes[k], hn::Gt(t[k], Set(args_.unseen)));
    }
    if (args_.zero_stays && none()) return false;
    if (lit) {
      for (int k = 0; k < K; ++k) {
        const Cell c = Locate(f, q[k]);
        const Vec3 gradient = GradientAt(f, samples_, c, lines[k]).gradient;
        r[k].normal = WorldNormal(args_.rays, gradient, f.scale < 0 ? -1 : 1);
        if (args_.normals) r[k].slope = SlopeOf(args_, gradient);
      }
    }
    V solid[K];
    for (int k = 0; k < K; ++k) solid[k] = t[k];
    if (args_.look == Look::kFur) {
      NoisePlace foot[K];
      for (int k = 0; k < K; ++k) foot[k] = FootOf(args_, p[k], r[k], t[k]);
      for (int k = 0; k < K; ++k) t[k] = Strands(args_, foot[k], t[k]);
    }
    for (const DmfStep& step : args_.steps) {
      if (step.again) {
        for (int k = 0; k < K; ++k) {
          const V torn = Torn(step, turbulence[k], t[k]);
          t[k] = step.weights.empty() ? torn : Weighted(args_, step, Vec3(p[k]), r[k], solid[k], t[k], torn);
        }
      } else if (!Moves(step.kind)) {
        for (int k = 0; k < K; ++k) {
          const Vec3 from = p[k];
          const V changed = Modulate(args_, step, from, r[k].distance, solid[k], t[k]);
          t[k] = step.weights.empty() ? changed : Weighted(args_, step, from, r[k], solid[k], t[k], changed);
        }
      }
    }
    for (int k = 0; k < K; ++k) r[k].value = t[k];
    return true;
  }

 private:
  const MediumArgs& args_;
  const T* samples_;

 public:
  // The value of a density volume that its chain leaves at p, where its domain begins and ends 0 and 1.
  HWY_NOINLINE Sample Modulated(const Vec3& p) const {
    const D d;
    Vec3 q = p;
    V turbulence = hn::Zero(d);
    for (const DmfStep& step : args_.steps) {
      if (Moves(step.kind)) Move(args_, step, p, q, turbulence);
    }
    Sample r;
    if (args_.look == Look::kLit || args_.normals) {
      const ValueAndGradient v = ValueGradient(q);
      r.distance = v.value;
      r.normal = WorldNormal(args_.rays, v.gradient, -1);
      r.slope = hn::Mul(SlopeOf(args_, v.gradient), Set(1 / std::fabs(args_.field.scale)));
    } else {
      r.distance = Value(q);
    }
    const V solid = Clamp01(hn::MulAdd(r.distance, Set(args_.to_density[0]), Set(args_.to_density[1])));
    V t = solid;
    for (const DmfStep& step : args_.steps) {
      if (Moves(step.kind)) continue;
      const V changed =
          step.again ? Torn(step, turbulence, t) : Modulate(args_, step, p, r.distance, solid, t);
      t = Weighted(args_, step, p, r, solid, t, changed);
    }
    r.value = hn::MulAdd(t, Set(args_.from_density[0]), Set(args_.from_density[1]));
    return r;
  }
  // What mode=mip takes the largest of.
  HWY_INLINE V Shown(const Vec3& p) const { return args_.steps.empty() ? Value(p) : Modulated(p).value; }

  // Colour and extinction interpolated from those of the eight voxels around p.
  HWY_NOINLINE s::Pixels Classified(const Vec3& p) const {
    const D d;
    const Field& f = args_.field;
    const Cell c = Locate(f, p);
    Corners corners;
    if (f.pages == nullptr) {
      ReadCorners(f, samples_, NearPlacesOf(f, c), corners);
    } else {
      ReadCornersInBricks(f, samples_, c, corners);
    }
    const V one = Set(1);
    s::Pixels sum = {hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    const auto add = [&](V code, V weight) HWY_ATTR {
      const s::Pixels e = ColorOf(args_.transfer, hn::MulAdd(code, Set(f.scale), Set(f.bias)));
      const V there = hn::Mul(weight, e.a);
      sum.r = hn::MulAdd(there, e.r, sum.r);
      sum.g = hn::MulAdd(there, e.g, sum.g);
      sum.b = hn::MulAdd(there, e.b, sum.b);
      sum.a = hn::Add(sum.a, there);
    };
    for (int line = 0; line < 4; ++line) {
      const V weight = hn::Mul((line & 1) != 0 ? c.f.y : hn::Sub(one, c.f.y),
                               (line >> 1) != 0 ? c.f.z : hn::Sub(one, c.f.z));
      add(corners.at[2 * line], hn::Mul(weight, hn::Sub(one, c.f.x)));
      add(corners.at[2 * line + 1], hn::Mul(weight, c.f.x));
    }
    const V per = hn::IfThenElseZero(hn::Gt(sum.a, hn::Zero(d)), hn::Div(one, hn::Max(sum.a, Set(1e-30f))));
    return {hn::Mul(sum.r, per), hn::Mul(sum.g, per), hn::Mul(sum.b, per), sum.a};
  }

  // Colour and mean extinction of a segment between two values.
  HWY_NOINLINE s::Pixels Integrated(V front, V back) const {
    const D d;
    const DI di;
    const ColorTable& t = args_.transfer;
    const float per = static_cast<float>(kPairSize - 1) / static_cast<float>(t.size - 1);
    const auto place = [&](V v, VI& whole) HWY_ATTR {
      V u = hn::Mul(hn::MulAdd(v, Set(t.times), Set(t.plus)), Set(per));
      u = hn::Min(hn::Max(u, hn::Zero(d)), Set(static_cast<float>(kPairSize - 1)));
      whole = hn::ConvertTo(di, u);
      return hn::Sub(u, hn::ConvertTo(d, whole));
    };
    VI i, j;
    const V fx = place(front, i), fy = place(back, j);
    constexpr int kRow = kPairSize + 1;
    const Places entry(hn::Add(hn::Mul(j, hn::Set(di, kRow)), i));
    const auto line = [&](ptrdiff_t further) HWY_ATTR {
      return Mixed(EntryAt(args_.pairs, entry, further), EntryAt(args_.pairs, entry, further + 1), fx);
    };
    return Mixed(line(0), line(kRow), fy);
  }
};

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
