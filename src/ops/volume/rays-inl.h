// Rays of a picture of a volume: where they begin and end, light, and the blocks of pixels that go together.
#if defined(TESSERA_OPS_VOLUME_RAYS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_RAYS_INL_H_
#undef TESSERA_OPS_VOLUME_RAYS_INL_H_
#else
#define TESSERA_OPS_VOLUME_RAYS_INL_H_
#endif

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ops/volume/sample-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

// --- Rays. ---
struct Ray {
  Vec3 origin, direction;  // voxels; position = origin + s direction
  V length;                // voxels per s
  V world;                 // world units per s
  V enter;                 // where the box begins (or the eye is)
  V begin, end;            // inside the box, the planes, before the scene
  M hits;                  // begin < end
};
HWY_INLINE Vec3 At(const Ray& ray, V along) { return AddScaled(ray.origin, ray.direction, along); }

// Ends a ray where it leaves the box and the planes' half spaces, and begins it where it enters them: `enter`
// is where it enters the box.
HWY_INLINE void Clip(const RaySet& set, Ray& r) {
  const D d;
  const auto slab = [&](V o, V dir, float low, float high) HWY_ATTR {
    // Parallel to the slab: all of it or nothing, faces included.
    const M still = hn::Eq(dir, hn::Zero(d));
    const V inverse = hn::Div(Set(1), hn::IfThenElse(still, Set(1), dir));
    const V a = hn::Mul(hn::Sub(Set(low), o), inverse), b = hn::Mul(hn::Sub(Set(high), o), inverse);
    const M inside = hn::And(hn::Ge(o, Set(low)), hn::Le(o, Set(high)));
    const V enter = hn::IfThenElse(still, hn::IfThenElse(inside, Set(-1e30f), Set(1e30f)), hn::Min(a, b));
    const V leave = hn::IfThenElse(still, Set(1e30f), hn::Max(a, b));
    r.begin = hn::Max(r.begin, enter);
    r.end = hn::Min(r.end, leave);
  };
  slab(r.origin.x, r.direction.x, set.low[0], set.high[0]);
  slab(r.origin.y, r.direction.y, set.low[1], set.high[1]);
  slab(r.origin.z, r.direction.z, set.low[2], set.high[2]);
  r.enter = r.begin;
  for (int k = 0; k < set.planes; ++k) {
    const Vec3 n = {Set(set.plane[k][0]), Set(set.plane[k][1]), Set(set.plane[k][2])};
    const V above = hn::Sub(Dot(n, r.origin), Set(set.plane[k][3])), rise = Dot(n, r.direction);
    const M still = hn::Eq(rise, hn::Zero(d));
    const V crossing = hn::Div(hn::Neg(above), hn::IfThenElse(still, Set(1), rise));
    const M gone = hn::And(still, hn::Lt(above, hn::Zero(d)));
    r.begin = hn::IfThenElse(hn::Gt(rise, hn::Zero(d)), hn::Max(r.begin, crossing), r.begin);
    r.begin = hn::IfThenElse(gone, Set(1e30f), r.begin);
    r.end = hn::IfThenElse(hn::Lt(rise, hn::Zero(d)), hn::Min(r.end, crossing), r.end);
  }
  r.hits = hn::Lt(r.begin, r.end);
}

