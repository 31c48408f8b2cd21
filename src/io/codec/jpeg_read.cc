// libjpeg's decompressor behind an interface that throws.
#include "io/codec/jpeg_read.h"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <utility>
#include <vector>

// Needs <cstdio>.
#include <jerror.h>
#include <jpeglib.h>

#include "io/codec/codec.h"
#include "io/codec/whole_file.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

constexpr size_t kMostBytes = size_t{1} << 28;  // of a file that is held whole

// Calls of libjpeg, each with its own way back: no destructor of C++ lies between an error and its landing.
// From memory, because libjpeg's fast way through the codes wants kilobytes ahead of it, which the buffer of
// a stream seldom holds.
class JpegFile {
 public:
  // The bytes outlive this. `strict`: what is only odd is an error too.
  JpegFile(std::span<const uint8_t> bytes, bool strict) : bytes_(bytes) {
    jpeg_.err = jpeg_std_error(&errors_.base);
    errors_.base.error_exit = [](j_common_ptr jpeg) {
      Errors& errors = *reinterpret_cast<Errors*>(jpeg->err);
      (*jpeg->err->format_message)(jpeg, errors.text);
      std::longjmp(errors.landing, 1);
    };
    errors_.strict = strict;
    // Of what is only odd it decodes as much as OpenImageIO does; an early end is no picture.
    errors_.base.emit_message = [](j_common_ptr jpeg, int level) {
      const bool strict = reinterpret_cast<Errors*>(jpeg->err)->strict;
      if (level < 0 && (strict || jpeg->err->msg_code == JWRN_JPEG_EOF)) (*jpeg->err->error_exit)(jpeg);
    };
    errors_.base.output_message = [](j_common_ptr) {};
  }
  ~JpegFile() { jpeg_destroy_decompress(&jpeg_); }
  JpegFile(const JpegFile&) = delete;
  JpegFile& operator=(const JpegFile&) = delete;

  bool Header() {
    if (bytes_.empty() || setjmp(errors_.landing) != 0) return false;
    jpeg_create_decompress(&jpeg_);
    jpeg_mem_src(&jpeg_, bytes_.data(), bytes_.size());
    return jpeg_read_header(&jpeg_, TRUE) == JPEG_HEADER_OK;
  }
  bool Start(int divisor, bool coarse) {
    if (setjmp(errors_.landing) != 0) return false;
    // It would guess what was left out, and nothing is that counts.
    if (coarse) jpeg_.do_block_smoothing = FALSE;
    jpeg_.scale_num = 1;
    jpeg_.scale_denom = static_cast<unsigned>(divisor);
    return jpeg_start_decompress(&jpeg_) == TRUE;
  }
  bool Row(JSAMPROW row) {
    if (setjmp(errors_.landing) != 0) return false;
    return jpeg_read_scanlines(&jpeg_, &row, 1) == 1;
  }

  bool Finish() {
    if (setjmp(errors_.landing) != 0) return false;
    return jpeg_finish_decompress(&jpeg_) == TRUE;
  }
  // Whether, of the tables in the header, no codes are left over but the one of all ones. The fast way does
  // not say when it meets such a code.
  bool CodesAreComplete() const {
    const auto complete = [](const JHUFF_TBL* table) {
      int taken = 0, longest = 0;
      for (int i = 1; table != nullptr && i <= 16; ++i) {
        taken += table->bits[i] << (16 - i);
        if (table->bits[i] != 0) longest = i;
      }
      return table == nullptr || taken >= 0x10000 - (1 << (16 - longest));
    };
    return std::all_of(std::begin(jpeg_.dc_huff_tbl_ptrs), std::end(jpeg_.dc_huff_tbl_ptrs), complete) &&
           std::all_of(std::begin(jpeg_.ac_huff_tbl_ptrs), std::end(jpeg_.ac_huff_tbl_ptrs), complete);
  }

  const jpeg_decompress_struct& jpeg() const { return jpeg_; }
  std::string problem() const { return errors_.text; }

 private:
  struct Errors {
    jpeg_error_mgr base;  // the first member
    std::jmp_buf landing;
    char text[JMSG_LENGTH_MAX];
    bool strict;
  };

