// The chunk cICP of PNG files, read and written.
#include "io/codec/png_color.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <string_view>

#include "base/input_file.h"
#include "io/codec/deflate.h"
#include "io/codec/png_chunks.h"

namespace tessera::io {
namespace {

constexpr std::string_view kName = "cICP", kAttribute = "CICP";
constexpr size_t kHeaderChunk = 13 + kPngChunkFrame;
const OIIO::TypeDesc kFourCodes(OIIO::TypeDesc::INT, 4);

}  // namespace

void ReadPngCodePoints(const std::string& file, OIIO::ImageSpec& spec) {
  constexpr int kMostChunks = 256;  // texts and profiles before the pixels
  if (spec.find_attribute(kAttribute) != nullptr) return;
  base::InputFile stream(file, "an image file");
  stream.seekg(sizeof kPngSignature);
  for (int i = 0; i < kMostChunks; ++i) {
    std::array<uint8_t, 8> start{};
    if (!stream.read(reinterpret_cast<char*>(start.data()), start.size())) return;
    const std::string_view name(reinterpret_cast<const char*>(start.data()) + 4, 4);
    const uint32_t length = BigEndian32(start.data());
    if (name == "IDAT" || name == "IEND") return;
    if (name != kName) {
      stream.seekg(std::streamoff{length} + 4, std::ios::cur);
      continue;
    }
    std::array<uint8_t, 8> bytes{};
    if (length != 4 || !stream.read(reinterpret_cast<char*>(bytes.data()), bytes.size())) return;
    std::array<uint8_t, 8> checked{};
    std::copy(start.begin() + 4, start.end(), checked.begin());
    std::copy(bytes.begin(), bytes.begin() + 4, checked.begin() + 4);
    // Other matrices and ranges are not of RGB samples as they are read.
    if (Crc32(0, checked) != BigEndian32(bytes.data() + 4) || bytes[2] != 0 || bytes[3] != 1) return;
    const int codes[4] = {bytes[0], bytes[1], bytes[2], bytes[3]};
    spec.attribute(kAttribute, kFourCodes, codes);
    return;
  }
}

void AddPngCodePoints(const OIIO::ImageSpec& spec, std::vector<uint8_t>& chunks) {
  const auto* const codes = spec.find_attribute(kAttribute, kFourCodes);
  if (codes == nullptr ||
      std::search(chunks.begin(), chunks.end(), kName.begin(), kName.end()) != chunks.end()) {
    return;
  }
  std::vector<uint8_t> chunk = {0, 0, 0, 4};
  chunk.insert(chunk.end(), kName.begin(), kName.end());
  for (int i = 0; i < 4; ++i) chunk.push_back(static_cast<uint8_t>(codes->get_int_indexed(i)));
  chunk.resize(chunk.size() + 4);
  SetBigEndian32(chunk.data() + 12, Crc32(0, std::span<const uint8_t>(chunk).subspan(4, 8)));
  const auto place = static_cast<ptrdiff_t>(sizeof kPngSignature + kHeaderChunk);
  chunks.insert(chunks.begin() + place, chunk.begin(), chunk.end());
}

}  // namespace tessera::io
