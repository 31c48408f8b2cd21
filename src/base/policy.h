// The limits of a policy, held against what was found.
#ifndef TESSERA_BASE_POLICY_H_
#define TESSERA_BASE_POLICY_H_

#include <array>
#include <cstdint>
#include <string>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// Throws DataError about `subject` for an image (depth 1) or a volume of more pixels or channels than the
// default context's policy allows. Sides are below 2^31.
void RequireAllowed(const std::string& subject, const std::array<int64_t, 3>& sides, int64_t channels);

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_POLICY_H_
