// Images laid over one another: what a paste keeps. Read by its reference.
#ifndef TESSERA_MODEL_PLACEMENTS_H_
#define TESSERA_MODEL_PLACEMENTS_H_

#include <vector>

#include "tessera/image.h"
#include "tessera/ops/arrangement.h"

namespace tessera::ops {

// Input k moved by at[k], later ones upon earlier ones.
struct Placements {
  ImageSpec result;
  std::vector<Offset> at;
};

}  // namespace tessera::ops

#endif  // TESSERA_MODEL_PLACEMENTS_H_