  jpeg_decompress_struct jpeg_{};
  Errors errors_{};
  std::span<const uint8_t> bytes_;
};

// Rows from the top; false, from then on, for what is not as expected.
class JpegRows {
 public:
  JpegRows(const OIIO::ImageSpec& spec, int divisor, int first, int last)
      : spec_(spec), divisor_(divisor), first_(first), last_(last) {}

  // False for a file that has more bytes than that, or changed.
  bool Begin(const std::string& file, size_t most) {
    auto bytes = WholeFile(file, most);
    if (!bytes) return false;
    bytes_ = std::move(*bytes);
    auto coarse = divisor_ == 8 ? CoarseJpeg(bytes_) : std::nullopt;
    if (coarse) bytes_ = std::move(*coarse);
    jpeg_ = std::make_unique<JpegFile>(bytes_, divisor_ == 1);
    if (!jpeg_->Header() || (divisor_ == 1 && !jpeg_->CodesAreComplete()) ||
        !jpeg_->Start(divisor_, divisor_ > 1)) {
      return false;
    }
    const jpeg_decompress_struct& found = jpeg_->jpeg();
    return static_cast<int>(found.output_width) == spec_.width &&
           static_cast<int>(found.output_height) == spec_.height &&
           found.output_components == spec_.nchannels;
  }
  bool begun() const { return jpeg_ != nullptr; }

  bool Read(const ImageView& out) {
    const auto channels = static_cast<size_t>(spec_.nchannels), wanted = static_cast<size_t>(last_ - first_);
    const bool packed = wanted == channels && out.pixel_stride == static_cast<ptrdiff_t>(channels);
    row_.resize(channels * static_cast<size_t>(spec_.width));
    for (; next_ < out.roi.y1 - spec_.y; ++next_) {
      const int y = next_ + spec_.y;
      std::byte* to = y < out.roi.y0 ? nullptr : out.At(out.roi.x0, y);
      const bool direct = packed && to != nullptr;
      if (!jpeg_->Row(direct ? reinterpret_cast<JSAMPROW>(to) : row_.data())) return false;
      if (direct || to == nullptr) continue;
      for (size_t at = static_cast<size_t>(first_); at < row_.size(); at += channels, to += out.pixel_stride)
        std::memcpy(to, row_.data() + at, wanted);
    }
    // What is left over behind the last row tells of damage before it.
    if (next_ == spec_.height && divisor_ == 1 && !finished_) return finished_ = jpeg_->Finish();
    return true;
  }

  std::string problem() const {
    const std::string text = jpeg_ ? jpeg_->problem() : "";
    return text.empty() ? "the file changed after its header was read" : "cannot be read: " + text;
  }

 private:
  const OIIO::ImageSpec spec_;
  const int divisor_, first_, last_;
  base::Bytes bytes_;
  std::unique_ptr<JpegFile> jpeg_;
  std::vector<JSAMPLE> row_;
  int next_ = 0;
  bool finished_ = false;
};

class ReducedReader final : public graph::RowReader {
 public:
  ReducedReader(const std::string& file, const OIIO::ImageSpec& spec, int divisor, int first, int last)
      : file_(file), rows_(spec, divisor, first, last) {
    if (!rows_.Begin(file, kMostBytes)) Fail();
  }
  void Read(const ImageView& out) override {
    if (!rows_.Read(out)) Fail();
  }

 private:
  [[noreturn]] void Fail() const { throw DataError(file_, rows_.problem()); }

  const std::string file_;
  JpegRows rows_;
};

class JpegDecoder final : public Decoder {
 public:
  JpegDecoder(std::string file, const OIIO::ImageSpec& spec, int first, int last)
      : file_(std::move(file)), rows_(spec, 1, first, last) {}

  void Limit(int /*threads*/, size_t memory) override { memory_ = memory; }
  bool Read(const ImageView& out) override {
    return (rows_.begun() || rows_.Begin(file_, memory_)) && rows_.Read(out);
  }

 private:
  const std::string file_;
  JpegRows rows_;
  size_t memory_ = kMostBytes;
};