HWY_INLINE Ray RayOf(const RaySet& set, V x, V y, V scene_depth) {
  x = hn::Sub(x, Set(set.middle_x));
  y = hn::Sub(y, Set(set.middle_y));
  const auto affine = [&](const float* c)
                          HWY_ATTR { return hn::MulAdd(y, Set(c[2]), hn::MulAdd(x, Set(c[1]), Set(c[0]))); };
  Ray r;
  r.origin = {affine(set.origin[0]), affine(set.origin[1]), affine(set.origin[2])};
  r.direction = {affine(set.direction[0]), affine(set.direction[1]), affine(set.direction[2])};
  const Vec3 w = {hn::Mul(r.direction.x, Set(set.spacing[0])), hn::Mul(r.direction.y, Set(set.spacing[1])),
                  hn::Mul(r.direction.z, Set(set.spacing[2]))};
  r.length = hn::Sqrt(Dot(r.direction, r.direction));
  r.world = hn::Sqrt(Dot(w, w));
  // A perspective ray begins at the eye; what lies behind is not seen.
  r.begin = Set(set.perspective ? -set.middle_depth : -1e30f);
  r.end = hn::Min(Set(1e30f), hn::Sub(scene_depth, Set(set.middle_depth)));
  Clip(set, r);
  return r;
}

// Coordinates of the pixels of a part of a 4x4 packet.
HWY_INLINE void PixelsOf(int x0, int y0, int first, V& x, V& y) {
  const DI di;
  const VI lane = hn::Add(hn::Iota(di, 0), hn::Set(di, first));
  x = hn::ConvertTo(D(), hn::Add(hn::Set(di, x0), hn::And(lane, hn::Set(di, 3))));
  y = hn::ConvertTo(D(), hn::Add(hn::Set(di, y0), hn::ShiftRight<2>(lane)));
}

// --- Light. ---
// The material's colour times `lit`, plus `gloss`. A normal of zero is lit by the ambient light alone.
struct Shine {
  V lit, gloss;
};
// base^exponent, 0 for bases of 1e-6 and less. Relative error 4 u (1 + |exponent log base|).
HWY_INLINE V Power(V base, float exponent) {
  const D d;
  const M some = hn::Gt(base, Set(1e-6f));
  const V log = hn::Log(d, hn::IfThenElse(some, base, Set(1)));
  return hn::IfThenElseZero(some, hn::Exp(d, hn::Max(hn::Mul(log, Set(exponent)), Set(-80))));
}
// Unit vector from position p (voxels) to the light.
HWY_INLINE Vec3 ToLight(const RaySet& set, const Light& light, const Vec3& p) {
  const Vec3 l = {Set(light.direction[0]), Set(light.direction[1]), Set(light.direction[2])};
  if (!light.point) return l;
  const auto axis = [&](V at, V v, int a) HWY_ATTR {
    return hn::Sub(at, hn::MulAdd(v, Set(set.spacing[a]), Set(set.to_world[a])));
  };
  return Unit({axis(l.x, p.x, 0), axis(l.y, p.y, 1), axis(l.z, p.z, 2)});
}
HWY_INLINE Shine Lit(const Light& light, const Vec3& l, const Vec3& normal, const Vec3& to_eye) {
  const D d;
  if (light.flat) return {Set(1), hn::Zero(d)};
  const Vec3 half = Unit({hn::Add(l.x, to_eye.x), hn::Add(l.y, to_eye.y), hn::Add(l.z, to_eye.z)});
  const V facing = Dot(normal, l);
  // A little more light from above.
  V lit = hn::Mul(Set(light.ambient), hn::MulAdd(normal.y, Set(0.3f), Set(1)));
  lit = hn::MulAdd(hn::Max(facing, hn::Zero(d)), Set(light.diffuse), lit);
  const V gloss =
      hn::Mul(Set(light.specular), Power(hn::Max(Dot(normal, half), hn::Zero(d)), light.exponent));
  return {lit, hn::IfThenElseZero(hn::Gt(facing, hn::Zero(d)), gloss)};
}
HWY_INLINE Vec3 WorldNormal(const RaySet& set, const Vec3& gradient, float side) {
  return Unit({hn::Mul(gradient.x, Set(side / set.spacing[0])),
               hn::Mul(gradient.y, Set(side / set.spacing[1])),
               hn::Mul(gradient.z, Set(side / set.spacing[2]))});
}
HWY_INLINE Vec3 ToEye(const RaySet& set, const Ray& ray) {
  const V back = hn::Div(Set(-1), ray.world);
  return {hn::Mul(hn::Mul(ray.direction.x, Set(set.spacing[0])), back),
          hn::Mul(hn::Mul(ray.direction.y, Set(set.spacing[1])), back),
          hn::Mul(hn::Mul(ray.direction.z, Set(set.spacing[2])), back)};
}

