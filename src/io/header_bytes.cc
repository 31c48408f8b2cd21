// The attributes of an EXR file's headers and the pixels that they declare, the texts of an OpenVDB file's,
// the screen of a GIF file, the chunks of a PNG file, the user data of a DPX file's, an RLA file's channels
// and images, the samples of an SGI file.
#include "io/header_bytes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "base/input_file.h"
#include "io/codec/png_chunks.h"
#include "io/open_input.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

constexpr uint32_t kExrMagic = 20000630, kSeveralParts = 0x1000;
constexpr int kMostParts = 1 << 16;

uint32_t TakeWord(std::istream& stream) {
  std::array<unsigned char, 4> b{};
  stream.read(reinterpret_cast<char*>(b.data()), b.size());
  return b[0] | uint32_t{b[1]} << 8 | uint32_t{b[2]} << 16 | uint32_t{b[3]} << 24;
}

// Up to a byte of 0; what is longer than a name may be is the library's to refuse.
std::string TakeName(std::istream& stream) {
  constexpr size_t kLongest = 256;
  std::string name;
  for (int c = stream.get(); c > 0 && name.size() <= kLongest; c = stream.get()) name += static_cast<char>(c);
  return name;
}

[[noreturn]] void Refuse(const std::string& file, const std::string& what, int64_t size, int64_t file_size) {
  throw DataError(file, "found " + what + " of " + std::to_string(size) + " bytes declared in a file of " +
                            std::to_string(file_size) + " bytes, expected what the file holds");
}

// Bytes of a value of this type, or of a channel list at this place; -1 for types of any number of bytes.
// OpenEXR reads so many of them whatever the attribute declares.
int64_t ExrBytes(const std::string& type, std::istream& stream) {
  constexpr std::pair<std::string_view, int> kFixed[] = {
      {"box2i", 16},      {"box2f", 16},   {"chromaticities", 32},
      {"compression", 1}, {"double", 8},   {"envmap", 1},
      {"float", 4},       {"int", 4},      {"keycode", 28},
      {"lineOrder", 1},   {"m33f", 36},    {"m33d", 72},
      {"m44f", 64},       {"m44d", 128},   {"rational", 8},
      {"tiledesc", 9},    {"timecode", 8}, {"v2i", 8},
      {"v2f", 8},         {"v2d", 16},     {"v3i", 12},
      {"v3f", 12},        {"v3d", 24},     {"deepImageState", 1}};
  for (const auto& [name, bytes] : kFixed) {
    if (type == name) return bytes;
  }
  const int64_t here = stream.tellg();
  if (type == "preview") {
    const int64_t width = TakeWord(stream), height = TakeWord(stream);
    return height > INT64_MAX / 8 / std::max<int64_t>(width, 1) ? INT64_MAX : 8 + 4 * width * height;
  }
  if (type != "chlist") return -1;
  while (!TakeName(stream).empty()) stream.seekg(16, std::ios::cur);
  return stream.tellg() - here;
}

// What the attributes of a part of an EXR file say of its pixels.
struct ExrPixels {
  int64_t width = 0, height = 0;
  int channels = 0;
  bool sampled = false, halves = false, packed = true, deep = false;

  // Reads what it knows of an attribute's value, here in the stream.
  void Take(const std::string& name, const std::string& type, std::istream& stream) {
    if (name == "dataWindow" && type == "box2i") {
      int64_t side[4];
      for (int64_t& s : side) s = static_cast<int32_t>(TakeWord(stream));
      width = side[2] - side[0] + 1, height = side[3] - side[1] + 1;
    } else if (name == "compression" && type == "compression") {
      packed = stream.get() != 0;
    } else if (name == "type" && type == "string") {
      deep = stream.get() == 'd';  // deepscanline, deeptile: of any number of samples
    } else if (name == "channels" && type == "chlist") {
      constexpr uint32_t kHalf = 1;
      for (channels = 0; !TakeName(stream).empty(); ++channels) {
        halves |= TakeWord(stream) == kHalf;
        TakeWord(stream);  // whether it is perceptually linear
        const uint32_t x = TakeWord(stream), y = TakeWord(stream);
        sampled |= x != 1 || y != 1;
      }
    }
  }
};

