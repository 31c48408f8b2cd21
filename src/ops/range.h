// Numbers of parameters that have to lie in a range.
#ifndef TESSERA_OPS_RANGE_H_
#define TESSERA_OPS_RANGE_H_

#include <string>

#include "base/number_text.h"
#include "tessera/error.h"

namespace tessera::ops {

// Throws Error unless `found`, which is a number then, lies in [least, most]. `what` is said before it:
// "scale=", "a step of ".
inline void RequireRange(const std::string& op, const std::string& what, double found, double least,
                         double most) {
  if (found >= least && found <= most) return;
  throw Error(op, "found " + what + base::NumberText(found) + ", expected " + base::NumberText(least) +
                      " to " + base::NumberText(most));
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_RANGE_H_
