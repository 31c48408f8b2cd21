// The affine operation: scale and bias per channel or a 4x5 colour matrix, then limits. Everything that is
// one of these is made here, so that neighbours fold into one.
#ifndef TESSERA_OPS_COLOR_AFFINE_H_
#define TESSERA_OPS_COLOR_AFFINE_H_

#include <any>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "graph/op.h"

namespace tessera::ops {

// Which channels a result may depend on; NaN and infinity spread by weights but 0. Folding takes the larger.
enum class AffineClass : uint8_t {
  kDiagonal,  // each channel on itself alone
  kRgb,       // R, G, B on R, G, B; alpha on itself alone
  kFull,      // everything on R, G, B and alpha
};

inline constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// Limits of one channel; infinite where there is none. A limit wins over NaN: the lower one, where there is
// none the upper one. A channel without limits keeps its NaN.
struct Limits {
  double low = -kNoLimit, high = kNoLimit;
  double nan = std::numeric_limits<double>::quiet_NaN();  // what NaN becomes; set by MakeLimits

  bool any() const { return low != -kNoLimit || high != kNoLimit; }
  friend bool operator==(const Limits& a, const Limits& b) {
    return a.low == b.low && a.high == b.high && (a.nan == b.nan || (a.nan != a.nan && b.nan != b.nan));
  }
};
Limits MakeLimits(double low, double high);

struct AffineParams {
  int channels = 0;  // of the image it is applied to: node.spec().channel_count()
  int alpha = -1;    // node.spec().alpha

  AffineClass structure = AffineClass::kDiagonal;
  // kDiagonal: one per channel of the image; v' = scale v + bias. Empty means all 1 (all 0).
  std::vector<double> scale, bias;
  // Other classes: (R,G,B,A)' = matrix (R,G,B,A,1), rows of five; a missing alpha reads as 1 and is not
  // written.
  double matrix[4][5] = {{1, 0, 0, 0, 0}, {0, 1, 0, 0, 0}, {0, 0, 1, 0, 0}, {0, 0, 0, 1, 0}};
  // Applied last: one per channel (kDiagonal), or of R, G, B, A (other classes). Empty means none.
  std::vector<Limits> limits;
};

// The operation `name`, whose Parameters() are the caller's public struct. It folds with its neighbours; the
// result is called "affine".
std::shared_ptr<const graph::Op> MakeAffine(std::string name, AffineParams affine, std::any parameters);

// The stage alone, for operations that learn their coefficients from another image.
std::unique_ptr<graph::PointStage> MakeAffineStage(AffineClass structure, const double (&matrix)[4][5],
                                                   const Limits (&limits)[4]);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_COLOR_AFFINE_H_
