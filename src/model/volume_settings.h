// What a volume's picture keeps: its parameters, completed and checked, and the samples of blocks of noise,
// as the march and its reference read them.
#ifndef TESSERA_MODEL_VOLUME_SETTINGS_H_
#define TESSERA_MODEL_VOLUME_SETTINGS_H_

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "tessera/ops/hypertexture.h"
#include "tessera/ops/volume.h"

namespace tessera {

// Sample (x, y, z) of channel c lies at ((z + 1) * slice + (y + 1) * row + x + 1) * channels + c, x, y, z
// from -1 to size + 1: one periodic sample before and two behind, at positions (x + 1/2) / size of the block.
struct NoiseBlock::Data {
  int size = 0, channels = 1;
  int row = 0, slice = 0;               // in texels
  std::shared_ptr<uint16_t[]> samples;  // 32 bytes beyond the end may be read
  // Of blocks of one channel, for the march: at each texel its own sample, the next along y, along z, and
  // along both, so that the eight corners of a cell are 16 bytes in a row.
  std::shared_ptr<uint16_t[]> cells;
  float scale = 1, bias = 0;     // value = scale * code + bias
  double slopes[3] = {0, 0, 0};  // largest |difference| of neighbours along an axis times size, channel 0
  double low = 0, high = 0;      // of channel 0
  double mean = 0;               // of channel 0
};

}  // namespace tessera

namespace tessera::ops::volume {

inline constexpr int kMostVolumes = 8;        // of one scene
inline constexpr int kTransferSize = 1024;    // entries of a transfer function
inline constexpr int kPairSize = 256;         // entries a side of a pre-integrated table
inline constexpr double kSurfaceStep = 0.25;  // voxels between the places where a surface is looked for

struct VolumeDraw {
  Volume volume;
  VolumeParams params;
  Roi window;               // the camera looks through it
  bool with_scene = false;  // input 0 is the depth of opaque objects
  PlacedVolume placed;      // as it was given, its camera that of the world; `params` are in the volume's own
  // The further volumes of a scene, all seen by the first one's camera.
  std::vector<std::shared_ptr<const VolumeDraw>> others;
  // Tables of four floats an entry (colour and extinction per world unit), the last entry twice.
  std::vector<float> colors, transfer;
  double colors_low = 0, colors_high = 1;      // the domain of `colors`
  std::array<int, 3> nodes = {2, 2, 2};        // of the opacity volume
  std::vector<float> emission;                 // as `transfer`, over its domain; colour alone; or empty
  std::vector<float> pairs;                    // [back][front], kPairSize + 1 a side
  double transfer_low = 0, transfer_high = 1;  // the domain of `transfer`
};
using VolumeDrawPointer = std::shared_ptr<const VolumeDraw>;

// Where octave k of turbulence is read, 2^k p + shift, in blocks: apart from each other, or all octaves would
// be 0 in the same places.
inline constexpr float kOctaveShifts[8][3] = {{0, 0, 0},
                                              {0.375f, 0.6875f, 0.1875f},
                                              {0.8125f, 0.25f, 0.5625f},
                                              {0.125f, 0.5f, 0.9375f},
                                              {0.625f, 0.0625f, 0.3125f},
                                              {0.4375f, 0.875f, 0.75f},
                                              {0.0625f, 0.375f, 0.6875f},
                                              {0.6875f, 0.9375f, 0.25f}};

// Shapes of the presets, in world units where not said otherwise.
// Melting: the field is read at p + up * amount g (floor + share N(p)), g = (way down the volume's box)^2.
inline constexpr double kMeltNoise = 0.75, kMeltStretch = 0.22, kMeltDrift = 0.02;
// Drops hang where a noise of this many blocks for one of melting's passes from one number to the other, and
// are so thick, in parts of the volume's longest side.
inline constexpr double kDripNoise = 2.6, kDripFrom = 0.12, kDripTo = 0.55, kDripDepth = 0.025;
// Flames die in these parts of the volume's longest side below its top, or in their height where that is
// less.
inline constexpr double kFireRoom = 0.25;
// Fur: strands lean this way (x sways with time), and stand where gain_0.875 of the noise at their feet is
// large.
inline constexpr double kFurSway = 0.25, kFurPace = 2.1, kFurSpread = 0.75;
inline constexpr double kFurRoot = 0.12;  // light at the roots
// A strand is there at height h where the noise at its foot is above kFurThin[0] + kFurThin[1] h, and guard
// kFurGuard more from kFurUnder on; edges are so sharp. Colour changes with the noise at kFurPatch times the
// frequency.
inline constexpr double kFurThin[2] = {0.26, 0.30}, kFurGuard = 0.28, kFurUnder = 0.42, kFurSharp = 5;
inline constexpr double kFurEnd = 8, kFurPatch = 0.23;

}  // namespace tessera::ops::volume

#endif  // TESSERA_MODEL_VOLUME_SETTINGS_H_
