/// What files may ask of the program that opens them. @file
#ifndef TESSERA_POLICY_H_
#define TESSERA_POLICY_H_

#include <cstdint>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// Which image files are read by a process of their own, which may read that file and nothing else
/// (tessera/sandbox.h): a crash, a hang or worse is an error of the file then.
enum class Sandbox : uint8_t {
  kOff,       ///< none
  kUnlisted,  ///< those of formats that are none of Formats::kTrusted
  kAll,       ///< all, volumes that are images included
};

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

  Sandbox sandbox = Sandbox::kOff;           ///< who reads images; StartSandbox comes first
  int64_t reader_memory = int64_t{1} << 32;  ///< most bytes that such a process takes
  double reader_seconds = 1e9;               ///< longest that it is waited for, for a header or some rows
};

/// What `tessera --safe` starts from, for files that come from strangers.
constexpr Policy SafePolicy() {
  Policy policy;
  policy.pixels = int64_t{1} << 28, policy.channels = 64;
  policy.listed_formats = policy.configs_inside = true;
  policy.output_links = false;
  policy.sandbox = Sandbox::kAll;
  policy.reader_seconds = 300;
  return policy;
}

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_POLICY_H_
