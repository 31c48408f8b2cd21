// Writes bands of rows with OpenImageIO, cut or padded to what the format holds, and checks that all of it
// arrived.
#include "io/file_sink.h"

#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <string_view>
#include <system_error>

#include "base/file_names.h"
#include "io/color_state.h"
#include "io/npy.h"
#include "io/open_input.h"
#include "io/spec.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

// WriteOptions::attributes: the type of each channel, by its name, in place of one for all.
constexpr char kChannelTypes[] = "tessera:ChannelTypes";

constexpr int kPadRows = 16;  // rows of zeros written at once beyond the data window

// What was true of the pixels that were read and is not of those written: their digests, their thumbnail,
// their levels. A file of one level that calls itself a MIP map cannot be read.
constexpr const char* kStale[] = {"oiio:SHA-1",        "oiio:ConstantColor", "oiio:AverageColor",
                                  "oiio:subimages",    "openexr:levelmode",  "openexr:roundingmode",
                                  "openexr:lineOrder", "textureformat",      "thumbnail_image",
                                  "thumbnail_width",   "thumbnail_height",   "thumbnail_nchannels"};

// The longest sides of formats whose writers do not say them: OpenImageIO writes a GIF of the rest modulo
// 2^16, libjpeg ends the program, the others call it invalid data.
constexpr struct {
  const char* format;
  int side;
} kLongestSides[] = {{"gif", 65535}, {"jpeg", 65500}, {"webp", 16383}, {"png", 1000000}};

// Channels of formats whose writers end the program, or write beyond memory, for others.
constexpr struct {
  const char* format;
  const char* expected;
  std::array<size_t, 3> counts;
} kChannelCounts[] = {{"dpx", "1, 3 or 4", {1, 3, 4}}, {"webp", "3 or 4", {3, 4, 4}}};

int TileHint(const ImageSpec& spec, const std::vector<Attribute>& attributes, const std::string& name) {
  int value = 0;
  const auto take = [&](const std::vector<Attribute>& list) {
    for (const Attribute& a : list) {
      if (a.name == name && a.bytes.size() == sizeof value) std::memcpy(&value, a.bytes.data(), sizeof value);
    }
  };
  if (spec.metadata) take(*spec.metadata);
  take(attributes);
  return value;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string list;
  for (size_t i = 0; i < names.size() && i < 8; ++i) list += (i ? "," : "") + names[i];
  return list + (names.size() > 8 ? ",..." : "");
}

// Whether a format that can be written has the extension, dot included: one that has it and cannot be begun
// lacks memory or threads.
bool IsWritten(const std::string& extension) {
  using OIIO::Strutil::splits;
  const auto written = splits(OIIO::get_string_attribute("output_format_list"), ",");
  for (const std::string& format : splits(OIIO::get_string_attribute("extension_list"), ";")) {
    const size_t colon = std::min(format.find(':'), format.size() - 1);
    if (std::find(written.begin(), written.end(), format.substr(0, colon)) == written.end()) continue;
    for (const std::string& known : splits(format.substr(colon + 1), ",")) {
      if (OIIO::Strutil::iequals("." + known, extension)) return true;
    }
  }
  return false;
}

// FITS' writer takes the digits of a whole time from where they would be, whatever the text's length.
void CompleteTime(OIIO::ImageSpec& spec) {
  constexpr std::string_view kWhole = "0000:01:01 00:00:00";
  const OIIO::ParamValue* const given = spec.find_attribute("DateTime");
  if (given == nullptr) return;
  std::string time = given->get_string();
  if (time.size() < kWhole.size()) spec.attribute("DateTime", time.append(kWhole.substr(time.size())));
}

}  // namespace

