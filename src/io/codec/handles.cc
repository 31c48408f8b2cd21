// What a handle cannot read, or reads of another file than was opened first, is the judge's to tell.
#include "io/codec/handles.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

#include "io/codec/chunked.h"
#include "io/codec/per_worker.h"
#include "io/open_input.h"
#include "io/read_rows.h"
#include "io/spec.h"

namespace tessera::io {
namespace {

class HandlesDecoder final : public ChunkedDecoder {
 public:
  HandlesDecoder(std::string file, int part, const OIIO::ImageSpec& spec, int first, int last, int rows)
      : ChunkedDecoder(spec, rows,
                       PixelBytes(StorageType(spec)) * static_cast<size_t>(last - first) *
                           static_cast<size_t>(spec.width)),
        file_(std::move(file)),
        part_(part),
        first_(first),
        last_(last),
        type_(StorageType(spec)) {}

 private:
  struct Worker {
    std::unique_ptr<OIIO::ImageInput> input;  // null for what is not the file that it was
    std::vector<uint8_t> rows;
  };

  void Prepare(int workers) override {
    workers_ = std::make_unique<PerWorker<Worker>>(workers, [this] { return Open(); });
  }

  std::unique_ptr<Worker> Open() const {
    auto worker = std::make_unique<Worker>();
    try {
      auto input = OpenImage(file_, Formats::kAll);
      if (!input->seek_subimage(part_, 0)) return worker;
      const OIIO::ImageSpec& now = input->spec();
      if (now.roi() != spec().roi() || now.format != spec().format ||
          now.channelformats != spec().channelformats || now.tile_width != spec().tile_width ||
          now.tile_height != spec().tile_height) {
        return worker;
      }
      worker->input = std::move(input);
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception&) {  // the judge says it
    }
    return worker;
  }

  const uint8_t* Unpack(int chunk, int worker) override {
    Worker& w = workers_->Of(worker);
    if (!w.input) return nullptr;
    w.rows.resize(Bytes(chunk));
    const size_t height = static_cast<size_t>(Height(chunk)), row = w.rows.size() / height;
    const Roi rows{spec().x, Top(chunk), spec().x + spec().width, Top(chunk) + Height(chunk)};
    const RowsOut out{first_,
                      last_,
                      TypeDescOf(type_),
                      reinterpret_cast<std::byte*>(w.rows.data()),
                      static_cast<ptrdiff_t>(row / static_cast<size_t>(spec().width)),
                      static_cast<ptrdiff_t>(row)};
    try {
      if (ReadRows(*w.input, part_, rows, out)) return w.rows.data();
      w.input->geterror();
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception&) {  // the judge says it
    }
    w.input.reset();
    return nullptr;
  }

  void PutRow(const uint8_t* row, std::byte* pixels, ptrdiff_t pixel_stride) const override {
    const size_t pixel = PixelBytes(type_) * static_cast<size_t>(last_ - first_);
    if (pixel_stride == static_cast<ptrdiff_t>(pixel)) {
      std::memcpy(pixels, row, pixel * static_cast<size_t>(spec().width));
      return;
    }
    for (int x = 0; x < spec().width; ++x, row += pixel, pixels += pixel_stride)
      std::memcpy(pixels, row, pixel);
  }

  const std::string file_;
  const int part_, first_, last_;
  const PixelType type_;
  std::unique_ptr<PerWorker<Worker>> workers_;
};

}  // namespace

Choice<Decoder> MakeHandlesDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                                   int last, int rows) {
  return {std::make_unique<HandlesDecoder>(file, part, spec, first, last, rows), "",
          "OpenImageIO on every core"};
}

}  // namespace tessera::io
