// An image in a file as its reader has it: opened in this process, or in one that may do nothing else
// (sandbox/), as the policy has it.
#ifndef TESSERA_IO_IMAGE_FILE_H_
#define TESSERA_IO_IMAGE_FILE_H_

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "graph/source.h"
#include "tessera/io.h"

namespace tessera::io {

struct FileRequest {
  std::string file;
  ReadOptions options;
  bool sparse = false;  // an OpenVDB grid may declare as much as it likes
};

struct FileHeader {
  std::string format;    // OpenImageIO's name
  OIIO::ImageSpec spec;  // checked, divided
  int subimage = 0;      // that was chosen
  int divisor = 1;       // of a JPEG's sides
};

// Some of an image's channels, slices at a time. Not for several threads at once.
class SliceReader {
 public:
  virtual ~SliceReader() = default;
  // Slices [z0, z1), counted from 0, packed one after the other; z0 is a multiple of SliceStep. Throws Error.
  virtual void Read(int z0, int z1, std::byte* data) = 0;
};

class ImageFile {
 public:
  virtual ~ImageFile() = default;
  const FileHeader& header() const { return header_; }
  // As graph::PixelSource; rows are of StorageType.
  virtual std::unique_ptr<graph::RowReader> Open(int first, int last) const = 0;
  virtual std::string Decoder() const = 0;
  virtual std::unique_ptr<SliceReader> OpenSlices(int first, int last, PixelType type) const = 0;

  // All pixels of channels [first, last), packed, slice after slice.
  void ReadAll(int first, int last, PixelType type, std::byte* data) const {
    OpenSlices(first, last, type)->Read(0, Slices(), data);
  }
  int Slices() const { return std::max(header_.spec.depth, 1); }
  // Slices that are read at once, at least: the depth of a tile.
  int SliceStep() const {
    return header_.spec.tile_height > 0 ? std::clamp(header_.spec.tile_depth, 1, Slices()) : 1;
  }
  // As many slices of so many bytes as `most` bytes hold, in whole steps, one at least.
  int SlicesWithin(size_t most, size_t slice) const {
    const auto step = static_cast<size_t>(SliceStep());
    const size_t slices = std::max<size_t>(most / (slice * step), 1) * step;
    return static_cast<int>(std::min(slices, static_cast<size_t>(Slices())));
  }

 protected:
  FileHeader header_;
};

// Throws Error naming the file.
std::unique_ptr<ImageFile> OpenFile(const FileRequest& request);
std::unique_ptr<ImageFile> OpenFileHere(const FileRequest& request);
std::vector<std::string> PartNamesHere(const std::string& file, Formats formats);

// The same in a process of its own.
std::unique_ptr<ImageFile> OpenFileApart(const FileRequest& request);
std::vector<std::string> PartNamesApart(const std::string& file, Formats formats);

}  // namespace tessera::io

#endif  // TESSERA_IO_IMAGE_FILE_H_