FileSink::FileSink(const std::string& shown, const ImageSpec& spec, PixelType type,
                   const std::vector<Attribute>& attributes)
    : shown_(shown), data_(spec.data_window), type_(type) {
  DeclareNumPy();
  output_ = OIIO::ImageOutput::create(shown);
  if (!output_) {
    const std::string why = OIIO::geterror(), extension = std::filesystem::path(shown).extension().string();
    if (IsWritten(extension)) {
      throw SystemError(
          shown, "cannot be written: " +
                     (why.empty() ? "its writer is refused memory or a thread" : OneLine(why, "", shown)));
    }
    throw Error(
        shown, (extension.empty() ? "found no file extension" : "found the extension \"" + extension + "\"") +
                   ", expected that of a format that can be written: " +
                   std::string(OIIO::get_string_attribute("output_format_list")));
  }
  if (Context::Default().policy().listed_formats && !IsTrusted(output_->format_name())) {
    throw DataError(shown, "found the format " + std::string(output_->format_name()) +
                               ", expected one of those that are stood behind");
  }
  if (data_.empty()) throw DataError(shown, "found an image without pixels, expected at least 1 x 1");
  const std::string format = output_->format_name();
  if (type_ == PixelType::kHalf && (format == "fits" || format == "rla"))
    type_ = PixelType::kFloat;  // these writers would take halves' bits for those of integers
  file_spec_ = SpecTo(spec, type_);
  if (type_ != spec.type) file_spec_.erase_attribute("oiio:BitsPerSample");
  for (const char* name : kStale) file_spec_.erase_attribute(name);
  if (format == "openexr") SetExrColorState(file_spec_, ColorStateOf(spec));
  // PNG has either a profile or the chunks sRGB and gAMA.
  if (format == "png" && file_spec_.find_attribute("ICCProfile") != nullptr) {
    file_spec_.erase_attribute("oiio:ColorSpace");
  } else if (format == "png") {
    SetCodePoints(file_spec_, ColorStateOf(spec));
  }
  for (const Attribute& a : attributes) {
    if (a.name != "tile_width" && a.name != "tile_height" && a.name != kChannelTypes)
      SetAttribute(file_spec_, a);
  }
  if (format == "fits") CompleteTime(file_spec_);
  if (format == "rla") file_spec_.erase_attribute("oiio:BitsPerSample");  // fewer cannot be mended
  ChooseChannels(spec);
  ChooseWindow(spec);
  ChooseTiles(spec, attributes);
  for (const Attribute& a : attributes) {
    if (a.name == kChannelTypes) ChooseTypes(a.strings);
  }
  direct_ = window_ == data_ && kept_.size() == spec.channels.size();
  next_ = tile_top_ = window_.y0;
}

FileSink::~FileSink() = default;

std::optional<PixelType> FileSink::OnlyType() const {
  if (std::string_view(output_->format_name()) == "jpeg") return PixelType::kUint8;
  return std::nullopt;
}

void FileSink::ChooseChannels(const ImageSpec& spec) {
  kept_.resize(spec.channels.size());
  std::iota(kept_.begin(), kept_.end(), 0);
  for (const auto& [format, expected, counts] : kChannelCounts) {
    if (std::string_view(output_->format_name()) != format ||
        std::find(counts.begin(), counts.end(), kept_.size()) != counts.end())
      continue;
    throw DataError(shown_, "found " + std::to_string(spec.channel_count()) + " channels (" +
                                Joined(spec.channels) + "), expected " + expected + " for " + format);
  }
  if (output_->supports("nchannels")) return;
  const bool alpha = output_->supports("alpha");
  if (!alpha && spec.alpha >= 0 && kept_.size() > 1) kept_.erase(kept_.begin() + spec.alpha);
  const size_t count = kept_.size();
  if (count != 1 && count != 3 && !(alpha && (count == 2 || count == 4))) {
    throw DataError(shown_, "found " + std::to_string(spec.channel_count()) + " channels (" +
                                Joined(spec.channels) + "), expected " +
                                (alpha ? "1 to 4" : "1 or 3, and alpha, which is left out,") + " for " +
                                output_->format_name());
  }
  // In these formats alpha comes last; in another place the writers would divide by it all the same.
  if (spec.alpha >= 0 && (count % 2 != 0 || static_cast<size_t>(spec.alpha) + 1 != count))
    file_spec_.alpha_channel = -1;
  if (count == spec.channels.size()) return;
  file_spec_.nchannels = static_cast<int>(count);
  file_spec_.channelnames.erase(file_spec_.channelnames.begin() + spec.alpha);
  file_spec_.alpha_channel = -1;
}

