// PNG: the pixels' stream is unpacked at once by libdeflate, rows are unfiltered as they are asked for.
#include <algorithm>
#include <bit>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "base/bytes.h"
#include "io/codec/codec.h"
#include "io/codec/deflate.h"
#include "io/codec/png_chunks.h"
#include "io/codec/png_rows.h"
#include "io/codec/whole_file.h"
#include "sched/scheduler.h"

namespace tessera::io {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t kIhdrAt = 16, kHeaderBytes = 33;  // signature and IHDR

// As OpenImageIO's reader: colours times alpha, rounded down.
template <typename T>
void Associate(T* pixels, size_t count, int channels, int alpha) {
  constexpr uint32_t kMax = static_cast<T>(-1);
  for (size_t x = 0; x < count; ++x, pixels += channels) {
    for (int c = 0; c < channels; ++c) {
      if (c != alpha) pixels[c] = static_cast<T>(static_cast<uint32_t>(pixels[c]) * pixels[alpha] / kMax);
    }
  }
}

class PngDecoder final : public Decoder {
 public:
  PngDecoder(std::string file, const OIIO::ImageSpec& spec, int first, int last, base::Bytes header)
      : file_(std::move(file)),
        header_(std::move(header)),
        spec_(spec),
        first_(first),
        last_(last),
        row_(spec.scanline_bytes()),
        pixel_(spec.pixel_bytes()) {}

  void Limit(int threads, size_t memory) override {
    threads_ = threads;
    memory_ = memory;
  }

  bool Read(const ImageView& out) override {
    if (raw_.empty() && !Unpack()) return false;
    const auto begin = static_cast<size_t>(out.roi.y0 - spec_.y),
               end = static_cast<size_t>(out.roi.y1 - spec_.y);
    for (; unfiltered_ < end; ++unfiltered_) {
      const uint8_t* above = unfiltered_ > 0 ? Row(unfiltered_ - 1) + 1 : nullptr;
      if (!PngUnfilter(Row(unfiltered_), above, row_, pixel_)) return false;
    }
    sched::InnerFor(static_cast<int64_t>(end - begin + kRowsOfATask - 1) / kRowsOfATask, threads_,
                    [&](int64_t task, int) {
                      const size_t top = begin + static_cast<size_t>(task) * kRowsOfATask;
                      base::Bytes scratch(row_);
                      for (size_t y = top; y < std::min(end, top + kRowsOfATask); ++y)
                        Convert(y, scratch, out.At(out.roi.x0, static_cast<int>(y) + spec_.y),
                                out.pixel_stride);
                    });
    return true;
  }

 private:
  static constexpr int64_t kRowsOfATask = 16;

  uint8_t* Row(size_t y) { return raw_.data() + y * (row_ + 1); }

  bool Unpack() {
    const size_t raw = static_cast<size_t>(spec_.height) * (row_ + 1);
    if (raw > memory_) return RefuseMemory();
    auto bytes = WholeFile(file_, memory_ - raw);
    if (!bytes || bytes->size() < kHeaderBytes || !std::equal(header_.begin(), header_.end(), bytes->begin()))
      return false;
    // The stream's parts are moved to the file's beginning, one behind the other.
    size_t size = 0;
    for (size_t at = sizeof kPngSignature;;) {
      const auto chunk = PngChunkAt(*bytes, at);
      if (!chunk) return false;
      at += chunk->whole.size();
      if (chunk->name == "IDAT") {
        if (Crc32(0, chunk->whole.subspan(4, chunk->bytes.size() + 4)) !=
            BigEndian32(chunk->whole.data() + chunk->whole.size() - 4)) {
          return false;
        }
        std::memmove(bytes->data() + size, chunk->bytes.data(), chunk->bytes.size());
        size += chunk->bytes.size();
      } else if (size > 0) {
        break;
      }
    }
    raw_.resize(raw);
    if (Inflater().Zlib(std::span(*bytes).first(size), raw_)) return true;
    raw_.clear();
    return false;
  }

  void Convert(size_t y, base::Bytes& scratch, std::byte* to, ptrdiff_t pixel_stride) {
    const uint8_t* from = Row(y) + 1;
    const bool wide = spec_.format == OIIO::TypeDesc::UINT16, associate = spec_.alpha_channel != -1;
    const auto width = static_cast<size_t>(spec_.width);
    const size_t sample = wide ? 2 : 1, wanted = sample * static_cast<size_t>(last_ - first_);
    const bool packed = wanted == pixel_ && pixel_stride == static_cast<ptrdiff_t>(pixel_);
    if (packed && !wide && !associate) {
      std::memcpy(to, from, row_);
      return;
    }
    uint8_t* row = packed ? reinterpret_cast<uint8_t*>(to) : scratch.data();
    if (wide) {
      for (size_t i = 0; i < row_; i += 2) {
        row[i] = from[i + 1];
        row[i + 1] = from[i];
      }
      if (associate) Associate(reinterpret_cast<uint16_t*>(row), width, spec_.nchannels, spec_.alpha_channel);
    } else {
      std::memcpy(row, from, row_);
      if (associate) Associate(row, width, spec_.nchannels, spec_.alpha_channel);
    }
    if (packed) return;
    row += sample * static_cast<size_t>(first_);
    for (size_t x = 0; x < width; ++x, row += pixel_, to += pixel_stride) std::memcpy(to, row, wanted);
  }

  const std::string file_;
  const base::Bytes header_;
  const OIIO::ImageSpec spec_;
  const int first_, last_;
  const size_t row_, pixel_;
  int threads_ = 1;
  size_t memory_ = size_t{1} << 28;
  base::Bytes raw_;  // rows with their filters' numbers
  size_t unfiltered_ = 0;
};

}  // namespace

Choice<Decoder> MakePngDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                               int last) {
  base::Bytes header(kHeaderBytes);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (part != 0 || !stream || std::fread(header.data(), 1, header.size(), stream.get()) != header.size() ||
      !std::equal(std::begin(kPngSignature), std::end(kPngSignature), header.begin())) {
    return {nullptr, "not a plain PNG file"};
  }
  const uint8_t* ihdr = header.data() + kIhdrAt;
  const int depth = ihdr[8], color = ihdr[9];
  constexpr int kPalette = 3;
  constexpr int kChannels[] = {1, 0, 3, 0, 2, 0, 4};
  if (ihdr[12] != 0) return {nullptr, "interlaced"};
  if (color == kPalette) return {nullptr, "a palette"};
  if (depth != 8 && depth != 16) return {nullptr, "samples of " + std::to_string(depth) + " bits"};
  if (color > 6 || spec.nchannels != kChannels[color]) return {nullptr, "a transparent colour"};
  if (spec.format != (depth == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16) ||
      static_cast<uint32_t>(spec.width) != BigEndian32(ihdr) ||
      static_cast<uint32_t>(spec.height) != BigEndian32(ihdr + 4)) {
    return {nullptr, "not what OpenImageIO says of it"};
  }
  if (spec.alpha_channel != -1 && spec.get_float_attribute("oiio:Gamma", 1.0f) != 1.0f)
    return {nullptr, "alpha of a file with a gamma is multiplied in by its power"};
  return {std::make_unique<PngDecoder>(file, spec, first, last, std::move(header)), ""};
}

}  // namespace tessera::io
