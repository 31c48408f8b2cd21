// Reference of opacity volumes: what of a light reaches a point through a medium.
#ifndef TESSERA_REFERENCE_VOLUME_OPACITY_H_
#define TESSERA_REFERENCE_VOLUME_OPACITY_H_

#include <vector>

#include "model/volume_settings.h"
#include "reference/volume_substance.h"

namespace tessera::reference {

class OpacityVolume {
 public:
  // Of a light as of VolumeLight, without its colour.
  OpacityVolume(const ops::volume::VolumeDraw& draw, const Substance& substance, const Vector3& light,
                bool point)
      : p_(draw.params),
        v_(draw.volume.spec()),
        size_(draw.nodes),
        substance_(substance),
        light_(light),
        point_(point) {}
  OpacityVolume(const OpacityVolume&) = delete;

  struct Share {
    double through = 1, off = 0;  // off: what a march by floats may be off by
  };
  // Of the opacity volume, which is filled where it is asked for: by one thread at a time.
  Share At(const Vector3& p) const;
  // Of a march from p itself: what the opacity volume stands for. `skew` is Substance's.
  double Through(const Vector3& p, double skew = 0) const;

 private:
  const Share& Node(int x, int y, int z) const;

  const VolumeParams& p_;
  const VolumeSpec& v_;
  const std::array<int, 3>& size_;
  const Substance& substance_;
  const Vector3 light_;
  const bool point_;
  mutable std::vector<Share> nodes_;  // off < 0: not known yet
};

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_VOLUME_OPACITY_H_