// Rows are floats then, which hold all of them; OpenImageIO rounds to each channel's type.
void FileSink::ChooseTypes(const std::vector<std::string>& types) {
  if (!output_->supports("channelformats")) {
    throw DataError(shown_, "found channels of several types, expected one type for " +
                                std::string(output_->format_name()) + ", or OpenEXR");
  }
  if (types.size() != kept_.size()) {
    throw DataError(shown_, "found " + std::to_string(types.size()) + " types for " +
                                std::to_string(kept_.size()) + " channels, expected one for each");
  }
  std::vector<OIIO::TypeDesc> formats;
  for (size_t c = 0; c < types.size(); ++c) {
    formats.emplace_back(types[c]);
    // What else is asked for, OpenImageIO writes as halves.
    if (formats[c] == OIIO::TypeHalf || formats[c] == OIIO::TypeFloat) continue;
    throw DataError(shown_, "found the type " + types[c] + " for the channel " + file_spec_.channelnames[c] +
                                ", expected half or float");
  }
  type_ = PixelType::kFloat;
  file_spec_.set_format(TypeDescOf(type_));
  file_spec_.channelformats = std::move(formats);
}

void FileSink::ChooseWindow(const ImageSpec& spec) {
  window_ = data_;
  if (!output_->supports("displaywindow") && !spec.display_window.empty()) window_ = spec.display_window;
  const Roi place = window_;
  const int dx =
      output_->supports("negativeorigin") ? 0 : std::min(0, std::min(window_.x0, file_spec_.full_x));
  const int dy =
      output_->supports("negativeorigin") ? 0 : std::min(0, std::min(window_.y0, file_spec_.full_y));
  file_spec_.x = output_->supports("origin") ? place.x0 - dx : 0;
  file_spec_.y = output_->supports("origin") ? place.y0 - dy : 0;
  file_spec_.width = window_.width();
  file_spec_.height = window_.height();
  file_spec_.full_x += file_spec_.x - place.x0;
  file_spec_.full_y += file_spec_.y - place.y0;
  for (const auto& [format, side] : kLongestSides) {
    if (std::string(output_->format_name()) != format || std::max(window_.width(), window_.height()) <= side)
      continue;
    throw DataError(shown_, "found " + std::to_string(window_.width()) + " x " +
                                std::to_string(window_.height()) + " pixels, expected sides up to " +
                                std::to_string(side) + " for " + format);
  }
}

void FileSink::ChooseTiles(const ImageSpec& spec, const std::vector<Attribute>& attributes) {
  const int width = TileHint(spec, attributes, "tile_width"),
            height = TileHint(spec, attributes, "tile_height");
  if (width < 0 || height < 0 || (width > 0) != (height > 0)) {
    throw Error(shown_, "found tiles of " + std::to_string(width) + " x " + std::to_string(height) +
                            ", expected both sides positive or both 0");
  }
  if (width == 0 || !output_->supports("tiles")) return;
  file_spec_.tile_width = width;
  file_spec_.tile_height = height;
  file_spec_.tile_depth = 1;
}

// The stream, and a codec over it, where there is one for this picture.
bool FileSink::OpenEncoder(int threads) {
  stream_ = std::make_shared<CheckedFile>(temporary_);
  if (stream_->failure() != 0) Fail("");
  Choice<Encoder> choice = MakeEncoder(output_->format_name(), file_spec_, *stream_, threads);
  encoder_text_ = CodecText(output_->format_name(), choice);
  encoder_ = std::move(choice.codec);
  if (!encoder_) return false;
  file_spec_ = encoder_->spec();
  type_ = PixelTypeOf(file_spec_.format).value();
  granularity_ = ChunkRows(output_->format_name(), file_spec_);
  return true;
}

void FileSink::Open(const std::string& temporary, Codec codec, int threads) {
  temporary_ = temporary;
  encoder_text_ = "OpenImageIO (asked for)";
  if (codec == Codec::kAuto && OpenEncoder(threads)) return;
  OpenStream();
  bool ok = false;
  try {
    const base::FileNames::Step step(Context::Default().files());  // libraries make files that are not there
    ok = output_->open(temporary, file_spec_);
  } catch (const std::exception& e) {
    Fail(e.what());
  }
  Opened(ok);
}