// --- Blocks of pixels. ---
// Where the rays of a block of pixels may first meet a block of cells that matters: a cone around all of them
// leaps along its middle. Beyond the volume: `missed`.
struct Cone {
  float start = 0;
  bool missed = false;
};
inline Cone ConeOf(const RaySet& set, const Field& field, int x0, int y0, int width, int height) {
  Cone cone;
  const float size[2] = {static_cast<float>(width), static_cast<float>(height)};
  const float x = static_cast<float>(x0) + 0.5f * (size[0] - 1) - set.middle_x;
  const float y = static_cast<float>(y0) + 0.5f * (size[1] - 1) - set.middle_y;
  float o[3], dir[3], spread[2][3], widen[2][3], bound = 0, square = 0;
  for (int a = 0; a < 3; ++a) {
    o[a] = set.origin[a][0] + x * set.origin[a][1] + y * set.origin[a][2];
    dir[a] = set.direction[a][0] + x * set.direction[a][1] + y * set.direction[a][2];
    for (int c = 0; c < 2; ++c) {
      const float v = c == 0 ? 0.5f : -0.5f;
      spread[c][a] = 0.5f * size[0] * set.origin[a][1] + v * size[1] * set.origin[a][2];
      widen[c][a] = 0.5f * size[0] * set.direction[a][1] + v * size[1] * set.direction[a][2];
    }
    const float side = (set.high[a] - set.low[a]) * set.spacing[a];
    bound += side * side;
    square += dir[a] * dir[a];
  }
  const float radius = 0.5f * std::sqrt(bound), per_voxel = 1 / std::sqrt(square);
  // No point of the volume is nearer or further than that.
  const float nearest = set.centre - radius, furthest = set.centre + radius;
  cone.start = std::max(nearest, set.perspective ? -set.middle_depth : nearest);
  if (!field.leaps) return cone;
  for (float at = cone.start; at < furthest;) {
    float wide = 0;
    for (int c = 0; c < 2; ++c) {
      float w = 0;
      for (int a = 0; a < 3; ++a) {
        const float r = spread[c][a] + at * widen[c][a];
        w += r * r;
      }
      wide = std::max(wide, w);
    }
    // Outside the volume the nearest voxel's distance holds too: it is no further from anything inside.
    int block = 0;
    const int strides[3] = {1, field.blocks[0], field.blocks[1]};
    for (int a = 0; a < 3; ++a) {
      const float p = std::min(std::max(o[a] + at * dir[a], 0.0f), field.last[a]);
      block += (static_cast<int>(p) >> field.shift) * strides[a];
    }
    const float room = static_cast<float>(field.leap[block] & 255) - 1 - 0.01f - std::sqrt(wide);
    cone.start = at;
    if (room < 1) return cone;
    at += room * per_voxel;
  }
  cone.missed = true;
  return cone;
}

