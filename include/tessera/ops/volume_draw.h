// The parameters of a volume's picture, completed and checked: what the operation, its kernels and its
// reference share.
#ifndef TESSERA_OPS_VOLUME_DRAW_H_
#define TESSERA_OPS_VOLUME_DRAW_H_

#include <memory>
#include <vector>

#include "tessera/ops/volume.h"

namespace tessera::base {

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
  std::vector<float> pairs;                    // [back][front], kPairSize + 1 a side
  double transfer_low = 0, transfer_high = 1;  // the domain of `transfer`
};
using VolumeDrawPointer = std::shared_ptr<const VolumeDraw>;

// Shapes of the presets, in world units where not said otherwise.
// Melting: the field is read at p + up * amount g (floor + share N(p)), g = (way down the volume's box)^2.
inline constexpr double kMeltNoise = 0.75, kMeltStretch = 0.22, kMeltDrift = 0.02;
// Fur: strands lean this way (x sways with time), and stand where gain_0.875 of the noise at their feet is
// large.
inline constexpr double kFurSway = 0.25, kFurPace = 2.1, kFurSpread = 0.75;
inline constexpr double kFurRoot = 0.22;  // light at the roots

}  // namespace tessera::base

#endif  // TESSERA_OPS_VOLUME_DRAW_H_