void FileSink::OpenStream() {
  // Through a proxy, OpenImageIO 2.4's TIFF writer cannot read back the directory it needs for Exif items
  // (any sRGB picture has one) and leaves a file that nobody can open; by itself it reports a full disk.
  const bool proxy_loses_exif = std::string(output_->format_name()) == "tiff";
  if (!output_->supports("ioproxy") || proxy_loses_exif) {
    stream_.reset();
    return;
  }
  if (!stream_) stream_ = std::make_shared<CheckedFile>(temporary_);
  if (stream_->failure() != 0) Fail("");
  output_->set_ioproxy(stream_.get());
}

void FileSink::Opened(bool ok) {
  if (!ok) Fail(output_->geterror());
  file_spec_ = output_->spec();
  // Formats pick their nearest type; where it is none of ours (double, uint32), OpenImageIO converts from
  // float.
  type_ = PixelTypeOf(file_spec_.format).value_or(PixelType::kFloat);
  granularity_ =
      file_spec_.tile_height > 0 ? file_spec_.tile_height : ChunkRows(output_->format_name(), file_spec_);
}

void FileSink::OpenFirst(const std::string& temporary, const std::vector<FileSink*>& all) {
  temporary_ = temporary;
  encoder_text_ = "OpenImageIO (several images)";
  OpenStream();
  std::vector<OIIO::ImageSpec> specs;
  for (const FileSink* sink : all) specs.push_back(sink->file_spec_);
  bool ok = false;
  try {
    const base::FileNames::Step step(Context::Default().files());
    // Some formats want to know all of them at once.
    ok = output_->open(temporary, static_cast<int>(specs.size()), specs.data());
  } catch (const std::exception& e) {
    Fail(e.what());
  }
  Opened(ok);
  closes_ = all.size() == 1;
  for (size_t i = 1; i < all.size(); ++i) {
    all[i]->part_ = static_cast<int>(i);
    all[i]->closes_ = i + 1 == all.size();
  }
  for (FileSink* const sink : all) sink->several_ = all.size() > 1;
  if (several_) all.back()->parts_.assign(all.begin(), all.end());
}

void FileSink::OpenBehind(FileSink& before) {
  temporary_ = before.temporary_;
  encoder_text_ = before.encoder_text_;
  stream_ = before.stream_;
  output_ = before.output_;
  bool ok = false;
  try {
    ok = output_->open(temporary_, file_spec_, OIIO::ImageOutput::AppendSubimage);
  } catch (const std::exception& e) {
    Fail(e.what());
  }
  Opened(ok);
}

void FileSink::Write(const ConstImageView& rows) {
  if (direct_) {
    Put(rows.roi.y0, rows.roi.y1, rows.data, rows.row_stride);
    return;
  }
  Pad(std::min(rows.roi.y0, window_.y1));
  const Roi part = Intersection(window_, rows.roi);
  if (part.empty()) return;
  const size_t sample = PixelBytes(type_), pixel = sample * kept_.size(), row = pixel * window_.width();
  composed_.assign(row * part.height(), std::byte{0});
  for (int y = part.y0; y < part.y1; ++y) {
    std::byte* to = composed_.data() + row * (y - part.y0) + pixel * (part.x0 - window_.x0);
    const std::byte* from = rows.At(part.x0, y);
    if (static_cast<int>(kept_.size()) == rows.channels) {
      std::memcpy(to, from, pixel * part.width());
      continue;
    }
    for (int x = 0; x < part.width(); ++x, from += rows.pixel_stride) {
      for (const int c : kept_) {
        std::memcpy(to, from + c * rows.channel_stride, sample);
        to += sample;
      }
    }
  }
  Put(part.y0, part.y1, composed_.data(), static_cast<ptrdiff_t>(row));
}

void FileSink::Pad(int until) {
  if (next_ >= until) return;
  const size_t row = PixelBytes(type_) * kept_.size() * window_.width();
  const std::vector<std::byte> zeros(row * std::min(kPadRows, until - next_));
  while (next_ < until)
    Put(next_, std::min(next_ + kPadRows, until), zeros.data(), static_cast<ptrdiff_t>(row));
}

