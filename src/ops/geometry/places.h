// Pixels that change places and nothing else: the kernel of flips, quarter turns, transposes and moves.
#ifndef TESSERA_OPS_GEOMETRY_PLACES_H_
#define TESSERA_OPS_GEOMETRY_PLACES_H_

#include <cstdint>
#include <memory>

#include "graph/op.h"

namespace tessera::ops {

// Where the pixel (x, y) of a result lies in the image: at (turn ? y : x) forwards or backwards from an
// origin, and at (turn ? x : y) likewise.
struct Places {
  struct Axis {
    bool backwards = false;
    int64_t origin = 0;
    int64_t At(int64_t i) const { return backwards ? origin - i : origin + i; }
  };
  bool turn = false;  // columns become rows
  Axis x, y;          // of the image
};

// Copies pixels of any type; beyond the image lies the image once more.
std::unique_ptr<graph::TileStage> MakePlacesStage(const Places& places);

// The region of the image that a region of the result comes from, and the region of the result that one of
// the image goes to. Throws Error about `what` where that leads beyond 2^31.
Roi SourceOfPlaces(const Places& places, const Roi& out);
Roi ResultOfPlaces(const Places& places, const Roi& in, const char* what);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_PLACES_H_
