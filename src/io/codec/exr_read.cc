// EXR: OpenEXRCore finds the chunks of scan lines, libdeflate unpacks those of zip, on every core. All else
// is OpenEXR's own to unpack, through OpenImageIO: OpenEXRCore 3.1 has no DWA, and others in code of its own.
#include <openexr.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "base/bytes.h"
#include "io/codec/chunked.h"
#include "io/codec/codec.h"
#include "io/codec/deflate.h"
#include "io/codec/exr_pixels.h"
#include "io/codec/handles.h"
#include "io/codec/per_worker.h"

namespace tessera::io {
namespace {

static_assert(std::endian::native == std::endian::little);

void SayNothing(exr_const_context_t, exr_result_t, const char*) {}

class Context {
 public:
  explicit Context(const std::string& file) {
    exr_context_initializer_t options = EXR_DEFAULT_CONTEXT_INITIALIZER;
    options.error_handler_fn = SayNothing;
    options.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;  // OpenImageIO is asked about such files
    if (exr_start_read(&context_, file.c_str(), &options) != EXR_ERR_SUCCESS) context_ = nullptr;
  }
  ~Context() {
    if (context_ != nullptr) exr_finish(&context_);
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  exr_const_context_t get() const { return context_; }

 private:
  exr_context_t context_ = nullptr;
};

// One worker's.
struct Unpacker {
  Inflater inflater;
  base::Bytes packed, scrambled, unpacked;
};

class ExrDecoder final : public ChunkedDecoder {
 public:
  ExrDecoder(std::unique_ptr<Context> context, int part, const OIIO::ImageSpec& spec, ExrPlaces places,
             int rows)
      : ChunkedDecoder(spec, rows, spec.format.size() * places.size() * static_cast<size_t>(spec.width)),
        context_(std::move(context)),
        part_(part),
        places_(std::move(places)) {}

 private:
  void Prepare(int workers) override {
    workers_ = std::make_unique<PerWorker<Unpacker>>(workers, [] { return std::make_unique<Unpacker>(); });
  }

  const uint8_t* Unpack(int chunk, int worker) override {
    Unpacker& u = workers_->Of(worker);
    const size_t size = Bytes(chunk);
    exr_chunk_info_t info;
    if (exr_read_scanline_chunk_info(context_->get(), part_, Top(chunk), &info) != EXR_ERR_SUCCESS ||
        info.unpacked_size != size || info.packed_size > size || info.start_y != Top(chunk)) {
      return nullptr;
    }
    u.packed.resize(info.packed_size);
    if (exr_read_chunk(context_->get(), part_, &info, u.packed.data()) != EXR_ERR_SUCCESS) return nullptr;
    if (info.packed_size == size) return u.packed.data();
    u.scrambled.resize(size);
    if (!u.inflater.Zlib(u.packed, u.scrambled)) return nullptr;
    u.unpacked.resize(size);
    ExrUnzipOrder(u.scrambled, u.unpacked.data());
    return u.unpacked.data();
  }

  void PutRow(const uint8_t* row, std::byte* pixels, ptrdiff_t pixel_stride) const override {
    ExrRowToPixels(row, places_, spec().format.size(), static_cast<size_t>(spec().width), pixels,
                   pixel_stride);
  }

  std::unique_ptr<Context> context_;
  const int part_;
  const ExrPlaces places_;
  std::unique_ptr<PerWorker<Unpacker>> workers_;  // goes before the context
};

}  // namespace

Choice<Decoder> MakeExrDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                               int last) {
  auto context = std::make_unique<Context>(file);
  exr_storage_t storage;
  const exr_attr_chlist_t* channels = nullptr;
  exr_attr_box2i_t window;
  exr_compression_t compression;
  int32_t rows = 0;
  if (context->get() == nullptr || exr_get_storage(context->get(), part, &storage) != EXR_ERR_SUCCESS ||
      exr_get_channels(context->get(), part, &channels) != EXR_ERR_SUCCESS ||
      exr_get_data_window(context->get(), part, &window) != EXR_ERR_SUCCESS ||
      exr_get_compression(context->get(), part, &compression) != EXR_ERR_SUCCESS) {
    return {nullptr, "OpenEXRCore does not read the header"};
  }
  const bool tiled = storage == EXR_STORAGE_TILED;
  if ((storage != EXR_STORAGE_SCANLINE && !tiled) || tiled != (spec.tile_height > 0))
    return {nullptr, "neither scan lines nor tiles"};
  if (window.min.x != spec.x || window.min.y != spec.y || window.max.x != spec.x + spec.width - 1 ||
      window.max.y != spec.y + spec.height - 1 || channels->num_channels != spec.nchannels) {
    return {nullptr, "not what OpenImageIO says of it"};
  }
  for (int i = 0; i < channels->num_channels; ++i) {
    const exr_attr_chlist_entry_t& entry = channels->entries[i];
    if (entry.x_sampling != 1 || entry.y_sampling != 1) return {nullptr, "channels of fewer samples"};
  }
  if (tiled) return MakeHandlesDecoder(file, part, spec, first, last, spec.tile_height);
  if (exr_get_scanlines_per_chunk(context->get(), part, &rows) != EXR_ERR_SUCCESS || rows < 1)
    return {nullptr, "OpenEXRCore does not read the header"};
  constexpr int kRows = 16;  // of a task, where a chunk has fewer
  const bool plain = compression == EXR_COMPRESSION_NONE || compression == EXR_COMPRESSION_ZIP ||
                     compression == EXR_COMPRESSION_ZIPS;
  const bool one_type = std::all_of(spec.channelformats.begin(), spec.channelformats.end(),
                                    [&](const OIIO::TypeDesc& type) { return type == spec.format; });
  if (!plain || !one_type || (spec.format != OIIO::TypeDesc::HALF && spec.format != OIIO::TypeDesc::FLOAT))
    return MakeHandlesDecoder(file, part, spec, first, last, std::max(rows, kRows));
  const exr_pixel_type_t type = spec.format == OIIO::TypeDesc::HALF ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
  ExrPlaces places;
  for (int i = 0; i < channels->num_channels; ++i) {
    const exr_attr_chlist_entry_t& entry = channels->entries[i];
    const auto at = std::find(spec.channelnames.begin(), spec.channelnames.end(), entry.name.str);
    if (at == spec.channelnames.end() || entry.pixel_type != type)
      return {nullptr, "not what OpenImageIO says of it"};
    const auto channel = static_cast<int>(at - spec.channelnames.begin());
    places.push_back(channel >= first && channel < last
                         ? (channel - first) * static_cast<ptrdiff_t>(spec.format.size())
                         : -1);
  }
  return {std::make_unique<ExrDecoder>(std::move(context), part, spec, std::move(places), rows), ""};
}

}  // namespace tessera::io
