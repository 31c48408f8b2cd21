/// What an evaluation is going to take, found by trying small parts of it. @file
#ifndef TESSERA_COST_H_
#define TESSERA_COST_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/render.h"

TESSERA_API_BEGIN
namespace tessera {

/// The expected cost of one evaluation, on this machine and at this moment.
struct CostEstimate {
  /// Something that the evaluation does.
  struct Part {
    std::string name;    ///< "decode FILE", "prepare", "compute", an operation on whole images, "encode FILE"
    double elapsed = 0;  ///< seconds of the clock, were it alone
    double busy = 0;     ///< seconds of all threads together
    int pass = 0;        ///< parts of one pass overlap; passes follow each other
  };
  std::vector<Part> parts;  ///< in order
  int threads = 0;          ///< that the evaluation may use
  int64_t pixels = 0;       ///< of the result
  int64_t bytes = 0;        ///< read from sources and written, of the last pass
  size_t memory = 0;        ///< bytes: whole images that are held and rows on their way
  Image band;  ///< rows from the middle of the result, as computed from the first rows of its files

  /// Seconds of the clock: of each pass those of its longest part, or what its parts take of all threads
  /// together.
  double Seconds() const;
  /// The name of the longest part.
  std::string Limit() const;
};

/// Tries the graph: reads the first rows of every file (a million pixels at most), computes some rows of the
/// result, and operations on whole images on the middle of theirs, and takes the rest to cost as much by the
/// pixel. Nothing is encoded: who writes a file adds a part to the last pass, found with `band`. Costs a
/// tenth of a second to a second, more where less than that cannot be tried. What data decide (paths of
/// light, lengths of lines) is expected to be in the rest as it is in those rows. Throws Error as Render
/// does.
CostEstimate EstimateCost(const Node& node, PixelType type = PixelType::kFloat,
                          const RenderOptions& options = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_COST_H_
