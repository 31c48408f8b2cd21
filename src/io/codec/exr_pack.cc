// Zip by libdeflate, none, and all others by OpenEXR.
#include "io/codec/exr_pack.h"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

#include "io/codec/deflate.h"
#include "io/codec/exr_header.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t kHead = 2 * sizeof(int32_t);  // y, and the bytes behind it

class OwnPacker final : public ExrPacker {
 public:
  OwnPacker(const OIIO::ImageSpec& spec, ExrPlaces places, size_t chunk_rows, int level)
      : places_(std::move(places)),
        chunk_rows_(chunk_rows),
        sample_(spec.format.size()),
        width_(static_cast<size_t>(spec.width)),
        pixel_(spec.pixel_bytes(true)) {
    if (level > 0) deflater_ = std::make_unique<Deflater>(level);
  }

  void Pack(std::span<const uint8_t* const> rows, int y, ExrChunks& chunks) override {
    for (size_t top = 0; top < rows.size(); top += chunk_rows_) {
      const auto part = rows.subspan(top, std::min(chunk_rows_, rows.size() - top));
      PackChunk(part, y + static_cast<int>(top), chunks);
    }
  }

 private:
  void PackChunk(std::span<const uint8_t* const> rows, int y, ExrChunks& chunks) {
    const size_t row = pixel_ * width_, size = row * rows.size(), before = chunks.used;
    if (deflater_) {
      rows_.resize(size);
      Order(rows, rows_.data());
      scrambled_.resize(size);
      ExrZipOrder(rows_, scrambled_.data());
      packed_.clear();
      deflater_->Zlib(scrambled_, packed_);
    }
    const bool packs = deflater_ && packed_.size() < size;
    const base::Bytes& best = packs ? packed_ : rows_;
    const size_t count = packs ? packed_.size() : size;
    uint8_t* const to = chunks.Grow(kHead + count);
    const int32_t head[2] = {y, static_cast<int32_t>(count)};
    std::memcpy(to, head, sizeof head);
    if (deflater_) {
      std::memcpy(to + kHead, best.data(), count);
    } else {
      Order(rows, to + kHead);
    }
    chunks.sizes.push_back(chunks.used - before);
  }

  void Order(std::span<const uint8_t* const> rows, uint8_t* to) const {
    for (size_t y = 0; y < rows.size(); ++y) {
      PixelsToExrRow(reinterpret_cast<const std::byte*>(rows[y]), static_cast<ptrdiff_t>(pixel_), places_,
                     sample_, width_, to + y * pixel_ * width_);
    }
  }

  const ExrPlaces places_;
  const size_t chunk_rows_, sample_, width_, pixel_;
  std::unique_ptr<Deflater> deflater_;
  base::Bytes rows_, scrambled_, packed_;
};

class LibraryPacker final : public ExrPacker {
 public:
  LibraryPacker(const OIIO::ImageSpec& spec, const OIIO::ImageSpec& asked, size_t chunk_rows)
      : spec_(spec), chunk_rows_(chunk_rows) {
    // Of the rest nothing matters to the pixels.
    OIIO::ParamValueList kept;
    for (const char* const name : {"compression", "openexr:dwaCompressionLevel"}) {
      if (const auto* value = asked.find_attribute(name)) kept.push_back(*value);
    }
    spec_.extra_attribs = kept;
    spec_.full_x = spec_.x, spec_.full_width = spec_.width;
  }

  void Pack(std::span<const uint8_t* const> rows, int y, ExrChunks& chunks) override {
    const size_t row = spec_.scanline_bytes(true);
    pixels_.resize(row * rows.size());
    for (size_t i = 0; i < rows.size(); ++i) std::memcpy(pixels_.data() + i * row, rows[i], row);
    spec_.y = spec_.full_y = y;
    spec_.height = spec_.full_height = static_cast<int>(rows.size());
    const size_t first = WriteFile((rows.size() + chunk_rows_ - 1) / chunk_rows_);
    for (size_t at = first; at < file_.size(); at += chunks.sizes.back()) {
      int32_t head[2] = {};
      if (file_.size() - at >= kHead) std::memcpy(head, file_.data() + at, kHead);
      if (head[1] <= 0 || static_cast<size_t>(head[1]) > file_.size() - at - kHead)
        Fail("wrote chunks that are none");
      chunks.sizes.push_back(kHead + static_cast<size_t>(head[1]));
    }
    std::memcpy(chunks.Grow(file_.size() - first), file_.data() + first, file_.size() - first);
  }

 private:
  [[noreturn]] static void Fail(const std::string& reason) { throw SystemError("OpenEXR", reason); }

  // Fills file_; where its first chunk begins.
  size_t WriteFile(size_t chunks) {
    file_.clear();
    OIIO::Filesystem::IOVecOutput memory(file_);
    const auto output = OIIO::ImageOutput::create("exr");
    if (!output) Fail("is not there");
    output->set_ioproxy(&memory);
    const bool ok =
        output->open("chunks.exr", spec_) &&
        output->write_scanlines(spec_.y, spec_.y + spec_.height, 0, spec_.format, pixels_.data()) &&
        output->close();
    if (!ok) Fail(output->geterror());
    ExrHeader header;
    if (!ParseExrHeader(file_, header)) Fail("wrote another header than for the whole image");
    const size_t first = header.end + chunks * sizeof(uint64_t);
    if (first >= file_.size()) Fail("wrote no chunks");
    return first;
  }

  OIIO::ImageSpec spec_;
  const size_t chunk_rows_;
  base::Bytes pixels_;
  std::vector<unsigned char> file_;
};

}  // namespace

std::unique_ptr<ExrPacker> MakeExrPacker(const OIIO::ImageSpec& spec, const ExrPlaces& places,
                                         size_t chunk_rows, int level) {
  return std::make_unique<OwnPacker>(spec, places, chunk_rows, level);
}

std::unique_ptr<ExrPacker> MakeExrLibraryPacker(const OIIO::ImageSpec& spec, const OIIO::ImageSpec& asked,
                                                size_t chunk_rows) {
  return std::make_unique<LibraryPacker>(spec, asked, chunk_rows);
}

}  // namespace tessera::io
