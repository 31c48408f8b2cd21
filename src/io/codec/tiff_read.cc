// TIFF: libtiff finds the strips; they are unpacked by libdeflate on every core.
#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

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
  uint32_t width = 0, height = 0, rows = UINT32_MAX;
  uint16_t compression = 0, photometric = 0, bits = 0, channels = 0, planes = 0, predictor = 1, order = 0,
           format = 0;
  bool associated = true;  // alpha, where there is one
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
  if (l.compression == COMPRESSION_ADOBE_DEFLATE || l.compression == COMPRESSION_DEFLATE)
    TIFFGetField(tiff, TIFFTAG_PREDICTOR, &l.predictor);
  uint16_t extra = 0;
  uint16_t* kinds = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_EXTRASAMPLES, &extra, &kinds) == 1) {
    for (uint16_t i = 0; i < extra; ++i) l.associated = l.associated && kinds[i] != EXTRASAMPLE_UNASSALPHA;
  }
  return l;
}

class TiffDecoder final : public ChunkedDecoder {
 public:
  TiffDecoder(Tiff tiff, const OIIO::ImageSpec& spec, const Layout& layout, int rows, int first, int last)
      : ChunkedDecoder(spec, rows, spec.scanline_bytes()),
        tiff_(std::move(tiff)),
        packed_(layout.compression != COMPRESSION_NONE),
        predictor_(static_cast<TiffPredictor>(layout.predictor)),
        first_(first),
        last_(last) {}

 private:
  struct Worker {
    Inflater inflater;
    std::vector<uint8_t> packed, rows, scratch;
  };

  void Prepare(int workers) override {
    workers_ = std::make_unique<PerWorker<Worker>>(workers, [] { return std::make_unique<Worker>(); });
  }

  const uint8_t* Unpack(int chunk, int worker) override {
    Worker& w = workers_->Of(worker);
    const size_t size = Bytes(chunk);
    {
      const std::lock_guard lock(mutex_);
      const uint64_t bytes = TIFFGetStrileByteCount(tiff_.get(), static_cast<uint32_t>(chunk));
      // What does not pack takes a little more than it was.
      if (bytes == 0 || bytes > size + size / 8 + 1024 || (!packed_ && bytes != size)) return nullptr;
      w.packed.resize(bytes);
      if (TIFFReadRawStrip(tiff_.get(), static_cast<uint32_t>(chunk), w.packed.data(),
                           static_cast<tmsize_t>(bytes)) != static_cast<tmsize_t>(bytes)) {
        return nullptr;
      }
    }
    if (!packed_) return w.packed.data();
    w.rows.resize(size);
    if (!w.inflater.Zlib(w.packed, w.rows)) return nullptr;
    const size_t row = spec().scanline_bytes(), sample = spec().format.size();
    w.scratch.resize(row);
    for (size_t at = 0; at < size; at += row) {
      TiffUnpredict(predictor_, w.rows.data() + at, row / sample, sample,
                    static_cast<size_t>(spec().nchannels), w.scratch.data());
    }
    return w.rows.data();
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

  Tiff tiff_;
  std::mutex mutex_;  // of tiff_
  const bool packed_;
  const TiffPredictor predictor_;
  const int first_, last_;
  std::unique_ptr<PerWorker<Worker>> workers_;
};

}  // namespace

Choice<Decoder> MakeTiffDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                                int last) {
  if (spec.tile_width > 0) return {nullptr, "tiles"};
  int format = SAMPLEFORMAT_UINT;
  if (spec.format == OIIO::TypeDesc::HALF || spec.format == OIIO::TypeDesc::FLOAT) {
    format = SAMPLEFORMAT_IEEEFP;
  } else if (spec.format != OIIO::TypeDesc::UINT8 && spec.format != OIIO::TypeDesc::UINT16) {
    return {nullptr, std::string("samples of the type ") + spec.format.c_str()};
  }
  // Strips are read, not mapped: the file may shrink under us.
  Tiff tiff(TIFFOpen(file.c_str(), "rm"), &TIFFClose);
  if (!tiff || TIFFSetDirectory(tiff.get(), static_cast<tdir_t>(part)) != 1)
    return {nullptr, "libtiff does not read the header"};
  const Layout l = LayoutOf(tiff.get());
  if (TIFFIsTiled(tiff.get()) != 0) return {nullptr, "tiles"};
  if (TIFFIsByteSwapped(tiff.get()) != 0) return {nullptr, "the high byte first"};
  if (l.compression != COMPRESSION_NONE && l.compression != COMPRESSION_ADOBE_DEFLATE &&
      l.compression != COMPRESSION_DEFLATE) {
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
  if (l.order != FILLORDER_MSB2LSB || !predicted) return {nullptr, "an unusual order of bits or differences"};
  if (l.width != static_cast<uint32_t>(spec.width) || l.height != static_cast<uint32_t>(spec.height) ||
      l.channels != spec.nchannels || l.rows < 1) {
    return {nullptr, "not what OpenImageIO says of it"};
  }
  const int rows = static_cast<int>(std::min(l.rows, l.height));
  if (TIFFNumberOfStrips(tiff.get()) != static_cast<uint32_t>((spec.height + rows - 1) / rows))
    return {nullptr, "not what OpenImageIO says of it"};
  return {std::make_unique<TiffDecoder>(std::move(tiff), spec, l, rows, first, last), ""};
}

}  // namespace tessera::io
