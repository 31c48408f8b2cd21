/// The double-precision reference run on sampled tiles of a user's own pipeline, against the pixels it got.
/// In a library of its own: link tessera::verify beside tessera::tessera. @file
#ifndef TESSERA_VERIFY_H_
#define TESSERA_VERIFY_H_

#include <cstdint>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/render.h"
#include "tessera/stored.h"

TESSERA_API_BEGIN
namespace tessera {

/// How much of a picture is checked.
struct VerifyOptions {
  int samples = 16;      ///< tiles of tile_size^2 pixels, spread over the data window, corners included
  int tile_size = 64;    ///< pixels along a tile's side
  RenderOptions render;  ///< where Verify evaluates: the evaluation that is checked

  /// The reference takes at most `seconds`, or ten times `run_seconds`, what the run itself took, whichever
  /// is longer: tiles become fewer and smaller. Verify measures its own run. The first tile may take
  /// `first_seconds` all the same; then Verify throws Error.
  double seconds = 2;         ///< budget of the reference
  double run_seconds = 0;     ///< what the run took
  double first_seconds = 60;  ///< of the first tile's reference
};

/// Errors of stored values against the exact result. Of integers and halves they include the rounding to the
/// type. Values are not finite, undecided, right, or out of bound.
struct VerifyReport {
  double max_error = 0;  ///< largest, absolute, over the decided values
  double rms_error = 0;  ///< root mean square over the decided values

  /// What values may be off by, rounding included: the one whose error is the largest part of its own bound,
  /// and the largest of all.
  double bound = 0;          ///< of the value whose error is the largest part of its own
  double largest_bound = 0;  ///< of all values

  /// That part, and of those float values that are not exact, how many times its error the bound of the
  /// middle one is.
  double closest = 0;
  double median_ratio = 0;     ///< bound over error, the middle one
  int64_t samples = 0;         ///< values compared
  double share = 0;            ///< of all pixels, those that were looked at
  int64_t undecided = 0;       ///< values that hang on a decision within its own error: not judged
  int64_t nan_mismatches = 0;  ///< NaN or infinity on one side only

  /// Integers and halves: codes other than the rounded reference's where the bound reaches the tie between
  /// the two, which is right, and where it does not.
  int64_t codes_at_tie = 0;  ///< within the bound of a tie: right
  int64_t codes_wrong = 0;   ///< beyond it
  int max_code_error = 0;    ///< of both, in codes
  int64_t out_of_bound = 0;  ///< values whose error is larger than their own bound
  int worst_x = 0;           ///< pixel of the value farthest beyond its bound
  int worst_y = 0;           ///< pixel of the value farthest beyond its bound
  int worst_channel = 0;     ///< channel of that value
  bool within_bound = true;  ///< no value is out of bound

  /// What the reference cannot say by itself: where another library computes, it is that library's own float
  /// evaluation, step by step, and its error is part of the bound. And how the pixels were looked at.
  std::vector<std::string> remarks;
  std::string Summary() const;  ///< one line
};

/// Evaluates the whole result as Render does, and compares it with the reference on sampled tiles: operation
/// by operation without fusion. A value's bound is made of the operations' own bounds and of what errors of
/// their inputs make of their results: how these respond to inputs moved by their bounds. Where a response is
/// a jump (a test, a hit or a miss, a nearest entry) the value is undecided. `type` is the type the result is
/// packed to; codes are compared with the reference rounded to it. Throws Error as Render does.
VerifyReport Verify(const Node& node, PixelType type = PixelType::kFloat, const VerifyOptions& options = {});

/// The same for pixels that the caller has: all or a part of the node's data window, every channel.
VerifyReport VerifyStored(const Node& node, const ConstImageView& stored, const VerifyOptions& options = {});
/// And for pixels that are read back, such as PendingOutput::ReadBack's.
VerifyReport VerifyStored(const Node& node, const StoredPixels& stored, const VerifyOptions& options = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_VERIFY_H_
