// EXR: OpenImageIO writes the header; chunks of rows are packed by libdeflate, or by OpenImageIO into files
// of their own in memory, on every core.
#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/codec/codec.h"
#include "io/codec/exr_header.h"
#include "io/codec/exr_pack.h"
#include "io/codec/exr_pixels.h"
#include "io/codec/per_worker.h"
#include "io/codec/row_batches.h"
#include "io/spec.h"
#include "sched/scheduler.h"

namespace tessera::io {
namespace {

// OpenEXR's own default is zlib's level 4. Of libdeflate, 1 leaves files within -0.4 and +1.5 % of that in
// two fifths of the time; 4 would be 2 to 5 % smaller and take a third longer.
constexpr int kLevel = 1;

// Rows packed at once by a thread: some sixteen, which are one chunk of zip; never less than a chunk.
size_t TaskRows(size_t chunk_rows) { return std::max<size_t>(1, 16 / chunk_rows) * chunk_rows; }

// Tasks for all threads, but where a chunk is large rather fewer than much memory.
size_t TasksAtOnce(const OIIO::ImageSpec& spec, size_t chunk_rows, int threads) {
  constexpr size_t kMost = size_t{64} << 20;
  return std::clamp<size_t>(kMost / std::max<size_t>(1, spec.scanline_bytes(true) * TaskRows(chunk_rows)), 1,
                            static_cast<size_t>(threads));
}

class ExrEncoder final : public Encoder {
 public:
  // `header`: the file up to the table of chunks.
  ExrEncoder(const OIIO::ImageSpec& spec, std::vector<unsigned char> header, size_t chunk_rows,
             std::function<std::unique_ptr<ExrPacker>()> packer, OIIO::Filesystem::IOProxy& stream,
             int threads)
      : header_(std::move(header)),
        stream_(stream),
        threads_(threads),
        task_rows_(TaskRows(chunk_rows)),
        rows_(spec.scanline_bytes(true), task_rows_ * TasksAtOnce(spec, chunk_rows, threads),
              static_cast<size_t>(spec.height)),
        workers_(threads, std::move(packer)) {
    spec_ = spec;
    offsets_.resize((static_cast<size_t>(spec.height) + chunk_rows - 1) / chunk_rows);
    offset_ = header_.size() + offsets_.size() * sizeof(uint64_t);
  }

  void Write(int rows, const std::byte* data, ptrdiff_t row_stride) override {
    if (!begun_) {
      stream_.write(header_.data(), header_.size());
      stream_.write(offsets_.data(), offsets_.size() * sizeof(uint64_t));
      begun_ = true;
    }
    rows_.Add(static_cast<size_t>(rows), data, row_stride,
              [this](std::span<const uint8_t* const> part) { Put(part); });
  }

  void Finish() override {
    stream_.seek(static_cast<int64_t>(header_.size()));
    stream_.write(offsets_.data(), offsets_.size() * sizeof(uint64_t));
  }

 private:
  // Whole chunks, and the rest after the last row.
  void Put(std::span<const uint8_t* const> rows) {
    const size_t count = (rows.size() + task_rows_ - 1) / task_rows_;
    if (tasks_.size() < count) tasks_.resize(count);
    sched::InnerFor(static_cast<int64_t>(count), threads_, [&](int64_t i, int worker) {
      const size_t first = static_cast<size_t>(i) * task_rows_;
      ExrChunks& chunks = tasks_[static_cast<size_t>(i)];
      chunks.Clear();
      workers_.Of(worker).Pack(rows.subspan(first, std::min(task_rows_, rows.size() - first)),
                               spec_.y + static_cast<int>(next_ + first), chunks);
    });
    for (size_t i = 0; i < count; ++i) {
      for (const size_t size : tasks_[i].sizes) {
        if (chunk_ < offsets_.size()) offsets_[chunk_++] = offset_;
        offset_ += size;
      }
      stream_.write(tasks_[i].bytes.data(), tasks_[i].used);
    }
    next_ += rows.size();
  }

  const std::vector<unsigned char> header_;
  OIIO::Filesystem::IOProxy& stream_;
  const int threads_;
  const size_t task_rows_;
  RowBatches rows_;
  PerWorker<ExrPacker> workers_;
  std::vector<ExrChunks> tasks_;
  std::vector<uint64_t> offsets_;
  uint64_t offset_ = 0;          // of the next chunk
  size_t next_ = 0, chunk_ = 0;  // rows and chunks written
  bool begun_ = false;
};

}  // namespace

Choice<Encoder> MakeExrEncoder(const OIIO::ImageSpec& spec, OIIO::Filesystem::IOProxy& stream, int threads) {
  if (spec.tile_width > 0) return {nullptr, "tiles"};
  const auto output = OIIO::ImageOutput::create("exr");
  std::vector<unsigned char> file;
  OIIO::Filesystem::IOVecOutput memory(file);
  if (!output) return {nullptr, "OpenImageIO does not write the header"};
  OIIO::ImageSpec written;
  try {
    output->set_ioproxy(&memory);
    if (!output->open("header.exr", spec)) {
      output->geterror();
      return {nullptr, "OpenImageIO does not write the header"};
    }
    written = output->spec();
    output->close();  // the header is there, and a table of no chunks
    output->geterror();
  } catch (const std::exception&) {
    return {nullptr, "OpenImageIO does not write the header"};
  }
  const auto [compression, quality] = spec.decode_compression_metadata("zip", -1);
  const bool own = compression == "zip" || compression == "zips" || compression == "none";
  for (const OIIO::TypeDesc& type : written.channelformats) {
    if (type != written.format) return {nullptr, "channels of different types"};
  }
  if (written.format != OIIO::TypeDesc::HALF && written.format != OIIO::TypeDesc::FLOAT)
    return {nullptr, std::string("samples of the type ") + written.format.c_str()};
  ExrHeader header;
  const size_t chunk_rows = static_cast<size_t>(ChunkRows("openexr", written));
  const size_t chunks = (static_cast<size_t>(spec.height) + chunk_rows - 1) / chunk_rows;
  if (!ParseExrHeader(file, header) || header.end + chunks * sizeof(uint64_t) != file.size() ||
      !header.increasing)
    return {nullptr, "found a header of OpenImageIO's that is not one part of scan lines"};
  ExrPlaces places;
  for (const std::string& name : header.channels) {
    const auto at = std::find(written.channelnames.begin(), written.channelnames.end(), name);
    if (at == written.channelnames.end()) return {nullptr, "OpenImageIO names the channels otherwise"};
    places.push_back((at - written.channelnames.begin()) * static_cast<ptrdiff_t>(written.format.size()));
  }
  if (places.size() != static_cast<size_t>(written.nchannels)) return {nullptr, "two channels of one name"};
  file.resize(header.end);
  std::function<std::unique_ptr<ExrPacker>()> packer;
  if (own) {
    const int level = compression == "none" ? 0 : quality >= 1 && quality <= 9 ? quality : kLevel;
    packer = [=] { return MakeExrPacker(written, places, chunk_rows, level); };
  } else {
    packer = [=] { return MakeExrLibraryPacker(written, spec, chunk_rows); };
  }
  return {
      std::make_unique<ExrEncoder>(written, std::move(file), chunk_rows, std::move(packer), stream, threads),
      "", own ? "" : "OpenImageIO on every core"};
}

}  // namespace tessera::io
