// Reads a written file's native codes, for formats that keep them.
#include "io/read_back.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <memory>
#include <numeric>
#include <string_view>

#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

// Formats that keep every bit and the channels of what they are given in their own types. JPEG 2000, GIF,
// HEIC and HDR do not, and a format that nobody has tried might not.
constexpr std::string_view kExact[] = {"bmp", "dpx", "fits", "iff",   "npy",  "openexr", "png",
                                       "pnm", "rla", "sgi",  "targa", "tiff", "webp",    "zfile"};

constexpr int kRowsAtOnce = 256;

// Why a file's pixels need not be those that were written, or nothing.
std::string WhyLossy(const FileLayout& layout) {
  if (std::find(std::begin(kExact), std::end(kExact), layout.format) == std::end(kExact)) {
    return "as " + layout.format;
  }
  const std::string compression(layout.spec.get_string_attribute("compression"));
  const auto begins = [&](const char* name) { return compression.rfind(name, 0) == 0; };
  const bool exr = layout.format == "openexr";
  if (exr && (begins("dwa") || begins("b44") || (begins("pxr24") && layout.type == PixelType::kFloat))) {
    return "with the compression " + compression;
  }
  if (layout.format == "tiff" && begins("jpeg")) return "with the compression jpeg";
  if (layout.format == "webp" && !begins("lossless")) return "as webp";
  // Formats that take halves may hold another type.
  if (layout.type == PixelType::kHalf && !exr && layout.format != "tiff") return "as " + layout.format;
  if (!PixelTypeOf(layout.spec.format)) return std::string("as ") + layout.spec.format.c_str();
  return "";
}

class BackReader {
 public:
  // `keeps`: that the format keeps what it is given, its type too.
  explicit BackReader(const FileLayout& layout, bool keeps = true) : layout_(layout) {
    // Codes as they are: nothing multiplied or converted by the reader.
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1);
    hints.attribute("oiio:RawColor", 1);
    input_ = OIIO::ImageInput::open(layout.file, &hints);
    if (!input_) Fail(OIIO::geterror());
    if (layout.part > 0 && !input_->seek_subimage(layout.part, 0)) Fail(input_->geterror());
    spec_ = input_->spec();
    if (spec_.width != layout.spec.width || spec_.height != layout.spec.height || spec_.x != layout.spec.x ||
        spec_.y != layout.spec.y || spec_.nchannels != layout.spec.nchannels ||
        (keeps && PixelTypeOf(spec_.format) != layout.type)) {
      Fail("found " + std::to_string(spec_.width) + " x " + std::to_string(spec_.height) + " pixels of " +
           std::to_string(spec_.nchannels) + " channels of " + spec_.format.c_str() + ", expected " +
           std::to_string(layout.spec.width) + " x " + std::to_string(layout.spec.height) + " of " +
           std::to_string(layout.spec.nchannels) + " of " + PixelTypeName(layout.type));
    }
  }

  const OIIO::ImageSpec& spec() const { return spec_; }

  // The channels of the image in the file's order: formats that name them may keep them sorted.
  std::vector<int> Channels() const {
    const auto& written = layout_.spec.channelnames;
    std::vector<int> channels;
    for (const std::string& name : spec_.channelnames) {
      const auto at = std::find(written.begin(), written.end(), name);
      if (at == written.end()) return layout_.channels;
      channels.push_back(layout_.channels[static_cast<size_t>(at - written.begin())]);
    }
    std::vector<int> sorted = channels, all = layout_.channels;
    std::sort(sorted.begin(), sorted.end());
    std::sort(all.begin(), all.end());
    return layout_.format == "openexr" && sorted == all ? channels : layout_.channels;
  }

  void Read(const ImageView& rows) {
    const int tile = spec_.tile_height, offset = layout_.spec.y - layout_.window.y0;
    int y0 = rows.roi.y0 + offset, y1 = rows.roi.y1 + offset;
    if (tile > 0) {  // whole rows of tiles
      y0 = spec_.y + (y0 - spec_.y) / tile * tile;
      y1 = std::min(spec_.y + spec_.height, spec_.y + (y1 - spec_.y + tile - 1) / tile * tile);
    }
    const size_t pixel = PixelBytes(layout_.type) * static_cast<size_t>(spec_.nchannels);
    const size_t row = pixel * static_cast<size_t>(spec_.width);
    pixels_.resize(row * static_cast<size_t>(y1 - y0));
    bool ok = false;
    try {
      const OIIO::TypeDesc type = TypeDescOf(layout_.type);
      ok = tile > 0
               ? input_->read_tiles(layout_.part, 0, spec_.x, spec_.x + spec_.width, y0, y1, 0, 1, 0,
                                    spec_.nchannels, type, pixels_.data())
               : input_->read_scanlines(layout_.part, 0, y0, y1, 0, 0, spec_.nchannels, type, pixels_.data());
    } catch (const std::exception& e) {
      Fail(e.what());
    }
    if (!ok) Fail(input_->geterror());
    const size_t skipped = pixel * static_cast<size_t>(rows.roi.x0 - layout_.window.x0);
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      std::memcpy(rows.At(rows.roi.x0, y), pixels_.data() + row * (y + offset - y0) + skipped,
                  pixel * static_cast<size_t>(rows.roi.width()));
    }
  }

 private:
  [[noreturn]] void Fail(const std::string& message) {
    throw SystemError(layout_.shown, "the file that was written cannot be read back: " +
                                         OneLine(message, layout_.file, layout_.shown));
  }

  FileLayout layout_;
  std::unique_ptr<OIIO::ImageInput> input_;
  OIIO::ImageSpec spec_;
  std::vector<std::byte> pixels_;
};

