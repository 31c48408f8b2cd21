// Image files read in this process: the header is read and judged, rows are read when they are asked for.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/input_file.h"
#include "base/policy.h"
#include "graph/source.h"
#include "io/codec/codec.h"
#include "io/codec/jpeg_read.h"
#include "io/codec/png_color.h"
#include "io/image_file.h"
#include "io/open_input.h"
#include "io/read_rows.h"
#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"

namespace tessera::io {
namespace {

using OIIO::ImageInput;

constexpr int64_t kLargestRowBytes = (int64_t{1} << 31) - 1;

std::string PartList(const std::vector<std::string>& names) {
  std::string list;
  for (size_t i = 0; i < names.size(); ++i) {
    list += (i ? ", " : "") + std::to_string(i) + (names[i].empty() ? "" : " (" + names[i] + ")");
  }
  return list;
}

std::string PartName(const OIIO::ImageSpec& spec) {
  return std::string(spec.get_string_attribute("oiio:subimagename", spec.get_string_attribute("name")));
}

// Calls into OpenImageIO and the libraries behind it; what they throw becomes an Error of this file.
template <typename Call>
auto Guarded(const std::string& file, Call&& call) {
  try {
    return call();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    throw DataError(file, OneLine(e.what()));
  }
}

int64_t CheckFile(const std::string& file) {
  const int64_t size = base::RequireFile(file, "an image file");
  if (size == 0) throw DataError(file, "found an empty file (0 bytes), expected an image");
  return size;
}

}  // namespace

// OpenEXR's limit; nearer to 2^31 OpenImageIO's blocks of rows overflow.
constexpr int64_t kFarthest = int64_t{1} << 30;

void CheckSpec(const std::string& file, const std::string& format, const OIIO::ImageSpec& s,
               int64_t file_bytes) {
  const std::string size = std::to_string(s.width) + " x " + std::to_string(s.height);
  if (s.deep) throw DataError(file, "found deep pixels, expected flat ones");
  if (s.width < 1 || s.height < 1)
    throw DataError(file, "found " + size + " pixels, expected at least 1 x 1");
  if (s.nchannels < 1)
    throw DataError(file, "found " + std::to_string(s.nchannels) + " channels, expected at least 1");
  for (const int64_t end : {int64_t{s.x} + s.width, int64_t{s.y} + s.height, int64_t{s.full_x} + s.full_width,
                            int64_t{s.full_y} + s.full_height}) {
    if (end > kFarthest)
      throw DataError(file, "found a window of " + size + " that ends beyond " + std::to_string(kFarthest));
  }
  const int depth = std::max(s.depth, 1);
  if (std::max<int64_t>(s.y, 0) + int64_t{s.height} * depth > INT32_MAX) {
    throw DataError(file, "found a volume of " + std::to_string(depth) + " slices of " + size +
                              " pixels, expected fewer than 2147483648 rows in all");
  }
  const int64_t row = int64_t{s.width} * static_cast<int64_t>(PixelBytes(StorageType(s)));  // below 2^33
  const std::string declared = size + " pixels of " + std::to_string(s.nchannels) + " channels";
  if (row > kLargestRowBytes / s.nchannels) {
    throw DataError(file, "found " + declared + ", expected rows below 2 GiB");
  }
  base::RequireAllowed(file, {s.width, s.height, depth}, s.nchannels);
  CheckPlausible(file, format, s, file_bytes);
  if (s.tile_width < 0 || s.tile_height < 0 || (s.tile_depth > 1 && s.depth <= 1) ||
      (s.tile_width > 0) != (s.tile_height > 0)) {
    throw DataError(file,
                    "found tiles of " + std::to_string(s.tile_width) + " x " + std::to_string(s.tile_height));
  }
}

namespace {

// Of a JPEG file that OpenImageIO opened.
bool EndsWhole(const std::string& file) {
  base::InputFile stream(file, "an image file");
  const std::vector<char> bytes(std::istreambuf_iterator<char>(stream), {});
  return JpegEnds(std::as_bytes(std::span(bytes)));
}

bool IsNamedJpeg(const std::string& file) {
  return file.ends_with(".jpg") || file.ends_with(".jpeg") || file.ends_with(".JPG") ||
         file.ends_with(".JPEG");
}

std::vector<std::string> PartNames(ImageInput& input) {
  std::vector<std::string> names;
  for (int i = 0; input.seek_subimage(i, 0); ++i) names.push_back(PartName(input.spec()));
  input.geterror();  // the seek past the end
  return names;
}

class FileReader final : public graph::RowReader {
 public:
  FileReader(const std::string& file, Formats formats, int subimage, const OIIO::ImageSpec& expected,
             int first, int last)
      : file_(file), subimage_(subimage), first_(first), last_(last), input_(OpenImage(file, formats)) {
    const bool found = Guarded(file, [&] { return input_->seek_subimage(subimage, 0); });
    const OIIO::ImageSpec& now = input_->spec();
    if (!found || now.roi() != expected.roi() || now.format != expected.format ||
        now.tile_width != expected.tile_width || now.tile_height != expected.tile_height) {
      throw DataError(file, "the file changed after its header was read");
    }
    CheckStrips(file, now);
    spec_ = now;
    type_ = StorageType(spec_);
  }

