/// What files may ask of the program that opens them. @file
#ifndef TESSERA_POLICY_H_
#define TESSERA_POLICY_H_

#include <cstdint>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// Held against every file that is opened and every output that is written through a context
/// (Context::SetPolicy). The default lets in all that the library reads.
struct Policy {
  /// No limit.
  static constexpr int64_t kAny = INT64_MAX;

  int64_t pixels = kAny;    ///< most pixels of an image, voxels of a volume
  int64_t channels = kAny;  ///< most channels of an image
  bool listed_formats =
      false;  ///< only formats of Formats::kTrusted are read and written, whoever asks for more
  bool configs_inside =
      false;                 ///< OpenColorIO configs name files of their own folder alone, and LUTs no files
  bool output_links = true;  ///< the names of outputs may be, or lead through, symbolic links
};

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_POLICY_H_
