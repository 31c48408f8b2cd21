// Deflate streams that are joined, and where a stream of strangers ends: where libdeflate says.
#include <libdeflate.h>

#include "fuzz/fuzz.h"
#include "io/codec/deflate.h"
#include "io/codec/deflate_tail.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  for (const int level : {0, 1, 6, 9}) {
    for (const size_t size : {0, 1, 300, 3000}) {
      std::vector<uint8_t> bytes(size);
      base::Bytes packed;
      for (size_t i = 0; i < size; ++i)
        bytes[i] = static_cast<uint8_t>(i < size / 2 ? i / 9 : i * 2654435761u >> 7 & 31);
      io::Deflater(level).Segment(bytes, true, packed);
      seeds.push_back('s' + std::string(packed.begin(), packed.end()));
      seeds.push_back('p' + std::string{static_cast<char>(level), '\1'} +
                      std::string(bytes.begin(), bytes.end()));
    }
  }
  return seeds;
}
std::vector<std::string> Words() { return {std::string("\0\0\xff\xff", 4), std::string("\x03\0", 2)}; }
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static libdeflate_decompressor* const unpacker = libdeflate_alloc_decompressor();
  static std::vector<uint8_t> room(1 << 20);
  fuzz::Input in(data, size);
  size_t read = 0, written = 0;
  const auto unpack = [&](std::span<const uint8_t> stream) {
    return libdeflate_deflate_decompress_ex(unpacker, stream.data(), stream.size(), room.data(), room.size(),
                                            &read, &written) == LIBDEFLATE_SUCCESS;
  };
  const auto bytes_of = [](std::string_view text) {
    return std::span<const uint8_t>(reinterpret_cast<const uint8_t*>(text.data()), text.size());
  };
  if (in.Take<char>() == 'p') {
    io::Deflater packer(static_cast<int>(in.Below(13)));
    const size_t share = in.Take<uint8_t>();
    const auto bytes = bytes_of(in.Rest());
    const size_t first = bytes.size() * share / 256;
    base::Bytes packed;
    packer.Segment(bytes.first(first), false, packed);
    packer.Segment(bytes.subspan(first), true, packed);
    fuzz::Require(unpack(packed) && read == packed.size() && written == bytes.size() &&
                      std::equal(bytes.begin(), bytes.end(), room.begin()),
                  "a joined stream of other bytes");
    return 0;
  }
  const auto stream = bytes_of(in.Rest());
  const auto tail = io::FindDeflateTail(stream);
  if (!tail) return 0;
  fuzz::Require(tail->last_block < tail->end && tail->end <= 8 * stream.size(), "a tail beyond the stream");
  if (unpack(stream)) fuzz::Require((tail->end + 7) / 8 == read, "a tail that is not where the stream ends");
  return 0;
}
