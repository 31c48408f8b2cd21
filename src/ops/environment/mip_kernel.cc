// How wide a pixel's reflection is, and trilinear lookups in a chain of cube maps.
#include <algorithm>
#include <cmath>

#include "ops/environment/mips.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/environment/mip_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/environment/bilinear-inl.h"
#include "simd/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;
using s::DD;
using s::VD;

HWY_INLINE VD SetD(double v) { return hn::Set(DD(), v); }
HWY_INLINE int Step() { return static_cast<int>(hn::Lanes(DD())); }

void Normalize(const ReflectionRun& run, MirrorRow& row) {
  const DD d;
  const hn::Rebind<float, DD> df;
  for (int i = 0; i < kDirectionRun; i += Step()) {
    const VD x = hn::Load(d, run.directions.x + i), y = hn::Load(d, run.directions.y + i),
             z = hn::Load(d, run.directions.z + i);
    // By the largest component first: the square of what is tiny would be nothing.
    const VD largest = hn::Max(hn::Abs(x), hn::Max(hn::Abs(y), hn::Abs(z)));
    const VD u = hn::Div(x, largest), v = hn::Div(y, largest), w = hn::Div(z, largest);
    const VD over = hn::Div(SetD(1.0), hn::Sqrt(hn::MulAdd(u, u, hn::MulAdd(v, v, hn::Mul(w, w)))));
    hn::Store(hn::Mul(u, over), d, row.x + i);
    hn::Store(hn::Mul(v, over), d, row.y + i);
    hn::Store(hn::Mul(w, over), d, row.z + i);
    hn::Store(hn::PromoteTo(d, hn::Load(df, run.valid + i)), d, row.valid + i);
  }
}

// The squared distance to a neighbour; infinite where there is none.
HWY_INLINE VD Distance(VD x, VD y, VD z, const MirrorRow& row, int i) {
  const DD d;
  const VD dx = hn::Sub(hn::LoadU(d, row.x + i), x), dy = hn::Sub(hn::LoadU(d, row.y + i), y),
           dz = hn::Sub(hn::LoadU(d, row.z + i), z);
  const auto there = hn::Eq(hn::LoadU(d, row.valid + i), SetD(1.0));
  return hn::IfThenElse(there, hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz))), hn::Inf(d));
}

void Levels(const EnvironmentMips& mips, const MirrorRow& above, const MirrorRow& row, const MirrorRow& below,
            int count, double* level) {
  const DD d;
  const VD zero = hn::Zero(d), infinity = hn::Inf(d), one = SetD(1.0);
  const VD first = SetD(1 / (mips.first_angle() - mips.map_angle()));
  for (int i = 0; i < count; i += Step()) {
    const VD x = hn::LoadU(d, row.x + i + 1), y = hn::LoadU(d, row.y + i + 1),
             z = hn::LoadU(d, row.z + i + 1);
    const auto known = [&](VD v) HWY_ATTR { return hn::IfThenElseZero(hn::Lt(v, infinity), v); };
    const VD across = known(hn::Min(Distance(x, y, z, row, i), Distance(x, y, z, row, i + 2)));
    const VD down = known(hn::Min(Distance(x, y, z, above, i + 1), Distance(x, y, z, below, i + 1)));
    const VD square = hn::Max(hn::Max(across, down), SetD(1e-30));
    const VD angle = hn::Mul(s::Log2OfDouble<s::Precision::kDouble>(square), SetD(0.5));
    // Up to the first cube, whose texels are not just twice as wide, and from there on.
    const VD near = hn::Mul(hn::Sub(angle, SetD(mips.map_angle())), first);
    const VD far = hn::Add(hn::Sub(angle, SetD(mips.first_angle())), one);
    const VD at = hn::IfThenElse(hn::Lt(angle, SetD(mips.first_angle())), near, far);
    // Maps of very few texels have them wider than the cube's.
    const VD wide = hn::IfThenElseZero(hn::Gt(angle, SetD(mips.map_angle())), at);
    hn::StoreU(hn::Min(hn::Max(wide, zero), SetD(mips.last())), d, level + i);
  }
}

struct FacePlace {
  int face;
  double s, t;  // 0 to 1 from the upper left corner
};
HWY_INLINE FacePlace PlaceOn(double x, double y, double z) {
  const double ax = std::fabs(x), ay = std::fabs(y), az = std::fabs(z);
  const auto place = [](int face, double s, double t, double major) {
    const double over = 0.5 / major;
    return FacePlace{face, s * over + 0.5, t * over + 0.5};
  };
  if (ax >= ay && ax >= az) return x < 0 ? place(1, z, -y, ax) : place(0, -z, -y, ax);
  if (ay >= az) return y < 0 ? place(3, x, -z, ay) : place(2, x, z, ay);
  return z < 0 ? place(5, -x, -y, az) : place(4, x, -y, az);
}

HWY_INLINE s::Quad LookUpCube(const EnvironmentAtlas& cube, const FacePlace& place) {
  const int n = cube.layout().width;
  // From the face's one edge to the other; half of the borders' texels lie beyond.
  const double u = std::clamp(place.s * n + 0.5, 0.5, n + 0.5);
  const double v = std::clamp(place.t * n + 0.5, 0.5, n + 0.5);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const float fx = static_cast<float>(u - i), fy = static_cast<float>(v - j);
  const ptrdiff_t stride = ptrdiff_t{4} * cube.stride();
  const float* const texel =
      cube.pixels() + 4 * ((ptrdiff_t{place.face} * cube.rows() + j) * cube.stride() + i);
  if (HWY_LIKELY(cube.finite())) return Bilinear(texel, stride, fx, fy);
  float rgba[4];
  BilinearWhereWeighted(texel, stride, fx, fy, rgba);
  return s::Quad::Load(rgba);
}

// (1 - f) a + f b of what may be infinite.
HWY_INLINE s::Quad MixWeighted(s::Quad a, s::Quad b, float f) {
  float from[4], to[4];
  a.Store(from), b.Store(to);
  for (int c = 0; c < 4; ++c) to[c] = f < 1 ? (1 - f) * from[c] + f * to[c] : to[c];
  return s::Quad::Load(to);
}

void Mix(const EnvironmentMips& mips, const MirrorRow& row, const double* level, int count, float* rgba) {
  for (int i = 0; i < count; ++i) {
    if (level[i] == 0) continue;
    const int below = static_cast<int>(level[i]);
    const float f = static_cast<float>(level[i] - below);
    const FacePlace place = PlaceOn(row.x[i + 1], row.y[i + 1], row.z[i + 1]);
    s::Quad texel = below == 0 ? s::Quad::Load(rgba + 4 * i) : LookUpCube(mips.cube(below), place);
    if (f > 0) {
      const s::Quad wider = LookUpCube(mips.cube(below + 1), place);
      texel =
          HWY_LIKELY(mips.finite()) ? s::Lerp(texel, wider, s::Quad::Set(f)) : MixWeighted(texel, wider, f);
    }
    texel.Store(rgba + 4 * i);
  }
}

}  // namespace

MipKernels MipKernelsOfTarget() { return {&Normalize, &Levels, &Mix}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MipKernelsOfTarget);

MipKernels ChooseMipKernels() { return HWY_DYNAMIC_DISPATCH(MipKernelsOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
