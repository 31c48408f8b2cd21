// TIFF: libtiff finds the strips or tiles; they are unpacked on every core, deflate by libdeflate, what else
// is packed by libtiff, of which every worker has the file open for itself.
#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "base/bytes.h"
#include "io/codec/chunked.h"
#include "io/codec/codec.h"
#include "io/codec/deflate.h"
#include "io/codec/per_worker.h"
#include "io/codec/tiff_rows.h"

namespace tessera::io {
namespace {

static_assert(std::endian::native == std::endian::little);

using Tiff = std::unique_ptr<TIFF, void (*)(TIFF*)>;

// What of a directory the pixels depend on; defaults are the format's.
struct Layout {
  uint32_t width = 0, height = 0, rows = UINT32_MAX, tile_width = 0;  // rows: of a strip or tile
  uint16_t compression = 0, photometric = 0, bits = 0, channels = 0, planes = 0, predictor = 1, order = 0,
           format = 0;
  bool associated = true;  // alpha, where there is one
  bool swapped = false;    // the high byte of a sample first

  bool deflated() const {
    return compression == COMPRESSION_ADOBE_DEFLATE || compression == COMPRESSION_DEFLATE;
  }
  // Without libtiff's help.
  bool plain() const {
    return !swapped && order == FILLORDER_MSB2LSB && (compression == COMPRESSION_NONE || deflated());
  }
};

Layout LayoutOf(TIFF* tiff) {
  Layout l;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &l.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &l.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_ROWSPERSTRIP, &l.rows);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &l.compression);
  if (TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &l.photometric) != 1) l.photometric = PHOTOMETRIC_MINISWHITE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &l.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &l.channels);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &l.planes);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_FILLORDER, &l.order);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &l.format);
  if (l.deflated()) TIFFGetField(tiff, TIFFTAG_PREDICTOR, &l.predictor);
  if (TIFFIsTiled(tiff) != 0) {
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &l.tile_width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &l.rows);
  }
  l.swapped = TIFFIsByteSwapped(tiff) != 0;
  uint16_t extra = 0;
  uint16_t* kinds = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_EXTRASAMPLES, &extra, &kinds) == 1) {
    for (uint16_t i = 0; i < extra; ++i) l.associated = l.associated && kinds[i] != EXTRASAMPLE_UNASSALPHA;
  }
  return l;
}

// Strips are read, not mapped: the file may shrink under us.
Tiff Open(const std::string& file, int part) {
  Tiff tiff(TIFFOpen(file.c_str(), "rm"), &TIFFClose);
  if (tiff && TIFFSetDirectory(tiff.get(), static_cast<tdir_t>(part)) != 1) tiff.reset();
  return tiff;
}

// A chunk is a strip, or a row of tiles.
class TiffDecoder final : public ChunkedDecoder {
 public:
  TiffDecoder(std::string file, int part, Tiff tiff, const OIIO::ImageSpec& spec, const Layout& layout,
              int rows, int first, int last)
      : ChunkedDecoder(spec, rows, spec.scanline_bytes()),
        file_(std::move(file)),
        part_(part),
        tiff_(std::move(tiff)),
        layout_(layout),
        first_(first),
        last_(last) {}

 private:
  struct Worker {
    Tiff tiff{nullptr, &TIFFClose};  // where libtiff unpacks
    Inflater inflater;
    base::Bytes packed, unpacked, scratch, rows;
  };

  void Prepare(int workers) override {
    workers_ = std::make_unique<PerWorker<Worker>>(workers, [this] {
      auto worker = std::make_unique<Worker>();
      if (!layout_.plain()) worker->tiff = Open(file_, part_);
      return worker;
    });
  }

  const uint8_t* Unpack(int chunk, int worker) override {
    Worker& w = workers_->Of(worker);
    const auto index = static_cast<uint32_t>(chunk);
    const size_t row = spec().scanline_bytes();
    if (layout_.tile_width == 0) return UnpackOne(index, Bytes(chunk), row, w);
    // Tiles are whole where the image is not.
    const size_t tile_row = spec().pixel_bytes() * layout_.tile_width, tile = tile_row * layout_.rows;
    const auto across = static_cast<uint32_t>((row + tile_row - 1) / tile_row);
    w.rows.resize(Bytes(chunk));
    for (uint32_t i = 0; i < across; ++i) {
      const uint8_t* from = UnpackOne(index * across + i, tile, tile_row, w);
      if (from == nullptr) return nullptr;
      const size_t left = i * tile_row;
      for (size_t at = left; at < w.rows.size(); at += row, from += tile_row)
        std::memcpy(w.rows.data() + at, from, std::min(tile_row, row - left));
    }
    return w.rows.data();
  }

  // A strip or tile of so many bytes, in rows of so many.
  const uint8_t* UnpackOne(uint32_t index, size_t size, size_t row, Worker& w) {
    if (!layout_.plain()) return UnpackByLibrary(index, size, w);
    const bool packed = layout_.deflated();
    {
      const std::lock_guard lock(mutex_);
      const uint64_t bytes = TIFFGetStrileByteCount(tiff_.get(), index);
      // What does not pack takes a little more than it was.
      if (bytes == 0 || bytes > size + size / 8 + 1024 || (!packed && bytes != size)) return nullptr;
      w.packed.resize(bytes);
      const auto count = static_cast<tmsize_t>(bytes);
      const tmsize_t got = layout_.tile_width > 0
                               ? TIFFReadRawTile(tiff_.get(), index, w.packed.data(), count)
                               : TIFFReadRawStrip(tiff_.get(), index, w.packed.data(), count);
      if (got != count) return nullptr;
    }
    if (!packed) return w.packed.data();
    w.unpacked.resize(size);
    if (!w.inflater.Zlib(w.packed, w.unpacked)) return nullptr;
    const size_t sample = spec().format.size();
    w.scratch.resize(row);
    for (size_t at = 0; at < size; at += row) {
      TiffUnpredict(static_cast<TiffPredictor>(layout_.predictor), w.unpacked.data() + at, row / sample,
                    sample, static_cast<size_t>(spec().nchannels), w.scratch.data());
    }
    return w.unpacked.data();
  }

