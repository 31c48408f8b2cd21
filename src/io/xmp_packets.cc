// PNG: text chunks (PNG specification, 11.3.4). JPEG: APP1 markers before the first scan (XMP specification
// part 3, 1.1.3). TIFF: tag 700 of every directory, which is an image of its own.
#include "io/xmp_packets.h"

#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "base/bytes.h"
#include "base/input_file.h"
#include "io/codec/deflate.h"
#include "io/codec/png_chunks.h"
#include "io/xmp_budget.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

// Of a packet, and of a PNG's text, which libpng takes up to 8 MB of.
constexpr size_t kMostOfPacket = size_t{1} << 26;
constexpr int64_t kMostOfTexts = int64_t{1} << 28;

void Take(const std::string& file, XmpBudget& budget, std::string_view packet) {
  const std::string why = budget.Take(packet);
  if (!why.empty()) throw DataError(file, why + " in its XMP, expected what can be read in a moment");
}

std::string Bytes(base::InputFile& stream, int64_t at, int64_t size) {
  std::string bytes(static_cast<size_t>(size), '\0');
  stream.seekg(at);
  stream.read(bytes.data(), size);
  bytes.resize(static_cast<size_t>(stream.gcount()));
  return bytes;
}

// The next part of a text chunk, up to a byte of 0.
std::string_view Part(std::string_view& rest) {
  const size_t end = std::min(rest.find('\0'), rest.size());
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return part;
}

class PngTexts {
 public:
  explicit PngTexts(const std::string& file) : file_(file) {}

  // A chunk that is within the file.
  void Take(std::string_view name, base::InputFile& stream, int64_t at, int64_t length) {
    if (length > static_cast<int64_t>(kMostOfPacket)) RefuseText();
    const std::string bytes = Bytes(stream, at, length);
    std::string_view chunk = bytes;
    const std::string_view keyword = Part(chunk);
    bool packed = name == "zTXt";
    if (packed) {
      if (chunk.empty()) return;
      chunk.remove_prefix(1);  // the method, of which there is one
    } else if (name == "iTXt") {
      if (chunk.size() < 2) return;
      packed = chunk[0] != 0;
      chunk.remove_prefix(2);
      Part(chunk), Part(chunk);  // the language, the translated keyword
    }
    if (packed && !Unpack(chunk)) return;
    bytes_ += static_cast<int64_t>(chunk.size());
    if (bytes_ > kMostOfTexts) throw DataError(file_, "found texts of more than 256 MiB, expected less");
    if (OIIO::Strutil::iequals(keyword, "XML:com.adobe.xmp")) io::Take(file_, budget_, chunk);
  }

 private:
  [[noreturn]] void RefuseText() const {
    throw DataError(file_, "found a text of more than 64 MiB, expected less");
  }
  // False for what is damaged, which libpng leaves out.
  bool Unpack(std::string_view& chunk) {
    const std::span packed(reinterpret_cast<const uint8_t*>(chunk.data()), chunk.size());
    for (size_t room = size_t{1} << 16;; room = std::min(8 * room, kMostOfPacket)) {
      if (unpacked_.size() < room) unpacked_.resize(room);
      const auto found = inflater_.ZlibWithin(packed, unpacked_);
      if (found.fits) {
        chunk = {reinterpret_cast<const char*>(unpacked_.data()), found.bytes};
        return found.whole;
      }
      if (room == kMostOfPacket) RefuseText();
    }
  }

  const std::string& file_;
  Inflater inflater_;
  base::Bytes unpacked_;
  XmpBudget budget_;
  int64_t bytes_ = 0;
};

void CheckPng(const std::string& file) {
  base::InputFile stream(file, "an image file");
  PngTexts texts(file);
  ForPngChunks(stream, stream.size(), [&](std::string_view name, int64_t length, int64_t at) {
    if (name == "tEXt" || name == "zTXt" || name == "iTXt") texts.Take(name, stream, at, length);
  });
}

void CheckJpeg(const std::string& file) {
  constexpr std::string_view kName("http://ns.adobe.com/xap/1.0/\0", 29);
  constexpr int kStartOfScan = 0xDA, kEnd = 0xD9, kApp1 = 0xE1;
  base::InputFile stream(file, "an image file");
  XmpBudget budget;
  stream.seekg(2);
  while (stream) {
    int marker = stream.get();
    if (marker != 0xFF) continue;
    while (marker == 0xFF) marker = stream.get();
    if (marker == kStartOfScan || marker == kEnd) return;
    if (marker <= 1 || (marker >= 0xD0 && marker <= 0xD7)) continue;  // of no length
    const int high = stream.get(), low = stream.get(), length = high << 8 | low;
    if (!stream || length < 2) return;
    const int64_t here = stream.tellg();
    if (marker == kApp1) {
      const std::string bytes = Bytes(stream, here, length - 2);
      if (bytes.starts_with(kName)) Take(file, budget, bytes);
    }
    stream.seekg(here + length - 2);
  }
}

