/// Procedural textures made of noise: clouds, marble, wood, fire, smoke, water ripples, and Gardner's sines.
/// @file
#ifndef TESSERA_OPS_TEXTURE_H_
#define TESSERA_OPS_TEXTURE_H_

#include <array>
#include <cstdint>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/ops/noise.h"

TESSERA_API_BEGIN
namespace tessera {

/// What the texture looks like.
enum class TextureKind : uint8_t {
  kClouds,   ///< Gardner's sines broken up by fBm, lit from the upper left, over a blue sky
  kMarble,   ///< ramp(sin(2 pi (x freq + T))), T turbulence, at places moved by curls; fine veins across
  kWood,     ///< ramp of rings around an axis below the board, bent by noise, with grain
  kFire,     ///< tongues of rising noise moved by curls, and sparks; premultiplied, its light beyond alpha
  kSmoke,    ///< a rising, widening, fading plume that curls; premultiplied with alpha
  kRipples,  ///< displacement by rings of water: channel 0 is x, 1 is y, around 1/2, further ones the height
  kGardner,  ///< T = k X Y alone, in every channel; with slices the volume k X Y Z inside an ellipsoid
};

/// Textures are functions of pixel position and time; time moves a coordinate, so that frames flow without
/// flicker, and octaves beyond Nyquist are faded. Lengths are in widths of the display window. Colours are
/// linear. Channels beyond those a texture makes are 0; alpha is 1 but for fire and smoke.
/// Fire, smoke and marble read their noise at a place moved by a chain of curls of noises (a divergence-free
/// move stretches and folds, but neither tears nor piles up: Bridson et al. 2007).
struct TextureParams {
  TextureKind kind = TextureKind::kClouds;  ///< which texture
  uint32_t seed = 0;                        ///< of its noise
  double frequency = 4;                     ///< features across the width, [0, 2^20]
  int octaves = 8;                          ///< of the noise, 0 to 64
  double time = 0;                          ///< seconds, within 1e6

  /// Not 0: seconds after which all but kRipples, which repeat every second, are as they were: speeds are
  /// rounded to whole periods in that time. [0, 1e6]
  double loop = 0;
  double curl = 1;  ///< kFire, kSmoke, kMarble: factor on how far curls move what is seen, [0, 4]

  /// kFire
  int layers = 3;     ///< of noise, 1 to 3, the broadest first
  double rise = 1;    ///< kSmoke too: factor on the speeds at which they rise, within 100
  double wind = 0;    ///< drift to the right, widths per second, within 100
  double height = 1;  ///< factor on how high tongues reach, [0.1, 4]
  double embers = 1;  ///< brightness of the sparks, [0, 4]

  /// kGardner: T = scale * X * Y with X = sum over `terms` of c_i sin(f_i x + p_i) + t0, c_{i+1} = 0.707 c_i.
  int terms = 5;           ///< 1 to 12
  double amplitude = 1;    ///< c_1
  double threshold = 0.6;  ///< t0
  double scale = 0.05;     ///< k
  int slices = 1;          ///< kGardner: the image is so many slices stacked along y

  std::vector<NoiseParams> fields = {};  ///< filled in by Texture(): first the curls' potentials

  /// Filled in by Texture(): of each curl, how far the potential's slope downward moves to the right, and
  /// that to the right upward, widths.
  std::vector<std::array<double, 2>> curls = {};
  double drift = 0;  ///< filled in by Texture(): of Gardner's first sines, radians
  Roi frame = {};    ///< filled in by Texture()
};

/// Error: 4e-5 for colours, 2e-5 * k (terms * (t0 + c_1))^2 for kGardner. Cost: tens of ns per pixel and
/// core. Throws Error for parameters outside the ranges. Sources: Gardner 1985; McReynolds et al. 1997, 11;
/// doc/maths/noise.md.
Node Texture(const ImageSpec& spec, const TextureParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_TEXTURE_H_