  const uint8_t* UnpackByLibrary(uint32_t index, size_t size, Worker& w) const {
    if (!w.tiff) return nullptr;
    w.unpacked.resize(size);
    const auto count = static_cast<tmsize_t>(size);
    const tmsize_t got = layout_.tile_width > 0
                             ? TIFFReadEncodedTile(w.tiff.get(), index, w.unpacked.data(), count)
                             : TIFFReadEncodedStrip(w.tiff.get(), index, w.unpacked.data(), count);
    return got == count ? w.unpacked.data() : nullptr;
  }

  void PutRow(const uint8_t* row, std::byte* pixels, ptrdiff_t pixel_stride) const override {
    const size_t sample = spec().format.size(), pixel = spec().pixel_bytes();
    const size_t wanted = sample * static_cast<size_t>(last_ - first_);
    if (wanted == pixel && pixel_stride == static_cast<ptrdiff_t>(pixel)) {
      std::memcpy(pixels, row, spec().scanline_bytes());
      return;
    }
    row += sample * static_cast<size_t>(first_);
    for (int x = 0; x < spec().width; ++x, row += pixel, pixels += pixel_stride)
      std::memcpy(pixels, row, wanted);
  }

  const std::string file_;
  const int part_;
  Tiff tiff_;
  std::mutex mutex_;  // of tiff_
  const Layout layout_;
  const int first_, last_;
  std::unique_ptr<PerWorker<Worker>> workers_;
};

}  // namespace

Choice<Decoder> MakeTiffDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                                int last) {
  int format = SAMPLEFORMAT_UINT;
  if (spec.format == OIIO::TypeDesc::HALF || spec.format == OIIO::TypeDesc::FLOAT) {
    format = SAMPLEFORMAT_IEEEFP;
  } else if (spec.format != OIIO::TypeDesc::UINT8 && spec.format != OIIO::TypeDesc::UINT16) {
    return {nullptr, std::string("samples of the type ") + spec.format.c_str()};
  }
  Tiff tiff = Open(file, part);
  if (!tiff) return {nullptr, "libtiff does not read the header"};
  const Layout l = LayoutOf(tiff.get());
  // PackBits has no checksum, and what libtiff makes of damaged strips depends on how many rows are asked
  // for.
  if (!l.plain() && l.compression != COMPRESSION_NONE && !l.deflated() && l.compression != COMPRESSION_LZW) {
    return {nullptr,
            "the compression " + std::string(spec.get_string_attribute("compression", "of that file"))};
  }
  if (l.photometric != PHOTOMETRIC_MINISBLACK && l.photometric != PHOTOMETRIC_RGB)
    return {nullptr, "colours that are converted"};
  if (l.planes != PLANARCONFIG_CONTIG && l.channels > 1) return {nullptr, "planes of channels"};
  if (l.bits != spec.format.size() * 8 || l.format != format)
    return {nullptr, "samples of " + std::to_string(l.bits) + " bits"};
  if (!l.associated) return {nullptr, "alpha that is multiplied in"};
  const bool predicted = l.predictor == PREDICTOR_NONE ||
                         (l.predictor == PREDICTOR_HORIZONTAL && l.bits <= 16) ||
                         (l.predictor == PREDICTOR_FLOATINGPOINT && format == SAMPLEFORMAT_IEEEFP);
  if (l.plain() && !predicted) return {nullptr, "an unusual order of differences"};
  if (l.width != static_cast<uint32_t>(spec.width) || l.height != static_cast<uint32_t>(spec.height) ||
      l.channels != spec.nchannels || l.rows < 1 || spec.depth > 1) {
    return {nullptr, "not what OpenImageIO says of it"};
  }
  const bool tiled = l.tile_width > 0;
  if (tiled ? l.tile_width != static_cast<uint32_t>(spec.tile_width) ||
                  l.rows != static_cast<uint32_t>(spec.tile_height)
            : spec.tile_width > 0) {
    return {nullptr, "not what OpenImageIO says of it"};
  }
  if (tiled) {
    constexpr uint64_t kSmall = 1 << 20;
    const uint64_t tile = uint64_t{spec.pixel_bytes()} * l.tile_width * l.rows;
    if (tile > kSmall && tile / 2 > spec.scanline_bytes() * std::min(l.rows, l.height))
      return {nullptr, "tiles much larger than the image"};
  }
  const int rows = static_cast<int>(tiled ? l.rows : std::min(l.rows, l.height));
  const uint64_t down = (l.height + uint64_t{l.rows} - 1) / l.rows,
                 across = tiled ? (l.width + uint64_t{l.tile_width} - 1) / l.tile_width : 1;
  if ((tiled ? TIFFNumberOfTiles(tiff.get()) : TIFFNumberOfStrips(tiff.get())) != down * across)
    return {nullptr, "not what OpenImageIO says of it"};
  return {std::make_unique<TiffDecoder>(file, part, std::move(tiff), spec, l, rows, first, last), "",
          l.plain() ? "" : "libtiff on every core"};
}

}  // namespace tessera::io