// The rows as they were handed to the encoder.
StoredPixels Handed(const FileLayout& layout, const Node& node, const RenderOptions& render) {
  StoredPixels stored;
  stored.window = layout.data;
  stored.type = layout.type;
  stored.channels.resize(node.spec().channels.size());
  std::iota(stored.channels.begin(), stored.channels.end(), 0);
  RenderOptions quiet = render;
  quiet.progress = {};
  stored.read = [node, quiet](const ImageView& rows) { RenderInto(node, rows, quiet); };
  stored.remarks = {"pixels stored " + WhyLossy(layout) +
                    " are not those that were given: looked at as they were handed to the encoder"};
  return stored;
}

}  // namespace

std::optional<base::Digest> StoredDigest(const FileLayout& layout) {
  const bool keeps = WhyLossy(layout).empty();
  BackReader reader(layout, keeps);
  ImageSpec spec(layout.window.width(), 1, static_cast<int>(layout.channels.size()), layout.type);
  base::Digest digest{};
  for (int y = layout.window.y0; y < layout.window.y1; y += kRowsAtOnce) {
    spec.data_window = {layout.window.x0, y, layout.window.x1, std::min(y + kRowsAtOnce, layout.window.y1)};
    const Image rows(spec);
    reader.Read(rows.view());
    const size_t row =
        PixelBytes(layout.type) * layout.channels.size() * static_cast<size_t>(layout.window.width());
    for (int k = y; k < spec.data_window.y1; ++k)
      base::AddToDigest(digest, {rows.view().At(spec.data_window.x0, k), row});
  }
  return keeps ? std::optional(digest) : std::nullopt;
}

StoredPixels ReadBack(const FileLayout& layout, const Node& node, const RenderOptions& render) {
  if (!WhyLossy(layout).empty()) return Handed(layout, node, render);
  const auto reader = std::make_shared<BackReader>(layout);
  const OIIO::ImageSpec& spec = reader->spec();
  StoredPixels stored;
  stored.window = Intersection(layout.window, layout.data);
  stored.channels = reader->Channels();
  stored.type = layout.type;
  stored.read = [reader](const ImageView& rows) { reader->Read(rows); };
  const int bits = spec.get_int_attribute("oiio:BitsPerSample", 0);
  const bool integers = layout.type == PixelType::kUint8 || layout.type == PixelType::kUint16;
  if (integers && bits > 0 && bits < 8 * static_cast<int>(PixelBytes(layout.type))) {
    stored.bits = bits;
    stored.remarks.push_back("samples of " + std::to_string(bits) +
                             " bits, compared within one of their codes");
  }
  if (integers && spec.alpha_channel >= 0 && spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0) {
    stored.unassociated = spec.alpha_channel;
    stored.remarks.push_back("colours stored divided by alpha, compared when multiplied again");
  }
  return stored;
}

}  // namespace tessera::io
