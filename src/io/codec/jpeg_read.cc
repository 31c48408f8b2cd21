// libjpeg's decompressor behind an interface that throws.
#include "io/codec/jpeg_read.h"

#include <OpenImageIO/filesystem.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <vector>

// Needs <cstdio>.
#include <jerror.h>
#include <jpeglib.h>

#include "io/codec/whole_file.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

// Calls of libjpeg, each with its own way back: no destructor of C++ lies between an error and its landing.
class JpegFile {
 public:
  // `bytes`: in place of the file's where there are any; they outlive this.
  explicit JpegFile(const std::string& file, std::span<const uint8_t> bytes = {})
      : bytes_(bytes), stream_(std::fopen(file.c_str(), "rb"), &std::fclose) {
    jpeg_.err = jpeg_std_error(&errors_.base);
    errors_.base.error_exit = [](j_common_ptr jpeg) {
      Errors& errors = *reinterpret_cast<Errors*>(jpeg->err);
      (*jpeg->err->format_message)(jpeg, errors.text);
      std::longjmp(errors.landing, 1);
    };
    // Of what is only odd it decodes as much as OpenImageIO does; an early end is no picture.
    errors_.base.emit_message = [](j_common_ptr jpeg, int level) {
      if (level < 0 && jpeg->err->msg_code == JWRN_JPEG_EOF) (*jpeg->err->error_exit)(jpeg);
    };
    errors_.base.output_message = [](j_common_ptr) {};
  }
  ~JpegFile() { jpeg_destroy_decompress(&jpeg_); }
  JpegFile(const JpegFile&) = delete;
  JpegFile& operator=(const JpegFile&) = delete;

  bool Header() {
    if (!stream_ || setjmp(errors_.landing) != 0) return false;
    jpeg_create_decompress(&jpeg_);
    if (bytes_.empty()) {
      jpeg_stdio_src(&jpeg_, stream_.get());
    } else {
      jpeg_mem_src(&jpeg_, bytes_.data(), bytes_.size());
    }
    return jpeg_read_header(&jpeg_, TRUE) == JPEG_HEADER_OK;
  }
  bool Start(int divisor) {
    if (setjmp(errors_.landing) != 0) return false;
    jpeg_.do_block_smoothing = FALSE;  // it would guess what was left out, and nothing is that counts
    jpeg_.scale_num = 1;
    jpeg_.scale_denom = static_cast<unsigned>(divisor);
    return jpeg_start_decompress(&jpeg_) == TRUE;
  }
  bool Row(JSAMPROW row) {
    if (setjmp(errors_.landing) != 0) return false;
    return jpeg_read_scanlines(&jpeg_, &row, 1) == 1;
  }

  const jpeg_decompress_struct& jpeg() const { return jpeg_; }
  std::string reason() const { return errors_.text; }

 private:
  struct Errors {
    jpeg_error_mgr base;  // the first member
    std::jmp_buf landing;
    char text[JMSG_LENGTH_MAX];
  };

  jpeg_decompress_struct jpeg_{};
  Errors errors_{};
  std::span<const uint8_t> bytes_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream_;
};

std::optional<std::vector<uint8_t>> ReadCoarse(const std::string& file) {
  constexpr size_t kMost = size_t{1} << 30;
  const auto bytes = WholeFile(file, kMost);
  return bytes ? CoarseJpeg(*bytes) : std::nullopt;
}

class ReducedReader final : public graph::RowReader {
 public:
  ReducedReader(const std::string& file, const OIIO::ImageSpec& spec, int divisor, int first, int last)
      : file_(file),
        spec_(spec),
        first_(first),
        last_(last),
        coarse_(divisor == 8 ? ReadCoarse(file) : std::nullopt),
        jpeg_(file, coarse_ ? std::span<const uint8_t>(*coarse_) : std::span<const uint8_t>()) {
    if (!jpeg_.Header() || !jpeg_.Start(divisor)) Fail();
    const jpeg_decompress_struct& found = jpeg_.jpeg();
    if (static_cast<int>(found.output_width) != spec.width ||
        static_cast<int>(found.output_height) != spec.height || found.output_components != spec.nchannels) {
      throw DataError(file, "the file changed after its header was read");
    }
  }

  void Read(const ImageView& out) override {
    const auto channels = static_cast<size_t>(spec_.nchannels), wanted = static_cast<size_t>(last_ - first_);
    std::vector<JSAMPLE> row(channels * static_cast<size_t>(spec_.width));
    for (; next_ < out.roi.y1 - spec_.y; ++next_) {
      if (!jpeg_.Row(row.data())) Fail();
      const int y = next_ + spec_.y;
      if (y < out.roi.y0) continue;
      std::byte* to = out.At(out.roi.x0, y);
      if (wanted == channels && out.pixel_stride == static_cast<ptrdiff_t>(channels)) {
        std::memcpy(to, row.data(), row.size());
        continue;
      }
      for (size_t at = static_cast<size_t>(first_); at < row.size(); at += channels, to += out.pixel_stride)
        std::memcpy(to, row.data() + at, wanted);
    }
  }

 private:
  [[noreturn]] void Fail() const { throw DataError(file_, "cannot be read: " + jpeg_.reason()); }

