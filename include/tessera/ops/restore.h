/// Noise and bands taken away, edges kept; levels found by the picture itself. @file
#ifndef TESSERA_OPS_RESTORE_H_
#define TESSERA_OPS_RESTORE_H_

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/wrap.h"

TESSERA_API_BEGIN
namespace tessera {

/// Weights are found from the first three channels that are not alpha, the colours, in common, and mix every
/// channel, alpha too. u = 2^-24. Formulas and sources: doc/maths/restore.md. @file

/// The mean of what lies within ceil(2 sigma) pixels both ways, weighted by exp(-r^2 / (2 sigma^2) - d^2 / (2
/// range^2)), r the distance in pixels and d that of the colours (root of the sum of squares); weights below
/// 2^-100 are none. A colour that is not finite has no weight elsewhere and stays where it is; in other
/// channels it spreads as far as it has weight. Flat images keep their bits. Cost grows with sigma^2. |error|
/// <= 2 u
/// (|result| + M), M the weighted mean of |difference from the centre| (2 ceil(2 sigma) + 9 + 8 e), e the
/// weight's logarithm to base 2. Error unless sigma is in [0.1, 20] and range in [1e-6, 1e6].
struct BilateralParams {
  double sigma = 3;          ///< pixels
  double range = 0.1;        ///< of colours
  Wrap wrap = Wrap::kClamp;  ///< what lies beyond the image: kClamp, kBlack, kRepeat, kMirror or kMirror101
};
/// A bilateral filter, as BilateralParams says (Tomasi and Manduchi 1998).
Node Bilateral(const Node& image, const BilateralParams& params = {});

/// The mean of the pixels of a square of `search` pixels about each, weighted by exp(-max(D - 2 sigma^2, 0) /
/// (strength sigma)^2), D the mean squared difference of the colours of two squares of `patch` pixels, one
/// about either. What is not finite as with Bilateral, for all pixels whose patch it lies in. Flat images
/// keep their bits. Cost grows with search^2. |error| <= 2 u (|result| + M), M as with Bilateral, of (2
/// search + 9 + (9 + 2 patch) (e + 3 / strength^2)). Error unless sigma is in [1e-6, 1e6], strength in [0.1,
/// 10], and patch and search are odd, in [1, 15] and [3, 63].
struct NonLocalMeansParams {
  double sigma = 0.05;       ///< standard deviation of the noise, of a channel
  double strength = 0.6;     ///< how unlike patches may be, in sigma
  int patch = 5;             ///< pixels
  int search = 15;           ///< pixels
  Wrap wrap = Wrap::kClamp;  ///< what lies beyond the image, as Bilateral
};
/// Non-local means, as NonLocalMeansParams says (Buades, Coll and Morel 2005).
Node NonLocalMeans(const Node& image, const NonLocalMeansParams& params = {});

/// Steps of a gradient smoothed: the mean of a square of 2 radius + 1 pixels in place of the sample, where
/// the samples of that square differ by `threshold` / 2 at most, and less and less of it until they differ by
/// `threshold`. Every channel for itself, alpha is left alone. Made of other operations. Error unless radius
/// is in [1, 127] and threshold in [1e-6, 1e6].
struct DebandParams {
  int radius = 16;           ///< pixels
  double threshold = 0.012;  ///< three codes of eight bits
};
/// Bands taken away, as DebandParams says.
Node Deband(const Node& image, const DebandParams& params = {});

/// (x - black) / (white - black) of the colours: black is the finite sample of rank floor(low (n - 1)) from
/// below, white that of floor(high (n - 1)) from above, of all colours together or, `apart`, of each channel.
/// Where both are equal, and in other channels, bits stay. Error unless low and high are in [0, 0.49].
/// |error| <= 2 u |result|. The image is held in memory whole, and once more its samples.
struct AutoLevelsParams {
  double low = 0.001;   ///< share of the samples that become black
  double high = 0.001;  ///< share of the samples that become white
  bool apart = false;   ///< every channel by its own
  bool clamp = true;    ///< to [0, 1]
};
/// Levels by the picture's own range, as AutoLevelsParams says.
Node AutoLevels(const Node& image, const AutoLevelsParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_RESTORE_H_
