// The double-precision reference run on sampled tiles of a user's own pipeline.
#ifndef TESSERA_VERIFY_H_
#define TESSERA_VERIFY_H_

#include <cstdint>
#include <string>
#include <vector>

#include "tessera/node.h"
#include "tessera/render.h"

namespace tessera {

struct VerifyOptions {
  int samples = 16;  // tiles of tile_size^2 pixels, spread over the data window, corners included
  int tile_size = 64;
  RenderOptions render;  // the evaluation that is checked runs with these
};

// Errors of the float32 result before it is packed, and, for integer types, of the packed codes.
struct VerifyReport {
  double max_error = 0, rms_error = 0;  // absolute, over all channels of the sampled pixels
  double bound = 0;                     // largest sum over the graph of the operations' bounds, same unit
  int64_t samples = 0;                  // values compared
  int64_t nan_mismatches = 0;           // NaN or infinity on one side only
  int64_t codes_wrong = 0;              // integer types: codes that differ from the rounded reference
  int max_code_error = 0;
  int64_t out_of_bound = 0;                         // values whose error is larger than their own bound
  int worst_x = 0, worst_y = 0, worst_channel = 0;  // of those, the one farthest beyond it
  bool within_bound = true;
  // What the reference cannot say by itself: where another library computes, it is that library's own float
  // evaluation, step by step, and its error is part of the bound.
  std::vector<std::string> remarks;
  std::string Summary() const;  // one line
};

// Evaluates sampled tiles with the engine and with the reference, operation by operation without fusion, and
// compares. `type` is the type the result is packed to. Throws Error as Render does.
VerifyReport Verify(const Node& node, PixelType type = PixelType::kFloat, const VerifyOptions& options = {});

}  // namespace tessera

#endif  // TESSERA_VERIFY_H_
