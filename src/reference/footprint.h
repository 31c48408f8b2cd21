// Look-ups over footprints by their definition: mip levels made when they are asked for, ellipses by angles.
#ifndef TESSERA_REFERENCE_FOOTPRINT_H_
#define TESSERA_REFERENCE_FOOTPRINT_H_

#include <map>
#include <utility>
#include <vector>

#include "reference/reference.h"
#include "tessera/wrap.h"

namespace tessera::reference {

// Where a result pixel looks (a pixel's centre is its index), the derivatives of that by the result's two
// coordinates, and what doubles in another order may be off by.
struct FootprintPlace {
  double x, y, x_by_x, y_by_x, x_by_y, y_by_y, off_x = 0, off_y = 0;
};

class Footprints {
 public:
  Footprints(const Call& call, const Roi& window, Wrap wrap, bool ewa, int anisotropy);
  // Value, scale and decisions of a result pixel.
  void Put(int x, int y, const FootprintPlace& place);

 private:
  struct Axis {
    std::vector<int> count;
    std::vector<double> cell;
  };
  // Of every channel: value, mean magnitude.
  using Sample = std::vector<std::pair<double, double>>;
  struct Looked {
    std::vector<double> value, largest;
    double share = 1;        // of the bound
    bool undecided = false;  // something that is no number may count or not
  };

  Axis Levels(int size, int levels) const;
  static void Overlap(const Axis& axis, int level, int i, Wrap wrap,
                      std::vector<std::pair<int, double>>* taps);
  const Sample& Level(int level, int i, int j);
  double Cell(size_t level) const { return std::max(x_.cell[level], y_.cell[level]); }
  Looked Look(const FootprintPlace& place, int more);
  void Bilinear(int level, double x, double y, double weight, Looked* to);
  void Ellipse(int level, const FootprintPlace& place, double weight, Looked* to);
  void Add(const Sample& sample, double weight, double share, Looked* to) const;

  const Call& call_;
  Roi window_;
  Wrap wrap_;
  bool ewa_;
  double anisotropy_;
  Axis x_, y_;
  std::vector<std::map<std::pair<int, int>, Sample>> made_;
};

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_FOOTPRINT_H_