  void Read(const ImageView& out) override {
    if (out.roi.empty()) return;
    if (out.channels != last_ - first_ || out.type != type_ || out.roi.x0 != spec_.x ||
        out.roi.width() != spec_.width || out.roi.y0 < spec_.y || out.roi.y1 > spec_.y + spec_.height ||
        out.channel_stride != static_cast<ptrdiff_t>(PixelBytes(type_))) {
      throw DataError(file_, "rows asked for do not fit the file's window, channels or type");
    }
    if (spec_.tile_height == 0) {
      ReadInto(out.roi, out.data, out.pixel_stride, out.row_stride);
      return;
    }
    for (int y = out.roi.y0; y < out.roi.y1;) y = ReadTileRow(out, y);
  }

 private:
  void ReadInto(const Roi& rows, std::byte* data, ptrdiff_t pixel_stride, ptrdiff_t row_stride) {
    const RowsOut to{first_, last_, TypeDescOf(type_), data, pixel_stride, row_stride};
    if (!Guarded(file_, [&] { return ReadRows(*input_, subimage_, rows, to); })) Fail(rows);
  }

  // Fills out's rows from y to the end of their tile row and returns the next row wanted. A tile row that is
  // only partly asked for is kept, because the rest of it is asked for next.
  int ReadTileRow(const ImageView& out, int y) {
    const int bottom = spec_.y + spec_.height, tile = spec_.tile_height;
    const int top = spec_.y + (y - spec_.y) / tile * tile;
    const int end = static_cast<int>(std::min<int64_t>(int64_t{top} + tile, bottom));
    const Roi row{spec_.x, top, spec_.x + spec_.width, end};
    if (y == top && end <= out.roi.y1 && kept_ != row) {
      ReadInto(row, out.At(row.x0, top), out.pixel_stride, out.row_stride);
      return end;
    }
    const size_t pixel = PixelBytes(type_) * out.channels, width = static_cast<size_t>(row.width());
    if (kept_ != row) {
      kept_ = {};
      pixels_.resize(pixel * width * row.height());
      ReadInto(row, pixels_.data(), static_cast<ptrdiff_t>(pixel), static_cast<ptrdiff_t>(pixel * width));
      kept_ = row;
    }
    const int stop = std::min(end, out.roi.y1);
    for (; y < stop; ++y) {
      const std::byte* from = pixels_.data() + pixel * width * (y - top);
      std::byte* to = out.At(row.x0, y);
      if (out.pixel_stride == static_cast<ptrdiff_t>(pixel)) {
        std::memcpy(to, from, pixel * width);
      } else {
        for (size_t x = 0; x < width; ++x, to += out.pixel_stride) std::memcpy(to, from + x * pixel, pixel);
      }
    }
    return stop;
  }

