// What a solid is made of: shapes, and what is done with them. Distances are measured in short rows; within a
// ball a solid is cut down to the parts that matter there.
#ifndef TESSERA_MODEL_SOLID_NODE_H_
#define TESSERA_MODEL_SOLID_NODE_H_

#include <memory>

#include "tessera/camera.h"

namespace tessera::model {

inline constexpr int kSolidRow = 8;  // positions that are measured at once
struct SolidRow {
  int count = 0;
  double x[kSolidRow], y[kSolidRow], z[kSolidRow];
  Vector3 At(int i) const { return {x[i], y[i], z[i]}; }
};

struct Ball {
  Vector3 centre = {};
  double radius = 0;
};

class SolidNode;
using SolidPart = std::shared_ptr<const SolidNode>;

// What remains of a solid within a ball.
struct SolidWithin {
  SolidPart part;            // null: all of it
  double low = 0, high = 0;  // bounds of the distances there, errors of rounding included
};

class SolidNode {
 public:
  SolidNode() = default;
  SolidNode(const SolidNode&) = delete;
  SolidNode& operator=(const SolidNode&) = delete;
  virtual ~SolidNode() = default;
  // To distances[i] from position i of the row.
  virtual void Measure(const SolidRow& row, double* distances) const = 0;
  // The part that gives the same distances, bit for bit, everywhere in the ball.
  virtual SolidWithin Within(const Ball& ball) const = 0;
};

}  // namespace tessera::model

#endif  // TESSERA_MODEL_SOLID_NODE_H_
