// Volumes from and to files: raw samples here, all others through the component that reads them.
#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "base/input_file.h"
#include "base/number_text.h"
#include "base/policy.h"
#include "model/volume_data.h"
#include "model/volume_makers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/mesh.h"
#include "tessera/volume.h"

namespace tessera {
namespace model {

VolumeMakers& TheVolumeMakers() {
  static constinit VolumeMakers makers;
  return makers;
}

}  // namespace model

namespace {

namespace fs = std::filesystem;

Volume ReadRaw(const std::string& file, const VolumeFileParams& params) {
  const RawVolumeParams& raw = params.raw;
  const std::string samples = std::to_string(raw.size[0]) + "x" + std::to_string(raw.size[1]) + "x" +
                              std::to_string(raw.size[2]) + " samples of " + PixelTypeName(raw.type);
  if (*std::min_element(raw.size.begin(), raw.size.end()) < 1 || raw.header < 0) {
    throw Error(file, "found " + samples + " behind " + std::to_string(raw.header) +
                          " bytes, expected sides of at least 1 and a header that is not negative");
  }
  base::InputFile stream(file, "raw samples");
  const size_t pixel = PixelBytes(raw.type), row = pixel * static_cast<size_t>(raw.size[0]);
  // May be beyond 2^64.
  const double wanted = static_cast<double>(raw.header) +
                        static_cast<double>(row) * static_cast<double>(raw.size[1]) * raw.size[2];
  if (static_cast<double>(stream.size()) < wanted) {
    throw DataError(file, "found " + std::to_string(stream.size()) + " bytes, expected " +
                              base::NumberText(wanted) + " for " + samples);
  }
  base::RequireAllowed(file, {raw.size[0], raw.size[1], raw.size[2]}, 1);
  // Now that the file is known to fill it.
  VolumeSpec spec = VolumeSpec::Centred(raw.size, raw.type, params.spacing);
  spec.memory = params.memory;
  Volume volume(spec);
  model::VolumeData& data = *volume.data();
  stream.seekg(raw.header);
  const bool swap = raw.big_endian != (std::endian::native == std::endian::big) && pixel > 1;
  std::vector<std::byte> line(row);
  for (int k = 0; k < raw.size[2]; ++k) {
    for (int j = 0; j < raw.size[1]; ++j) {
      if (!stream.read(reinterpret_cast<char*>(line.data()), static_cast<std::streamsize>(row))) {
        throw DataError(file, "ends in slice " + std::to_string(k) + " of " + std::to_string(raw.size[2]));
      }
      if (swap) {
        for (size_t i = 0; i < row; i += pixel) std::reverse(line.begin() + i, line.begin() + i + pixel);
      }
      if (raw.is_signed && raw.type == PixelType::kUint16) {
        for (size_t i = 0; i < row; i += 2) {
          uint16_t v;
          std::memcpy(&v, &line[i], 2);
          v = static_cast<uint16_t>(v ^ 0x8000u);
          std::memcpy(&line[i], &v, 2);
        }
      }
      data.SetRow(j, k, line.data());
    }
  }
  data.FillBorder();
  return volume;
}

}  // namespace

Volume ReadVolume(const std::string& file, const VolumeFileParams& params) {
  const bool raw = params.raw.size[0] > 0 || params.raw.size[1] > 0 || params.raw.size[2] > 0;
  if (raw) return ReadRaw(file, params);
  const auto read = model::TheVolumeMakers().from_images.load();
  if (read == nullptr) {
    throw Error(file,
                "found a program without the component tessera::io, expected it to read volumes other "
                "than raw samples (those need their size)");
  }
  return read(file, params);
}

void WriteRawVolume(const Volume& volume, const std::string& file) {
  const model::VolumeData& data = *volume.data();
  const VolumeSpec& spec = volume.spec();
  std::ofstream stream(file, std::ios::binary);
  const size_t pixel = PixelBytes(spec.type);
  std::vector<std::byte> row(pixel * static_cast<size_t>(spec.size[0]));
  for (int k = 0; k < spec.size[2] && stream; ++k) {
    for (int j = 0; j < spec.size[1]; ++j) {
      data.CopyRow(0, spec.size[0], j, k, row.data());
      stream.write(reinterpret_cast<const char*>(row.data()), static_cast<std::streamsize>(row.size()));
    }
    data.Trim();
  }
  stream.close();
  if (!stream) throw SystemError(file, "cannot be written");
}

bool HasMeshConverter() { return model::TheVolumeMakers().from_mesh != nullptr; }

Volume DistanceField(const Mesh& mesh, const VolumeSpec& spec, double range) {
  const auto convert = model::TheVolumeMakers().from_mesh.load();
  if (convert == nullptr) {
    throw Error("mesh",
                "found a program without the component tessera::volume (OpenVDB), expected it to make "
                "distance fields of meshes");
  }
  return convert(mesh, spec, range);
}

}  // namespace tessera