// The pixels of a 4x4 packet before they are written.
struct Packet {
  HWY_ALIGN float v[kAovChannels][kPacket];
};
// Normals, positions and distances of a part of one: p in voxels, `along` its place on the rays.
inline HWY_NOINLINE void StoreAovs(const RaySet& set, const Ray& ray, M found, V along, const Vec3& p,
                                   const Vec3& normal, int part, Packet& packet) {
  const D d;
  const auto own = [&](V v, int a)
                       HWY_ATTR { return hn::MulAdd(v, Set(set.spacing[a]), Set(set.to_world[a])); };
  const Vec3 q = {own(p.x, 0), own(p.y, 1), own(p.z, 2)};
  for (int a = 0; a < 3; ++a) {
    const float* const row = set.place + 4 * a;
    const auto turned = [&](const Vec3& v) HWY_ATTR {
      return hn::MulAdd(v.z, Set(row[2]), hn::MulAdd(v.y, Set(row[1]), hn::Mul(v.x, Set(row[0]))));
    };
    hn::Store(hn::IfThenElseZero(found, turned(normal)), d, packet.v[5 + a] + part);
    hn::Store(hn::IfThenElseZero(found, hn::Add(turned(q), Set(row[3]))), d, packet.v[8 + a] + part);
  }
  const V distance = hn::Mul(hn::Add(along, Set(set.middle_depth)), ray.world);
  const V endless = Set(std::numeric_limits<float>::infinity());
  hn::Store(hn::IfThenElse(found, distance, endless), d, packet.v[11] + part);
}
inline void Write(const Target& target, int x0, int y0, const Packet& packet) {
  const ImageView& out = target.out;
  const int width = std::min(4, out.roi.x1 - x0), height = std::min(4, out.roi.y1 - y0);
  if (target.rgba && width == 4) {
    for (int y = 0; y < height; ++y) {
      const D4 d4;
      const auto plane = [&](int c) HWY_ATTR { return hn::Load(d4, packet.v[c] + 4 * y); };
      hn::StoreInterleaved4(plane(0), plane(1), plane(2), plane(3), d4,
                            reinterpret_cast<float*>(out.At(x0, y0 + y)));
    }
    return;
  }
  for (int y = 0; y < height; ++y) {
    auto* to = reinterpret_cast<float*>(out.At(x0, y0 + y));
    for (int x = 0; x < width; ++x, to += out.channels) {
      for (int c = 0; c < out.channels; ++c) {
        to[c] = packet.v[target.channels == nullptr ? c : target.channels[c]][4 * y + x];
      }
    }
  }
}
HWY_INLINE V SceneDepth(const Target& target, V x, V y) {
  if (target.scene == nullptr) return Set(1e30f);
  const D d;
  HWY_ALIGN float px[kLanes], py[kLanes], depth[kLanes];
  hn::Store(x, d, px);
  hn::Store(y, d, py);
  const Roi& r = target.out.roi;
  for (int l = 0; l < kLanes; ++l) {
    const int i = std::min(static_cast<int>(px[l]), r.x1 - 1) - r.x0,
              j = std::min(static_cast<int>(py[l]), r.y1 - 1) - r.y0;
    const float v = target.scene[j * target.scene_row + i * target.scene_pixel];
    depth[l] = v > -1e30f ? std::min(v, 1e30f) : -1e30f;  // NaN hides everything
  }
  return hn::Load(d, depth);
}

// Calls f(x0, y0, cone, packets) for pairs of 4x4 packets side by side and writes what it fills in; packets
// of blocks that miss are written as `nothing`. The second packet may lie beyond the target.
template <class F>
HWY_INLINE void ForPackets(const RaySet& set, const Field& field, const Target& target, const Packet& nothing,
                           const F& f) {
  const Roi& r = target.out.roi;
  Packet packets[2] = {};
  for (int by = r.y0; by < r.y1; by += kTile) {
    for (int bx = r.x0; bx < r.x1; bx += kTile) {
      const int width = std::min(kTile, r.x1 - bx), height = std::min(kTile, r.y1 - by);
      const Cone cone = ConeOf(set, field, bx, by, width, height);
      for (int y = by; y < by + height; y += 4) {
        for (int x = bx; x < bx + width; x += 8) {
          if (!cone.missed) {
            f(x, y, cone.start, packets);
            field.Trim();
          }
          for (int k = 0; k < 2 && x + 4 * k < bx + width; ++k) {
            Write(target, x + 4 * k, y, cone.missed ? nothing : packets[k]);
          }
        }
      }
    }
  }
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
