// An environment map made ready for lookups: its faces as RGBA with a border of texels from across their
// seams.
#ifndef TESSERA_OPS_ENVIRONMENT_ATLAS_H_
#define TESSERA_OPS_ENVIRONMENT_ATLAS_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "base/stage.h"
#include "ops/environment/projection.h"
#include "tessera/image.h"

namespace tessera::ops {

// Face f, padded texel (i, j) with 0 <= i < stride, 0 <= j < rows is at pixels() + 4 ((f rows + j) stride +
// i); the face's own texel (i, j) is the padded one at (i + 1, j + 1). Lat-long maps have the mean of their
// first (last) row all along the first (last) padded row, which stands for the pole itself.
class EnvironmentAtlas {
 public:
  // Channels first, first + 1, ... of a float, dense picture; missing ones are 0.
  EnvironmentAtlas(const ConstImageView& picture, int first, const MapLayout& layout,
                   const graph::Workers& workers);

  const MapLayout& layout() const { return layout_; }
  int stride() const { return layout_.width + 2; }
  int rows() const { return layout_.height + 2; }
  const float* pixels() const { return reinterpret_cast<const float*>(memory_.get()); }
  const float* At(int face, int i, int j) const {
    return const_cast<EnvironmentAtlas*>(this)->Texel(face, i, j);
  }
  bool finite() const { return finite_; }  // every texel that may be read is a number
  // Lat-long maps whose every texel is a half float may be held as such, in the same order: half the memory
  // to look up in. The padded rows' means are no half floats: rows 0, 1, h and h + 1 are floats, at pole().
  // `convert` rounds floats to half and says whether that changed none.
  using ToHalf = bool (*)(const float* from, int count, uint16_t* to);
  void HoldHalves(ToHalf convert, const graph::Workers& workers);
  const uint16_t* halves() const { return reinterpret_cast<const uint16_t*>(halves_.get()); }  // or null
  const float* pole(bool last) const { return poles_.data() + (last ? ptrdiff_t{8} * stride() : 0); }
  const float* rim() const { return rim_; }  // kSphere: the mean along the rim

 private:
  float* Texel(int face, int i, int j) {  // of the face; -1 and `width` are its border
    return reinterpret_cast<float*>(memory_.get()) +
           4 * ((ptrdiff_t{face} * rows() + j + 1) * stride() + i + 1);
  }
  void FillLatLong();
  void FillSphere();
  void FillParabolic();
  void FillCube();
  void FillOctahedral();
  void FillLens();
  void ExtendEdges(int face);
  void JoinEnds();  // left and right, of a whole turn

  MapLayout layout_;
  std::shared_ptr<std::byte> memory_, halves_;
  std::vector<float> poles_;
  bool finite_ = true;
  float rim_[4] = {};
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_ATLAS_H_
