// How volumes are made by components above this one, each set as its library is loaded; null in a program
// without it.
#ifndef TESSERA_MODEL_VOLUME_MAKERS_H_
#define TESSERA_MODEL_VOLUME_MAKERS_H_

#include <atomic>
#include <string>

#include "tessera/export.h"
#include "tessera/mesh.h"
#include "tessera/volume.h"

TESSERA_API_BEGIN
namespace tessera::model {

struct VolumeMakers {
  // Volume files and slices that OpenImageIO reads (tessera::io).
  std::atomic<Volume (*)(const std::string& file, const VolumeFileParams& params)> from_images = nullptr;
  // DistanceField of a mesh by OpenVDB's converter (tessera::volume).
  std::atomic<Volume (*)(const Mesh& mesh, const VolumeSpec& spec, double range)> from_mesh = nullptr;
};
VolumeMakers& TheVolumeMakers();

}  // namespace tessera::model
TESSERA_API_END

#endif  // TESSERA_MODEL_VOLUME_MAKERS_H_