class TiffDirectories {
 public:
  explicit TiffDirectories(const std::string& file) : file_(file), stream_(file, "an image file") {}

  void Check() {
    const std::string mark = Bytes(stream_, 0, 4);
    if (mark.size() < 4) return;
    big_endian_ = mark[0] == 'M';
    wide_ = mark[big_endian_ ? 3 : 2] == '+';
    if (wide_) Number(4);  // the size of an offset, and nothing
    std::set<uint64_t> seen;
    for (uint64_t at = Number(wide_ ? 8 : 4); at != 0 && seen.insert(at).second; at = Directory(at)) {
      if (!stream_ || at >= static_cast<uint64_t>(stream_.size())) return;
    }
  }

 private:
  uint64_t Number(int bytes) {
    uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) {
      const auto byte = static_cast<uint64_t>(stream_.get() & 0xFF);
      value = big_endian_ ? value << 8 | byte : value | byte << (8 * i);
    }
    return value;
  }

  // Where the next one is.
  uint64_t Directory(uint64_t at) {
    constexpr uint64_t kXmp = 700;
    const int count_bytes = wide_ ? 8 : 2, offset_bytes = wide_ ? 8 : 4;
    const int64_t entry = 4 + 2 * offset_bytes, first = static_cast<int64_t>(at) + count_bytes;
    stream_.seekg(static_cast<int64_t>(at));
    const uint64_t entries = Number(count_bytes);
    if (!stream_ || entries > static_cast<uint64_t>((stream_.size() - first) / entry)) return 0;
    entries_bytes_ += static_cast<int64_t>(entries) * entry;
    if (entries_bytes_ > stream_.size())
      throw DataError(file_, "found directories over each other, expected each at its own place");
    XmpBudget budget;
    for (int64_t i = 0; i < static_cast<int64_t>(entries); ++i) {
      stream_.seekg(first + i * entry);
      if (Number(2) != kXmp) continue;
      const int width = Width(Number(2));
      const uint64_t count = Number(offset_bytes);
      if (width == 0 || count > static_cast<uint64_t>(stream_.size() / width)) continue;
      const int64_t size = static_cast<int64_t>(count) * width;
      const auto from = size <= offset_bytes ? static_cast<uint64_t>(stream_.tellg()) : Number(offset_bytes);
      if (from <= static_cast<uint64_t>(stream_.size() - size)) Packet(from, size, width, budget);
    }
    stream_.clear();
    stream_.seekg(first + static_cast<int64_t>(entries) * entry);
    return Number(offset_bytes);
  }

  // Bytes of a value by its type; 0 for those of which libtiff makes no bytes.
  static int Width(uint64_t type) {
    constexpr std::array<int, 18> kWidths = {0, 1, 1, 2, 4, 0, 1, 1, 2, 4, 0, 0, 0, 0, 0, 0, 8, 8};
    return type < kWidths.size() ? kWidths[type] : 0;
  }

  void Packet(uint64_t from, int64_t size, int width, XmpBudget& budget) {
    if (!packets_.insert({from, size}).second) return;  // shared with another image, looked at
    bytes_ += size;
    if (size > static_cast<int64_t>(kMostOfPacket) || bytes_ > stream_.size()) {
      throw DataError(file_, "found XMP of " + std::to_string(bytes_) + " bytes in a file of " +
                                 std::to_string(stream_.size()) + " bytes, expected up to 64 MiB, and once");
    }
    std::string packet = Bytes(stream_, static_cast<int64_t>(from), size);
    for (size_t i = 0; width > 1 && (i + 1) * width <= packet.size(); ++i)
      packet[i] = packet[i * width + (big_endian_ ? width - 1 : 0)];
    Take(file_, budget, std::string_view(packet).substr(0, packet.size() / width));
  }

  const std::string& file_;
  base::InputFile stream_;
  bool big_endian_ = false, wide_ = false;
  std::set<std::pair<uint64_t, int64_t>> packets_;
  int64_t bytes_ = 0;          // of packets
  int64_t entries_bytes_ = 0;  // of directories
};

}  // namespace

void CheckXmp(const std::string& file, const std::string& format) {
  if (format == "png") CheckPng(file);
  if (format == "jpeg") CheckJpeg(file);
  if (format == "tiff") TiffDirectories(file).Check();
}

}  // namespace tessera::io