void FileSink::Put(int y0, int y1, const std::byte* data, ptrdiff_t row_stride) {
  if (y0 != next_ || y1 > window_.y1) {
    Fail("rows " + std::to_string(y0) + " to " + std::to_string(y1 - 1) + " arrived, expected row " +
         std::to_string(next_));
  }
  Note(y1 - y0, data, row_stride);
  if (file_spec_.tile_height > 0) {
    PutTiles(y0, y1, data, row_stride);
    return;
  }
  if (encoder_) {
    try {
      encoder_->Write(y1 - y0, data, row_stride);
    } catch (const Error& e) {
      if (e.subject() == "memory") throw;
      Fail(e.reason());
    }
    if (stream_->failure() != 0) Fail("");
    next_ = y1;
    return;
  }
  // This writer reads behind the last row, as far as its own are aligned.
  if (std::string_view(output_->format_name()) == "heif") {
    constexpr size_t kBehind = 4096;
    const size_t row = PixelBytes(type_) * kept_.size() * static_cast<size_t>(window_.width());
    tile_rows_.assign(row * static_cast<size_t>(y1 - y0) + kBehind, std::byte{0});
    for (int y = y0; y < y1; ++y)
      std::memcpy(&tile_rows_[row * static_cast<size_t>(y - y0)], data + (y - y0) * row_stride, row);
    data = tile_rows_.data(), row_stride = static_cast<ptrdiff_t>(row);
  }
  const int offset = file_spec_.y - window_.y0;
  bool ok = false;
  try {
    ok = output_->write_scanlines(y0 + offset, y1 + offset, 0, TypeDescOf(type_), data, OIIO::AutoStride,
                                  row_stride);
  } catch (const std::exception& e) {
    Fail(e.what());
  }
  if (!ok || (stream_ && stream_->failure() != 0)) Fail(output_->geterror());
  next_ = y1;
}

void FileSink::PutTiles(int y0, int y1, const std::byte* data, ptrdiff_t row_stride) {
  const int dx = file_spec_.x - window_.x0, dy = file_spec_.y - window_.y0, tile = file_spec_.tile_height;
  const auto write = [&](int top, int bottom, const std::byte* pixels, ptrdiff_t stride) {
    bool ok = false;
    try {
      ok = output_->write_tiles(window_.x0 + dx, window_.x1 + dx, top + dy, bottom + dy, 0, 1,
                                TypeDescOf(type_), pixels, OIIO::AutoStride, stride);
    } catch (const std::exception& e) {
      Fail(e.what());
    }
    if (!ok || (stream_ && stream_->failure() != 0)) Fail(output_->geterror());
    tile_top_ = bottom;
  };
  const size_t row = PixelBytes(type_) * kept_.size() * window_.width();
  for (int y = y0; y < y1;) {
    const int end = static_cast<int>(std::min<int64_t>(int64_t{tile_top_} + tile, window_.y1));
    const std::byte* from = data + (y - y0) * row_stride;
    if (y == tile_top_ && end <= y1) {
      write(y, end, from, row_stride);
      y = end;
      continue;
    }
    const int stop = std::min(end, y1);  // part of a tile row: kept until it is whole
    tile_rows_.resize(row * (end - tile_top_));
    for (; y < stop; ++y, from += row_stride)
      std::memcpy(tile_rows_.data() + row * (y - tile_top_), from, row);
    if (y == end) write(tile_top_, end, tile_rows_.data(), static_cast<ptrdiff_t>(row));
  }
  next_ = y1;
}

void FileSink::Finish() {
  Pad(window_.y1);
  if (next_ != window_.y1) Fail("row " + std::to_string(next_) + " and those below never arrived");
  if (encoder_) {
    encoder_->Finish();
    stream_->close();
    if (stream_->failure() != 0) Fail("");
    return;
  }
  if (!closes_) return;
  bool ok = false;
  try {
    ok = output_->close();
  } catch (const std::exception& e) {
    Fail(e.what());
  }
  if (stream_) stream_->close();
  if (!ok || (stream_ && stream_->failure() != 0)) Fail(output_->geterror());
  if (!stream_) {
    Mend();
    CheckReadable();
  }
}

FileLayout FileSink::Layout() const {
  return {temporary_, shown_, output_->format_name(), file_spec_, window_, data_, kept_, type_, part_};
}

void FileSink::Fail(const std::string& message) const {
  const int code = stream_ ? stream_->failure() : 0;
  if (code != 0)
    throw SystemError(shown_,
                      "cannot be written: " + std::error_code(code, std::generic_category()).message());
  throw SystemError(shown_, "cannot be written as " + std::string(output_->format_name()) + ": " +
                                OneLine(message, temporary_, shown_));
}

}  // namespace tessera::io
