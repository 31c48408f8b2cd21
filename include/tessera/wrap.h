// What an image, a table or a field is taken to be beyond its edge.
#ifndef TESSERA_WRAP_H_
#define TESSERA_WRAP_H_

#include <cstdint>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// What lies beyond the edge: of an image its data window, of an axis of a table its entries. An operation
/// that has no such rule among those it names throws Error.
enum class Wrap : uint8_t {
  kBlack,        ///< zero, or the border value where an operation has one
  kClamp,        ///< the nearest pixel or entry; filters: black towards a display window that goes further
  kRepeat,       ///< the image again; tables have period 1 (kEnds: entry N - 1 stands for entry 0)
  kMirror,       ///< the image mirrored, its edge pixel shown twice; tables with kEnds: once
  kMirror101,    ///< the image mirrored, its edge pixel shown once
  kRenormalize,  ///< nothing: sums are scaled by (all weights) / (the weights inside); lines of LIC end
  kValid,    ///< not needed: the result shrinks to the pixels whose whole kernel lies inside, perhaps none
  kGlClamp,  ///< OpenGL 1.x, tables: the coordinate is clamped to [0,1], beyond the entries is the border
             ///< colour, so that a linear lookup at 0 or 1 of a kCentres table is half border
};

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_WRAP_H_
