// Volumes from files that OpenImageIO knows, and from stacks of slices.
#include "tessera/volume.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <new>
#include <vector>

#include "base/directory.h"
#include "base/input_file.h"
#include "base/policy.h"
#include "io/image_file.h"
#include "io/spec.h"
#include "model/volume_data.h"
#include "model/volume_makers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/export.h"
#include "tessera/io.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

PixelType TypeOf(const OIIO::TypeDesc& type) {
  if (type == OIIO::TypeDesc::UINT8) return PixelType::kUint8;
  if (type == OIIO::TypeDesc::UINT16) return PixelType::kUint16;
  if (type == OIIO::TypeDesc::HALF) return PixelType::kHalf;
  return PixelType::kFloat;
}

// The files of a numbered sequence in the order of their numbers, or the file itself. `#`s or %d, %03d stand
// for any digits.
std::vector<std::string> SlicesOf(const std::string& pattern) {
  const std::string name = fs::path(pattern).filename().string();
  const size_t first = name.find_first_of("#%");
  if (first == std::string::npos || fs::exists(pattern)) return {pattern};
  const size_t behind = name[first] == '#' ? name.find_first_not_of('#', first) : name.find('d', first) + 1;
  const std::string prefix = name.substr(0, first), suffix = behind > name.size() ? "" : name.substr(behind);
  std::map<long, std::string> slices;
  const std::string directory = base::DirectoryOf(pattern);
  for (const std::string& found : base::NamesIn(directory)) {
    if (found.size() <= prefix.size() + suffix.size() || found.compare(0, prefix.size(), prefix) != 0 ||
        found.compare(found.size() - suffix.size(), suffix.size(), suffix) != 0) {
      continue;
    }
    const std::string digits = found.substr(prefix.size(), found.size() - prefix.size() - suffix.size());
    if (digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos) continue;
    slices[std::stol(digits)] = directory + "/" + found;
  }
  if (slices.empty()) throw DataError(pattern, "no such files, expected slices numbered in their names");
  std::vector<std::string> names;
  for (const auto& [number, slice] : slices) names.push_back(slice);
  return names;
}

int PartNumber(const std::string& file, const std::string& part) {
  const std::vector<std::string> found = Subimages(file);
  std::string names;
  for (size_t i = 0; i < found.size(); ++i) {
    const std::string number = std::to_string(i);
    if (part == found[i] || part == number) return static_cast<int>(i);
    names += (i > 0 ? ", " : "") + (found[i].empty() ? number : found[i]);
  }
  throw DataError(file, "found no part \"" + part + "\", expected one of " + names);
}

// The file's part of that name or number.
std::unique_ptr<io::ImageFile> Open(const std::string& file, const std::string& part) {
  base::RequireFile(file, "a volume or an image");
  io::FileRequest request{file, {}, true};
  try {
    if (!part.empty()) request.options.subimage = PartNumber(file, part);
    return io::OpenFile(request);
  } catch (const Error& e) {
    if (fs::path(file).extension() != ".vdb" || !e.reason().starts_with("cannot be read as an image")) throw;
    throw DataError(file, "found no grid that can be read, expected one of floats");
  }
}

constexpr size_t kSlab = size_t{32} << 20;  // bytes of a volume's file that are read at once

// Lengths of a voxel's sides as a grid gives them; 1 where it does not.
Vector3 VoxelOf(const OIIO::ImageSpec& spec) {
  const auto* const m = spec.find_attribute("openvdb:indextoworld");
  Vector3 sides = {1, 1, 1};
  if (m == nullptr || m->type().basesize() * 16 != m->type().size()) return sides;
  for (int a = 0; a < 3; ++a) {
    const auto at = [&](int c) { return m->get_float_indexed(4 * a + c); };
    const double side = std::hypot(at(0), at(1), at(2));
    if (!(side > 0) || !std::isfinite(side)) return {1, 1, 1};
    sides[static_cast<size_t>(a)] = side;
  }
  return sides;
}