  [[noreturn]] void Fail(const Roi& rows) {
    throw DataError(file_, "rows " + std::to_string(rows.y0) + " to " + std::to_string(rows.y1 - 1) +
                               " cannot be read: " + OneLine(input_->geterror()));
  }

  std::string file_;
  int subimage_, first_, last_;
  std::unique_ptr<ImageInput> input_;
  OIIO::ImageSpec spec_;
  PixelType type_;
  Roi kept_;  // the tile row in pixels_
  std::vector<std::byte> pixels_;
};

class FileSlices final : public SliceReader {
 public:
  FileSlices(const std::string& file, Formats formats, int subimage, int first, int last, OIIO::TypeDesc type)
      : file_(file),
        subimage_(subimage),
        first_(first),
        last_(last),
        type_(type),
        input_(OpenImage(file, formats)) {
    if (!Guarded(file, [&] { return input_->seek_subimage(subimage, 0); })) Fail();
  }

  void Read(int z0, int z1, std::byte* data) override {
    const auto read = [&] { return ReadSlices(*input_, subimage_, z0, z1, first_, last_, type_, data); };
    if (!Guarded(file_, read)) Fail();
  }

 private:
  [[noreturn]] void Fail() { throw DataError(file_, "cannot be read: " + OneLine(input_->geterror())); }

  std::string file_;
  int subimage_, first_, last_;
  OIIO::TypeDesc type_;
  std::unique_ptr<ImageInput> input_;
};

// Rows by a codec as long as all is as it expects, then by OpenImageIO, whose errors are the ones that count.
class CodecReader final : public graph::RowReader {
 public:
  // `judge(reason)` is OpenImageIO's reader.
  CodecReader(std::unique_ptr<Decoder> decoder,
              std::function<std::unique_ptr<graph::RowReader>(const std::string&)> judge)
      : decoder_(std::move(decoder)), judge_(std::move(judge)) {}

  void Limit(int threads, size_t memory) override { decoder_->Limit(threads, memory); }
  void Read(const ImageView& out) override {
    if (out.roi.empty()) return;
    if (!reader_ && decoder_->Read(out)) {
      if (!begun_) first_ = out.roi.y0;
      begun_ = true;
      return;
    }
    if (!reader_) {
      reader_ = judge_(decoder_->reason());
      if (begun_) Repeat(out);
    }
    reader_->Read(out);
  }

 private:
  // What was read already: where a file is damaged, readers may depend on what they read before.
  void Repeat(const ImageView& out) {
    constexpr int kRows = 64;
    std::vector<std::byte> rows;
    for (int y = first_; y < out.roi.y0; y += kRows) {
      const Roi part{out.roi.x0, y, out.roi.x1, std::min(y + kRows, out.roi.y0)};
      rows.resize(static_cast<size_t>(part.pixels()) * PixelBytes(out.type) *
                  static_cast<size_t>(out.channels));
      reader_->Read(ImageView(rows.data(), part, out.channels, out.type));
    }
  }