int Divided(int side, int divisor) { return (side + divisor - 1) / divisor; }

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

// 8 bits of grey or of colours that libjpeg makes RGB, with as many channels.
bool IsPlain(std::span<const uint8_t> bytes, const OIIO::ImageSpec& spec) {
  JpegFile jpeg(bytes, true);
  if (spec.format != OIIO::TypeDesc::UINT8 || !jpeg.Header()) return false;
  const jpeg_decompress_struct& found = jpeg.jpeg();
  const bool grey = found.out_color_space == JCS_GRAYSCALE, colors = found.out_color_space == JCS_RGB;
  return (grey && spec.nchannels == 1) || (colors && spec.nchannels == 3);
}

}  // namespace

std::optional<base::Bytes> CoarseJpeg(std::span<const uint8_t> bytes) {
  constexpr uint8_t kMark = 0xFF, kStart = 0xD8, kEnd = 0xD9, kScan = 0xDA, kProgressive = 0xC2;
  if (bytes.size() < 4 || bytes[0] != kMark || bytes[1] != kStart) return std::nullopt;
  base::Bytes coarse(bytes.begin(), bytes.begin() + 2);
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

bool JpegEnds(std::span<const std::byte> bytes) {
  const auto byte = [&](size_t i) { return std::to_integer<size_t>(bytes[i]); };
  size_t end = bytes.size();  // of the last marker
  while (end >= 2 && !(byte(end - 2) == 0xFF && byte(end - 1) == 0xD9)) --end;
  for (size_t at = 2; at + 4 <= bytes.size() && byte(at) == 0xFF;) {
    if (byte(at + 1) == 0xFF) {
      ++at;  // fill byte
      continue;
    }
    if (byte(at + 1) == 0xDA) return end >= 2 && end - 2 >= at;
    at += 2 + byte(at + 2) * 256 + byte(at + 3);
  }
  return true;  // the decoder is the judge of what else is wrong
}

std::optional<JpegHeader> ReadJpegHeader(const std::string& file) {
  const auto bytes = WholeFile(file, kMostBytes);
  if (!bytes || bytes->size() < 3 || (*bytes)[0] != 0xFF || (*bytes)[1] != 0xD8 || (*bytes)[2] != 0xFF)
    return std::nullopt;
  JpegHeader header;
  auto coarse = CoarseJpeg(*bytes);
  const base::Bytes& shown = coarse ? *coarse : *bytes;
  OIIO::Filesystem::IOMemReader memory(shown.data(), shown.size());
  const auto input = OIIO::ImageInput::create("jpeg");
  if (input == nullptr || !input->set_ioproxy(&memory) || !input->open(file, header.spec)) {
    OIIO::geterror();
    return std::nullopt;
  }
  header.ends = JpegEnds(std::as_bytes(std::span(*bytes)));
  header.plain = IsPlain(*bytes, header.spec);
  return header;
}

int JpegDivisor(const OIIO::ImageSpec& spec, int least_width, int least_height) {
  for (const int divisor : {8, 4, 2}) {
    if (Divided(spec.width, divisor) >= least_width && Divided(spec.height, divisor) >= least_height)
      return divisor;
  }
  return 1;
}

void DivideSides(OIIO::ImageSpec& spec, int divisor) {
  for (int* const side : {&spec.width, &spec.height, &spec.full_width, &spec.full_height})
    *side = Divided(*side, divisor);
}

std::unique_ptr<graph::RowReader> OpenReducedJpeg(const std::string& file, const OIIO::ImageSpec& spec,
                                                  int divisor, int first, int last) {
  return std::make_unique<ReducedReader>(file, spec, divisor, first, last);
}

Choice<Decoder> MakeJpegDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                                int last) {
  if (part != 0 || spec.format != OIIO::TypeDesc::UINT8 || (spec.nchannels != 1 && spec.nchannels != 3))
    return {nullptr, "not a plain JPEG file"};
  if (!spec.get_string_attribute("jpeg:ColorSpace").empty()) return {nullptr, "colours that are converted"};
  return {std::make_unique<JpegDecoder>(file, spec, first, last), ""};
}

}  // namespace tessera::io