Volume ReadImages(const std::string& file, const VolumeFileParams& params) {
  const std::vector<std::string> files = SlicesOf(file);
  auto image = Open(files[0], params.part);
  OIIO::ImageSpec spec = image->header().spec;
  base::RequireAllowed(file, {spec.width, spec.height, std::max<int64_t>(spec.depth, std::ssize(files))},
                       spec.nchannels);
  if (params.channel < 0 || params.channel >= spec.nchannels) {
    throw DataError(file, "found " + std::to_string(spec.nchannels) + " channels, expected channel " +
                              std::to_string(params.channel));
  }
  const PixelType type = TypeOf(spec.format);
  const int channel = params.channel;
  const bool volume_file = spec.depth > 1;
  if (!volume_file && files.size() == 1) {  // slices one above the other
    ImageSpec stack(spec.width, spec.height, 1, type);
    const Image slices(stack);
    image->ReadAll(channel, channel + 1, type, slices.view().data);
    return Volume::FromImage(slices.view(), std::max(params.slices, 1), 0, params.spacing, params.memory);
  }
  int depth = volume_file ? spec.depth : static_cast<int>(files.size());
  const size_t all_rows = static_cast<size_t>(spec.height), row_samples = static_cast<size_t>(spec.width);
  // Leaves of a sparse grid reach beyond its active voxels.
  std::array<int, 3> from = {0, 0, 0};
  Vector3 spacing = params.spacing;
  const std::array<int, 3> size = {spec.width, spec.height, depth};
  if (volume_file) {
    const std::array<int64_t, 3> first = {int64_t{spec.full_x} - spec.x, int64_t{spec.full_y} - spec.y,
                                          int64_t{spec.full_z} - spec.z};
    const std::array<int, 3> full = {spec.full_width, spec.full_height, spec.full_depth};
    bool within = true;
    for (size_t a = 0; a < 3; ++a) within &= first[a] >= 0 && full[a] > 0 && full[a] <= size[a] - first[a];
    for (size_t a = 0; within && a < 3; ++a) from[a] = static_cast<int>(first[a]);
    if (within) spec.width = full[0], spec.height = full[1], depth = full[2];
    const Vector3 sides = VoxelOf(spec);
    for (size_t a = 0; a < 3; ++a) spacing[a] *= sides[a];
  }
  VolumeSpec sampled = VolumeSpec::Centred({spec.width, spec.height, depth}, type, spacing);
  sampled.memory = params.memory;
  Volume volume(sampled);
  model::VolumeData& data = *volume.data();
  const size_t pixel = PixelBytes(type), line = pixel * row_samples, plane = line * all_rows;
  // Of a volume's file a few slices at a time: it may be larger than the memory.
  const int step = image->SliceStep(), some = volume_file ? image->SlicesWithin(kSlab, plane) : 1;
  std::vector<std::byte> samples(plane * static_cast<size_t>(some));
  const auto slices = volume_file ? image->OpenSlices(channel, channel + 1, type) : nullptr;
  int front = 0, back = 0;  // the slices that `samples` holds
  for (int k = 0; k < depth; ++k) {
    if (!volume_file && k > 0) {
      image = Open(files[static_cast<size_t>(k)], params.part);
      const OIIO::ImageSpec& next = image->header().spec;
      if (next.width != spec.width || next.height != spec.height || next.nchannels <= channel) {
        throw DataError(files[static_cast<size_t>(k)],
                        "found " + std::to_string(next.width) + "x" + std::to_string(next.height) +
                            ", expected the first slice's " + std::to_string(spec.width) + "x" +
                            std::to_string(spec.height));
      }
    }
    if (!volume_file) image->ReadAll(channel, channel + 1, type, samples.data());
    if (volume_file && k + from[2] >= back) {
      front = (k + from[2]) / step * step;
      back = std::min(front + some, size[2]);
      slices->Read(front, back, samples.data());
    }
    const std::byte* const slice =
        samples.data() + (volume_file ? plane * static_cast<size_t>(k + from[2] - front) : 0);
    for (int j = 0; j < spec.height; ++j) {
      // Images have their first row on top; volume files count upward.
      const int up = volume_file ? j : spec.height - 1 - j;
      data.SetRow(up, k,
                  slice + static_cast<size_t>(j + from[1]) * line + static_cast<size_t>(from[0]) * pixel);
    }
  }
  data.FillBorder();
  return volume;
}

// What the libraries throw as an Error of the file.
Volume ReadGuarded(const std::string& file, const VolumeFileParams& params) {
  try {
    return ReadImages(file, params);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    throw DataError(file, io::OneLine(e.what()));
  }
}

}  // namespace

}  // namespace tessera

// Asked for by name by whoever links this component (cmake/component.cmake).
extern "C" {
TESSERA_API bool tessera_component_io =
    (tessera::model::TheVolumeMakers().from_images = &tessera::ReadGuarded, true);
}
