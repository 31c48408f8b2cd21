// What the kernels of volume pictures are given: rays, a field, noise, light, a region to fill.
#ifndef TESSERA_OPS_VOLUME_MARCH_H_
#define TESSERA_OPS_VOLUME_MARCH_H_

#include <cstdint>
#include <span>
#include <vector>

#include "model/volume_data.h"
#include "model/volume_settings.h"
#include "tessera/ops/hypertexture.h"
#include "tessera/ops/volume.h"

namespace tessera::ops::volume {

inline constexpr int kPacket = 16;  // rays that go together: 4x4 pixels
inline constexpr int kTile = 16;    // pixels of a cone's side

// Rays in voxels: position = origin + s direction, s = planar depth - middle, both affine in the pixel,
// counted from the window's middle.
struct RaySet {
  float origin[3][3], direction[3][3];  // [axis]: constant, times x, times y
  float middle_x = 0, middle_y = 0;     // pixel coordinates
  float middle_depth = 0;               // planar depth of s = 0
  float centre = 0;                     // s of the volume's centre, not 0 in scenes of several
  float spacing[3] = {1, 1, 1};         // world units a voxel
  float to_world[3] = {0, 0, 0};        // world position of voxel (0, 0, 0)
  float low[3], high[3];                // the box, in voxels
  bool perspective = false;
  bool cut = false;  // by planes
  bool aovs = false;
  float place[12] = {};  // from the volume's own coordinates to the world's: three rows
  int planes = 0;
  float plane[16][4];  // normal and offset in voxels: n . p - offset >= 0 is kept
};

// Channels of a picture: R, G, B, A, Z, N, P, distance.
inline constexpr int kAovChannels = 12;

// The field's samples.
struct Field {
  const void* samples = nullptr;
  PixelType type = PixelType::kFloat;
  int32_t row = 0, slice = 0;
  // Not null: samples lie in bricks, one of which the strides are of, as model::VolumeData has them.
  const base::PagedMemory* pages = nullptr;
  int32_t bricks[2] = {0, 0};  // along x; along x times y
  const model::VolumeData* volume = nullptr;
  float last[3];              // largest coordinate of a sample
  float scale = 1, bias = 0;  // value = scale * code + bias
  // Per block: 0 where it matters, else 1 + voxels; upper byte: pace. `own` is about the field itself, `leap`
  // about points from which the field may be read in a block that matters, displaced.
  const uint16_t *leap = nullptr, *own = nullptr;
  int32_t blocks[2] = {0, 0};  // along x; along x times y
  int shift = 2;
  float edge = 4, per_edge = 0.25f;  // of a block, and one over it
  float pace = 0;                    // of the upper byte: voxels per code of the field and unit
  float least_pace = 0;              // of all blocks, with that factor
  bool leaps = true;

