// The judge: the double-precision reference of a graph, and the distance of anybody's pixels from it.
#ifndef TESSERA_BENCH_ORACLE_H_
#define TESSERA_BENCH_ORACLE_H_

#include <vector>

#include "reference/reference.h"
#include "tessera/image.h"
#include "tessera/node.h"

namespace tessera::bench {

// Evaluates `node` over `roi`, operation by operation in double, nothing folded or rounded between.
// Throws Error when an operation has no reference function.
reference::ImageD Reference(const Node& node, const Roi& roi);

// True when an operation of the graph depends on a statistic of a whole image.
bool NeedsStatistics(const Node& node);

// Distances in units of the value range (1.0 = white) from the exact, unrounded result; for integer pixels
// from the exact result clamped to [0,1], so half a code is the least possible maximum of a perfect
// contestant.
struct Errors {
  double max = 0, rms = 0;
  int64_t values = 0;
  // Integer pixels: codes that differ from the correctly rounded one although the exact result is farther
  // than 2^-12 of a code from the tie, and the largest difference in codes from the correctly rounded one.
  int64_t wrong_codes = 0;
  int max_code_error = 0;
  // A NaN or infinity on one side only.
  int64_t not_finite = 0;

  // With those of another picture: the larger of both, and the sum of what is counted.
  void Add(const Errors& other);
};

// The exact results of bands of rows spread over an image (first and last rows included), computed once and
// compared with as many contestants as there are.
class Oracle {
 public:
  explicit Oracle(const Node& node, int bands = 8, int rows_per_band = 4);
  Errors Compare(const ConstImageView& pixels) const;

 private:
  std::vector<reference::ImageD> bands_;
};

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_ORACLE_H_