  std::unique_ptr<Decoder> decoder_;
  std::function<std::unique_ptr<graph::RowReader>(const std::string&)> judge_;
  std::unique_ptr<graph::RowReader> reader_;
  bool begun_ = false;
  int first_ = 0;  // row asked for
};

class LocalFile final : public ImageFile {
 public:
  explicit LocalFile(const FileRequest& request)
      : file_(request.file), codec_(request.options.codec), formats_(request.options.formats) {
    const ReadOptions& options = request.options;
    OIIO::ImageSpec& native = header_.spec;
    std::string& format = header_.format;
    const int64_t bytes = CheckFile(file_);
    const bool reduces =
        options.enough_width > 0 && options.enough_height > 0 && codec_ != Codec::kOpenImageIO;
    std::optional<JpegHeader> jpeg;
    if (codec_ != Codec::kOpenImageIO && options.subimage == 0 && options.part.empty() && IsNamedJpeg(file_))
      jpeg = Guarded(file_, [&] { return ReadJpegHeader(file_); });
    if (jpeg) {
      format = "jpeg";
      native = jpeg->spec;
    } else {
      const auto input = OpenImage(file_, formats_);
      Guarded(file_, [&] {
        FindPart(*input, options);
        native = input->spec();
      });
      format = input->format_name();
      if (format == "png") ReadPngCodePoints(file_, native);
    }
    if (!request.sparse || format != "openvdb") CheckSpec(file_, format, native, bytes);
    if (format == "jpeg" && !(jpeg ? jpeg->ends : EndsWhole(file_))) {
      throw DataError(
          file_, "found a truncated JPEG of " + std::to_string(bytes) + " bytes, expected an end marker");
    }
    if (jpeg && jpeg->plain && reduces) {
      header_.divisor = JpegDivisor(native, options.enough_width, options.enough_height);
      DivideSides(native, header_.divisor);
    }
  }

  std::unique_ptr<graph::RowReader> Open(int first, int last) const override {
    if (header_.divisor > 1) return OpenReducedJpeg(file_, header_.spec, header_.divisor, first, last);
    auto choice = ChooseDecoder(first, last);
    const auto judge = [=, this](const std::string& reason) {
      const std::lock_guard lock(mutex_);
      gave_up_ = reason;
      return std::make_unique<FileReader>(file_, formats_, header_.subimage, header_.spec, first, last);
    };
    if (!choice.codec) return judge(choice.why_not);
    return std::make_unique<CodecReader>(std::move(choice.codec), judge);
  }
  std::string Decoder() const override {
    if (header_.divisor > 1) return "the codec jpeg at 1/" + std::to_string(header_.divisor);
    {
      const std::lock_guard lock(mutex_);
      if (!gave_up_.empty()) return "OpenImageIO (" + gave_up_ + ")";
    }
    return CodecText(header_.format, ChooseDecoder(0, header_.spec.nchannels));
  }
  std::unique_ptr<SliceReader> OpenSlices(int first, int last, PixelType type) const override {
    CheckStrips(file_, header_.spec);
    return std::make_unique<FileSlices>(file_, formats_, header_.subimage, first, last, TypeDescOf(type));
  }

 private:
  void FindPart(ImageInput& input, const ReadOptions& options) {
    int& subimage = header_.subimage;
    if (options.part.empty()) {
      subimage = options.subimage;
      if (subimage >= 0 && input.seek_subimage(subimage, 0)) return;
      throw DataError(file_,
                      "no part " + std::to_string(subimage) + "; parts found: " + PartList(PartNames(input)));
    }
    for (subimage = 0; input.seek_subimage(subimage, 0); ++subimage) {
      if (PartName(input.spec()) == options.part) return;
    }
    throw DataError(file_,
                    "no part named \"" + options.part + "\"; parts found: " + PartList(PartNames(input)));
  }

  Choice<io::Decoder> ChooseDecoder(int first, int last) const {
    if (codec_ == Codec::kOpenImageIO) return {nullptr, "asked for"};
    return MakeDecoder(header_.format, file_, header_.subimage, header_.spec, first, last);
  }

  std::string file_;
  Codec codec_;
  Formats formats_;
  mutable std::mutex mutex_;
  mutable std::string gave_up_;  // why OpenImageIO read rows
};

}  // namespace

std::unique_ptr<ImageFile> OpenFileHere(const FileRequest& request) {
  return std::make_unique<LocalFile>(request);
}

std::vector<std::string> PartNamesHere(const std::string& file, Formats formats) {
  CheckFile(file);
  const auto input = OpenImage(file, formats);
  return Guarded(file, [&] { return PartNames(*input); });
}

}  // namespace tessera::io