// The reader takes memory for rows, or tiles, and what unpacks them, before it looks at one; where the system
// refuses some of it the rest is never given back.
void CheckExrPixels(const std::string& file, const ExrPixels& p, int64_t file_size) {
  if (p.deep || p.sampled || p.channels == 0 || p.width < 1 || p.height < 1 || p.width > INT32_MAX ||
      p.height > INT32_MAX) {
    return;  // the library's to refuse
  }
  OIIO::ImageSpec spec(static_cast<int>(p.width), static_cast<int>(p.height), p.channels,
                       p.halves ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
  if (!p.packed) spec.attribute("compression", "none");
  CheckPlausible(file, "openexr", spec, file_size);
}

void CheckExr(const std::string& file) {
  base::InputFile stream(file, "an image file");
  if (TakeWord(stream) != kExrMagic) return;
  const bool several = (TakeWord(stream) & kSeveralParts) != 0;
  for (int part = 0; part < kMostParts; ++part) {
    bool empty = true;
    ExrPixels pixels;
    for (std::string name = TakeName(stream); !name.empty(); name = TakeName(stream), empty = false) {
      const std::string type = TakeName(stream);
      const int64_t size = TakeWord(stream), here = stream.tellg();
      if (!stream) return;
      const std::string what = "an attribute \"" + base::Shown(name) + "\"";
      if (size > stream.size() - here) Refuse(file, what, size, stream.size());
      const int64_t wanted = ExrBytes(type, stream);
      if (!stream) return;
      if (wanted >= 0 && wanted != size) {
        throw DataError(file, "found " + what + " of " + std::to_string(size) + " bytes, expected " +
                                  std::to_string(wanted) + " for its type " + type);
      }
      stream.seekg(here);
      pixels.Take(name, type, stream);
      stream.seekg(here + size);
    }
    if (stream) CheckExrPixels(file, pixels, stream.size());
    if (!stream || !several || empty) return;
  }
}

// Where a group of channels has no bits the reader scales them for ever, and an image that is followed by
// itself has no end.
void CheckRla(const std::string& file) {
  constexpr int kHeader = 740, kMatte = 22, kAux = 24, kMatteBits = 662, kAuxBits = 666, kNext = 736;
  base::InputFile stream(file, "an image file");
  for (int64_t at = 0; at + kHeader <= stream.size();) {
    std::array<unsigned char, kHeader> h{};
    stream.seekg(at);
    if (!stream.read(reinterpret_cast<char*>(h.data()), kHeader)) return;
    const auto word = [&](int i) {
      const auto k = static_cast<size_t>(i);
      return h[k] << 8 | h[k + 1];
    };
    if ((word(kMatte) != 0 && word(kMatteBits) == 0) || (word(kAux) != 0 && word(kAuxBits) == 0))
      throw DataError(file, "found channels of 0 bits, expected 1 to 32");
    const int64_t next = int64_t{word(kNext)} << 16 | word(kNext + 2);
    if (next == 0) return;
    if (next <= at) {
      throw DataError(file, "found an image at byte " + std::to_string(next) + " that follows one at " +
                                std::to_string(at) + ", expected it behind that");
    }
    at = next;
  }
}

// Of samples of no bytes the reader takes none, and reads them.
void CheckSgi(const std::string& file) {
  constexpr size_t kSampleBytes = 3;
  base::InputFile stream(file, "an image file");
  std::array<unsigned char, 4> h{};
  if (!stream.read(reinterpret_cast<char*>(h.data()), h.size())) return;
  const int bytes = h[kSampleBytes];
  if (bytes != 1 && bytes != 2)
    throw DataError(file, "found samples of " + std::to_string(bytes) + " bytes, expected 1 or 2");
}

// The reader makes a canvas of the whole screen first.
void CheckGif(const std::string& file) {
  base::InputFile stream(file, "an image file");
  std::array<unsigned char, 10> h{};
  if (!stream.read(reinterpret_cast<char*>(h.data()), h.size())) return;
  CheckPlausible(file, "gif", OIIO::ImageSpec(h[6] | h[7] << 8, h[8] | h[9] << 8, 4, OIIO::TypeDesc::UINT8),
                 stream.size());
}

// Names, metadata and grids of an OpenVDB file as far as its trees.
class VdbChecker {
 public:
  VdbChecker(const std::string& file, base::InputFile& stream) : file_(file), stream_(stream) {}

  void Check() {
    constexpr uint32_t kMagic = 0x56444220, kOldest = 222, kNewest = 224;
    constexpr int kUuid = 36;
    if (TakeWord(stream_) != kMagic || TakeWord(stream_) != 0) return;
    const uint32_t version = TakeWord(stream_);
    // Of another layout, which the library would try to read.
    if (stream_ && (version < kOldest || version > kNewest)) {
      throw DataError(file_, "found version " + std::to_string(version) + " of OpenVDB's files, expected " +
                                 std::to_string(kOldest) + " to " + std::to_string(kNewest));
    }
    Skip(8);  // the library's version
    const bool offsets = stream_.get() != 0;
    Skip(kUuid);
    Metadata();
    for (uint32_t left = TakeWord(stream_); stream_ && left > 0; --left) {
      for (int i = 0; i < 3; ++i) Text();  // its name, type, and whose tree it shares
      Skip(16);                            // where it and its blocks are
      const int64_t end = TakeWord(stream_) | int64_t{TakeWord(stream_)} << 32;
      Skip(4);  // how it is packed
      Metadata();
      Text();  // its transform
      if (!offsets || end < stream_.tellg()) return;
      stream_.seekg(end);
    }
  }

 private:
  void Skip(int64_t bytes) { stream_.seekg(bytes, std::ios::cur); }
  // A length and as many bytes.
  void Text() {
    const int64_t size = TakeWord(stream_), here = stream_.tellg();
    if (!stream_) return;
    if (size > stream_.size() - here) Refuse(file_, "a text", size, stream_.size());
    stream_.seekg(here + size);
  }
  void Metadata() {
    for (uint32_t left = TakeWord(stream_); stream_ && left > 0; --left) {
      for (int i = 0; i < 3; ++i) Text();  // name, type, value
    }
  }

  const std::string& file_;
  base::InputFile& stream_;
};

void CheckVdb(const std::string& file) {
  base::InputFile stream(file, "a volume");
  VdbChecker(file, stream).Check();
}

void CheckDpx(const std::string& file) {
  constexpr uint32_t kBackward = 0x58504453, kForward = 0x53445058, kNone = 0xFFFFFFFF;
  constexpr int kUserSize = 32;
  base::InputFile stream(file, "an image file");
  const uint32_t magic = TakeWord(stream);
  if (magic != kBackward && magic != kForward) return;
  stream.seekg(kUserSize);
  uint32_t size = TakeWord(stream);
  if (magic == kBackward) size = __builtin_bswap32(size);
  if (stream && size != kNone && size > stream.size()) Refuse(file, "user data", size, stream.size());
}

// The reader takes memory for all of a chunk first; of pixels alone for a part.
void CheckPng(const std::string& file) {
  base::InputFile stream(file, "an image file");
  ForPngChunks(stream, stream.size(), [&](std::string_view name, int64_t length, int64_t at) {
    if (name != "IDAT" && length > stream.size() - at - 4)  // and its checksum
      Refuse(file, "a chunk \"" + base::Shown(name) + "\"", length, stream.size());
  });
}

}  // namespace

void CheckHeaderBytes(const std::string& file, const std::string& format) {
  if (format == "openexr") CheckExr(file);
  if (format == "gif") CheckGif(file);
  if (format == "png") CheckPng(file);
  if (format == "dpx") CheckDpx(file);
  if (format == "rla") CheckRla(file);
  if (format == "sgi") CheckSgi(file);
  if (format == "openvdb") CheckVdb(file);
}

}  // namespace tessera::io
