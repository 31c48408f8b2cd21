// Written by OpenImageIO itself, read by us.
#include "random/foreign.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <memory>
#include <set>
#include <vector>

#include "random/samples.h"
#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/ops/channels.h"
#include "tessera/render.h"

namespace tessera::random {
namespace {

OIIO::TypeDesc TypeOf(PixelType type) {
  return type == PixelType::kUint8    ? OIIO::TypeDesc::UINT8
         : type == PixelType::kUint16 ? OIIO::TypeDesc::UINT16
         : type == PixelType::kHalf   ? OIIO::TypeDesc::HALF
                                      : OIIO::TypeDesc::FLOAT;
}

// How the file is stored.
struct Storage {
  int tile = 0;             // 0: scan lines
  int before = 0;           // parts of the same shape and other pixels before it
  std::string compression;  // that loses nothing
  bool mixed = false;       // one channel of halfs is of floats
};

Storage StorageOf(const Case& c, bool deep, int channels) {
  constexpr const char* kDeep[] = {"zip", "piz", "none", "rle", "zips"};
  constexpr const char* kFlat[] = {"zip", "lzw", "packbits", "none"};
  Storage s;
  s.tile = c.index % 3 == 0 ? 0 : 16 << c.index % 2;
  s.before = deep ? static_cast<int>(c.index / 3 % 2) : 0;
  s.compression = deep ? kDeep[c.index / 6 % std::size(kDeep)] : kFlat[c.index / 6 % std::size(kFlat)];
  s.mixed = c.type == PixelType::kHalf && channels > 1 && c.index / 30 % 2 == 0;
  return s;
}

bool WriteAsOthers(const Image& image, const std::string& file, const Storage& storage) {
  const auto [tile, before, compression, mixed] = storage;
  const ConstImageView view = image.view();
  const Roi& window = view.roi;
  OIIO::ImageSpec spec(window.width(), window.height(), view.channels, TypeOf(view.type));
  spec.x = spec.full_x = window.x0, spec.y = spec.full_y = window.y0;
  spec.full_width = spec.width, spec.full_height = spec.height;
  spec.channelnames = image.spec().channels;
  spec.alpha_channel = image.spec().alpha;
  spec.attribute("compression", compression);
  if (compression == "lzw" || compression == "packbits") spec.attribute("tiff:RowsPerStrip", 5);
  if (mixed) {
    spec.channelformats.assign(static_cast<size_t>(view.channels), OIIO::TypeDesc::HALF);
    spec.channelformats[1] = OIIO::TypeDesc::FLOAT;
  }
  if (tile > 0) spec.tile_width = tile, spec.tile_height = tile, spec.tile_depth = 1;
  std::vector<OIIO::ImageSpec> specs;
  for (int part = 0; part <= before; ++part) {
    specs.push_back(spec);
    if (before > 0) specs.back().attribute("oiio:subimagename", "part" + std::to_string(part));
  }
  const size_t samples = static_cast<size_t>(window.pixels()) * static_cast<size_t>(view.channels);
  const std::vector<std::byte> others(samples * PixelBytes(view.type), std::byte{0x11});
  const auto output = OIIO::ImageOutput::create(file);
  for (int part = 0; part <= before; ++part) {
    const bool opened =
        part == 0 && before > 0 ? output->open(file, before + 1, specs.data())
        : part == 0             ? output->open(file, spec)
                    : output->open(file, specs[static_cast<size_t>(part)], OIIO::ImageOutput::AppendSubimage);
    if (!opened) return false;
    const bool written =
        part < before ? output->write_image(TypeOf(view.type), others.data())
                      : output->write_image(TypeOf(view.type), view.data, view.pixel_stride, view.row_stride);
    if (!written) return false;
  }
  return output->close();
}

// What is wrong with the channels of a file, all at once or the case's one alone; found by `named` names.
std::optional<std::string> WrongChannels(const Case& c, const Node& read, const Image& want, bool named) {
  const std::vector<std::string>& names = want.spec().channels;
  const int channels = want.spec().channel_count();
  const Image all = Render(read, c.type, {.threads = 1, .tile_height = c.tile_height});
  for (int k = 0; k < channels; ++k) {
    const int from = named ? read.spec().ChannelIndex(names[static_cast<size_t>(k)]) : k;
    if (from < 0) return "no channel " + names[static_cast<size_t>(k)] + " was read";
    if (const auto wrong = Differ(Channel(all.view(), from), Channel(want.view(), k))) {
      return "channel " + std::to_string(k) + ": " + *wrong;
    }
    if (k != static_cast<int>(c.index % static_cast<uint64_t>(channels))) continue;
    if (const auto wrong = WrongAlone(c, read, from, Channel(want.view(), k))) return wrong;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> WrongAlone(const Case& c, const Node& read, int channel,
                                      const ConstImageView& want) {
  const Image alone =
      Render(SelectChannels(read, {{channel, 0, "Y"}}), c.type, {.threads = 1, .tile_height = c.tile_height});
  const auto wrong = Differ(alone.view(), want);
  return wrong ? std::optional<std::string>("channel " + std::to_string(channel) + " alone: " + *wrong)
               : std::nullopt;
}

std::optional<std::string> WrongFromForeign(const Case& c, const Image& result, const std::string& base,
                                            Tally& tally) {
  const bool deep = c.type == PixelType::kHalf || c.type == PixelType::kFloat;
  const ImageSpec& spec = result.spec();
  const int channels = spec.channel_count();
  // TIFF has no data window, and OpenImageIO makes alpha of what comes fourth.
  const bool plain = spec.data_window.x0 == 0 && spec.data_window.y0 == 0 && (channels == 1 || channels == 3);
  if (!deep && !plain) return std::nullopt;
  const Storage storage = StorageOf(c, deep, channels);
  const int before = storage.before;
  const std::string file = base + (deep ? ".exr" : ".tif");
  if (!WriteAsOthers(result, file, storage)) return std::nullopt;  // not a file of that format
  tally.Add(kFiles, storage.compression);
  if (storage.tile > 0) tally.Add(kFiles, "tiled");
  if (storage.mixed) tally.Add(kFiles, "of several types");
  if (before > 0) tally.Add(kFiles, "of parts");
  const std::string words = "file of others, " + storage.compression + ", " + std::to_string(storage.tile) +
                            " pixels a tile, part " + std::to_string(before) +
                            (storage.mixed ? ", of several types: " : ": ");
  for (const Codec codec : {Codec::kAuto, Codec::kOpenImageIO}) {
    const Node read = Read(file, {.subimage = before, .codec = codec});
    const std::string by = words + (codec == Codec::kAuto ? "" : "by OpenImageIO: ");
    if (read.spec().data_window != spec.data_window || read.spec().channel_count() != channels ||
        read.spec().type != (storage.mixed ? PixelType::kFloat : c.type)) {
      return by + "another window, type or number of channels was read";
    }
    if (const auto wrong = WrongChannels(c, read, result, deep)) return by + *wrong;
  }
  return std::nullopt;
}

bool CanHold(const std::string& format, const ImageSpec& spec, PixelType type) {
  const int channels = spec.channel_count();
  const std::set<std::string> names(spec.channels.begin(), spec.channels.end());
  if (names.size() < spec.channels.size()) return false;
  if (format == "exr") return type == PixelType::kHalf || type == PixelType::kFloat;
  const bool plain =
      spec.data_window == spec.display_window && spec.data_window.x0 == 0 && spec.data_window.y0 == 0;
  const bool bytes = type == PixelType::kUint8, codes = bytes || type == PixelType::kUint16;
  const bool colors = channels == 3 || channels == 4;
  if (!plain) return false;
  if (format == "png" || format == "sgi") return codes && channels <= 4;
  if (format == "tga") return bytes && colors;
  if (format == "bmp" || format == "ppm") return bytes && channels == 3 && spec.alpha < 0;
  if (format == "dpx") return codes && colors;
  return type != PixelType::kHalf;  // TIFF
}

std::optional<std::string> WrongAtOrigin(const Case& c, const Image& result, const std::string& file,
                                         Tally& tally) {
  ImageSpec spec = result.spec();
  spec.data_window = spec.display_window = {0, 0, spec.width(), spec.height()};
  if (spec.data_window.empty() || !CanHold(c.format, spec, c.type)) return std::nullopt;
  tally.Add(kFiles, c.format);
  Image placed(spec);
  ConstImageView from = result.view();
  from.roi = spec.data_window;
  CopySamples(from, placed.view());
  WriteOptions options{.type = c.type,
                       .render = {.threads = c.threads},
                       .codec = c.index % 4 == 1 ? Codec::kOpenImageIO : Codec::kAuto};
  if (c.format == "exr") {
    constexpr const char* kCompressions[] = {"zip", "piz", "rle", "none"};
    const std::string compression = kCompressions[c.index / 4 % std::size(kCompressions)];
    options.attributes = {{"compression", "string", {}, {compression}}};
    tally.Add(kFiles, "written as " + compression);
  }
  Write(FromImage(placed), file, options);
  const Node read = Read(file), other = Read(file, {.codec = Codec::kOpenImageIO});
  const Image image = Render(other, c.type, {.threads = 1});
  // Of two or four channels of some formats the last is read as alpha, and the others are multiplied by it.
  if (other.spec().alpha < 0) {
    if (const auto wrong = Differ(image.view(), placed.view())) return "by OpenImageIO: " + *wrong;
  }
  if (const auto wrong = Differ(Render(read, c.type, {.threads = c.threads}).view(), image.view())) {
    return "one codec against the other: " + *wrong;
  }
  for (int k = 0; k < image.spec().channel_count(); ++k) {
    if (const auto wrong = WrongAlone(c, read, k, Channel(image.view(), k))) return wrong;
  }
  return std::nullopt;
}

std::optional<std::string> WrongPadding(const Case& c, const Node& result, const std::string& file,
                                        Tally& tally) {
  const Roi& shown = result.spec().display_window;
  const Node padded = Crop(result, shown);
  try {
    Write(result, file, {.type = c.type, .render = {.threads = c.threads}});
  } catch (const Error&) {
    return std::nullopt;  // not of these channels
  }
  const Node read = Read(file);
  if (read.spec().channel_count() != result.spec().channel_count() || read.spec().type != c.type ||
      read.spec().width() != shown.width() || read.spec().height() != shown.height()) {
    return std::nullopt;  // of a format that keeps something else
  }
  tally.Add(kFiles, "padded");
  const Image got = Render(read, c.type, {.threads = 1});
  const Image want = Render(padded, c.type, {.threads = 1});
  ConstImageView placed = got.view();
  placed.roi = shown;
  const auto words = Differ(placed, want.view());
  return words ? std::optional<std::string>("file with rows and columns beyond the data window: " + *words)
               : std::nullopt;
}

}  // namespace tessera::random