  // For whoever has read what a few rays need.
  void Trim() const {
    if (pages != nullptr) pages->Trim();
  }
};

struct NoiseView {
  const uint16_t* samples = nullptr;  // of texel (0, 0, 0)
  const uint16_t* cells = nullptr;    // of blocks of one channel
  int32_t row = 0, slice = 0, size = 0;
  float scale = 1, bias = 0, half = 0;              // half: of a sample's width, blocks
  float times[3] = {1, 1, 1}, plus[3] = {0, 0, 0};  // from voxels to blocks
};

// Turbulence by the noise itself: octaves of gradient noise at positions in blocks.
struct ExactOctave {
  // Lattice cells a block; where in the block the octave is read, 2^k p + shift; with the noise's scale.
  float cells = 1, times = 1, shift[3] = {0, 0, 0}, weight = 1;
  uint32_t seed = 0;
};

struct Light {
  float color[3], ambient, diffuse, specular, exponent;
  float direction[3];  // unit, or where the light stands, the volume's own coordinates
  bool point, flat;
};

// Four floats an entry.
struct ColorTable {
  const float* entries = nullptr;
  int size = 0;
  float times = 1, plus = 0;  // from the value to entries
};

enum class Look : uint8_t { kPlain, kLit, kFur, kScattered };

// Transmittances towards the light at the nodes of a grid from corner to corner of the box: an opacity
// volume.
struct OpacityView {
  const float* nodes = nullptr;  // null: nothing is shadowed
  int32_t row = 0, slice = 0;
  int32_t size[3] = {0, 0, 0};
  float last[3] = {0, 0, 0};                        // largest coordinate of a node
  float times[3] = {0, 0, 0}, plus[3] = {0, 0, 0};  // from voxels to nodes
};

// A function of one number: from a point on value + (s - at) slope.
struct LinePoint {
  float at, value, slope;
};
using Line = std::vector<LinePoint>;

// A share of a step's effect.
struct DmfWeight {
  DmfInput::Kind kind;
  float place[3];
  Line line;
};

struct DmfStep {
  Dmf::Kind kind;
  TurbulenceLookup lookup;
  float amount, second, third;
  NoiseView noise;
  ExactOctave exact[kTurbulenceOctaves];
  const DmfFunction* function;
  bool again;  // the turbulence of the step that moved the point
  Line table;
  std::vector<DmfWeight> weights;
};

struct Target {
  ImageView out;
  const int* channels = nullptr;  // numbers of kAovChannels; null: in order
  bool rgba = false;              // these four in order
  const float* scene = nullptr;   // planar depth of the pixels of `out`, `scene_row` floats a row; or null
  ptrdiff_t scene_row = 0, scene_pixel = 0;
};

struct SurfaceArgs {
  RaySet rays;
  Field field;
  float level = 0, side = 1;  // side * (code - level) is negative inside
  float margin = 0;           // rounding of the field, codes
  VolumeMode mode = VolumeMode::kIso;
  Light light;
  NoiseView noise;    // kSolid, kBump, kMelt
  ColorTable colors;  // kSolid
  float k = 2;        // kBump
  float sag[4] = {0, 0, 0,
                  0};  // kMelt: amount in voxels, low and inverse height of the body in voxels, noise part
  // Bound of the displacement's slope along a ray of unit direction d, t of the way down: t steep[0] |d.y| +
  // t^2 (steep[1] |d.x| + steep[2] |d.y| + steep[3] |d.z|).
  float steep[4] = {0, 0, 0, 0};
};

// Beside the first one.
struct FurtherLight {
  Light light;  // without an ambient part
  OpacityView opacity;
};

struct MediumArgs {
  RaySet rays;
  Field field;
  VolumeMode mode = VolumeMode::kOver;
  VolumeMethod method = VolumeMethod::kRays;
  Classification classification = Classification::kPost;
  Look look = Look::kPlain;
  Light light;
  OpacityView opacity;
  std::vector<FurtherLight> further;
  Light towards;                 // that an opacity volume's nodes march to
  float shadow = 0, phase = 0;   // its strength; g
  ColorTable transfer;           // entries of colour and extinction per world unit
  ColorTable emission;           // over the same domain; none: the medium has no light of its own
  const float* pairs = nullptr;  // pre-integrated: kPairSize^2 entries
  float step = 0.01f;            // world units (kStacks: unused)
  int axis = 2;                  // kStacks
  float opaque = 1;              // ends at this alpha
  float reference = 0.01f;       // kAttenuate: world units whose opacity is averaged
  // Hypertexture: the density of a distance and its modulation.
  bool hyper = false;
  float outer = 0, per_width = 0;  // D = (outer - d) * per_width; 0: hard at outer
  NoiseView fur;
  float droop = 0;  // voxels
  float fur_lean[3] = {0, 0, 0};
  float fur_root[3] = {1, 1, 1}, fur_rise[3] = {0, 0, 0};  // colour at the roots, and what tips have more
  float fur_guard = 0, fur_patches = 0;
  bool zero_stays = false;  // no step makes density of nothing, and nothing is transparent
  float clear = 0;          // values up to here are transparent
  // Where zero stays: densities before the chain that are not seen behind it; distances of which nothing is
  // seen, and voxels for each unit of distance beyond in which nothing is either (0: not known).
  float unseen = 0, far = 0, pace = 0;
  std::vector<DmfStep> steps;
  bool normals = false;  // a weight is about normals or gradients
  Light eye;             // where it is, or which way: as of a light
  float to_density[2] = {1, 0},
        from_density[2] = {1, 0};  // of density volumes: times and plus, values and [0, 1]
  float mip_times = 1, mip_plus = 0;
};

using DrawSurface = void (*)(const SurfaceArgs&, const Target&);
using DrawMedium = void (*)(const MediumArgs&, const Target&);
// Media whose rays count depth from the same place, at most kMostVolumes.
using DrawMixture = void (*)(std::span<const MediumArgs* const>, const Target&);
// Fills a row of nodes, number y + size[1] * z, of an opacity volume.
using FillOpacity = void (*)(const MediumArgs&, const OpacityView&, int64_t row, float* nodes);
DrawSurface FindSurface(PixelType type);
DrawMedium FindMedium(PixelType type);
DrawMixture FindMixture();
FillOpacity FindOpacity(PixelType type);

}  // namespace tessera::ops::volume

#endif  // TESSERA_OPS_VOLUME_MARCH_H_