  const std::string file_;
  const OIIO::ImageSpec spec_;
  const int first_, last_;
  const std::optional<std::vector<uint8_t>> coarse_;
  JpegFile jpeg_;
  int next_ = 0;
};

int Divided(int side, int divisor) { return (side + divisor - 1) / divisor; }

}  // namespace

namespace {

// The components of a frame of which 1/8 takes more than constant terms: those with half the samples each
// way, which are decoded at 1/4 then.
std::string FineComponents(std::span<const uint8_t> frame) {
  constexpr size_t kHeader = 6, kComponent = 3;
  int widest = 1, highest = 1;
  for (size_t at = kHeader; at + kComponent <= frame.size(); at += kComponent) {
    widest = std::max(widest, frame[at + 1] >> 4);
    highest = std::max(highest, frame[at + 1] & 15);
  }
  std::string fine;
  for (size_t at = kHeader; at + kComponent <= frame.size(); at += kComponent) {
    const int wide = frame[at + 1] >> 4, high = frame[at + 1] & 15;
    if (2 * wide <= widest && 2 * high <= highest) fine += static_cast<char>(frame[at]);
  }
  return fine;
}

}  // namespace

std::optional<std::vector<uint8_t>> CoarseJpeg(std::span<const uint8_t> bytes) {
  constexpr uint8_t kMark = 0xFF, kStart = 0xD8, kEnd = 0xD9, kScan = 0xDA, kProgressive = 0xC2;
  if (bytes.size() < 4 || bytes[0] != kMark || bytes[1] != kStart) return std::nullopt;
  std::vector<uint8_t> coarse(bytes.begin(), bytes.begin() + 2);
  bool progressive = false;
  std::string fine;
  for (size_t at = 2; at + 4 <= bytes.size() + 2;) {
    const size_t begin = at;
    while (at < bytes.size() && bytes[at] == kMark) ++at;  // fill bytes
    if (at == begin || at == bytes.size()) return std::nullopt;
    const uint8_t name = bytes[at++];
    if (name == kEnd) {
      coarse.insert(coarse.end(), {kMark, kEnd});
      return coarse;
    }
    if (at + 2 > bytes.size()) return std::nullopt;
    size_t end = at + (size_t{bytes[at]} << 8 | bytes[at + 1]);
    if (end < at + 2 || end > bytes.size()) return std::nullopt;
    bool wanted = true;
    if (name == kProgressive) {
      progressive = true;
      fine = FineComponents(bytes.subspan(at + 2, end - at - 2));
    }
    if (name == kScan) {
      // Components, two bytes for each, the first coefficient.
      const size_t first = at + 3 + 2 * size_t{bytes[at + 2]};
      if (!progressive || first >= end) return std::nullopt;
      // Only one component has part in scans of others than constant terms.
      wanted = bytes[first] == 0 || fine.find(static_cast<char>(bytes[at + 3])) != std::string::npos;
      // Its bytes last until a marker that is no restart.
      for (;; ++end) {
        const void* const mark = std::memchr(bytes.data() + end, kMark, bytes.size() - end);
        if (mark == nullptr) return std::nullopt;
        end = static_cast<size_t>(static_cast<const uint8_t*>(mark) - bytes.data());
        if (end + 1 == bytes.size()) return std::nullopt;
        const uint8_t next = bytes[end + 1];
        if (next != 0 && (next & 0xF8) != 0xD0) break;
      }
    }
    if (wanted)
      coarse.insert(coarse.end(), bytes.begin() + static_cast<ptrdiff_t>(begin),
                    bytes.begin() + static_cast<ptrdiff_t>(end));
    at = end;
  }
  return std::nullopt;
}

bool ReadCoarseHeader(const std::string& file, OIIO::ImageSpec& spec) {
  auto coarse = ReadCoarse(file);
  if (!coarse) return false;
  OIIO::Filesystem::IOMemReader memory(coarse->data(), coarse->size());
  const auto input = OIIO::ImageInput::create("jpeg");
  return input != nullptr && input->set_ioproxy(&memory) && input->open(file, spec);
}

int JpegDivisor(const OIIO::ImageSpec& spec, int least_width, int least_height) {
  for (const int divisor : {8, 4, 2}) {
    if (Divided(spec.width, divisor) >= least_width && Divided(spec.height, divisor) >= least_height)
      return divisor;
  }
  return 1;
}

bool JpegIsPlain(const std::string& file, const OIIO::ImageSpec& spec) {
  JpegFile jpeg(file);
  if (spec.format != OIIO::TypeDesc::UINT8 || !jpeg.Header()) return false;
  const jpeg_decompress_struct& found = jpeg.jpeg();
  const bool grey = found.out_color_space == JCS_GRAYSCALE, colors = found.out_color_space == JCS_RGB;
  return (grey && spec.nchannels == 1) || (colors && spec.nchannels == 3);
}

void DivideSides(OIIO::ImageSpec& spec, int divisor) {
  for (int* const side : {&spec.width, &spec.height, &spec.full_width, &spec.full_height})
    *side = Divided(*side, divisor);
}

std::unique_ptr<graph::RowReader> OpenReducedJpeg(const std::string& file, const OIIO::ImageSpec& spec,
                                                  int divisor, int first, int last) {
  return std::make_unique<ReducedReader>(file, spec, divisor, first, last);
}

}  // namespace tessera::io
