// A file's bytes.
#ifndef TESSERA_IO_CODEC_WHOLE_FILE_H_
#define TESSERA_IO_CODEC_WHOLE_FILE_H_

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "base/bytes.h"

namespace tessera::io {

// Empty for a file that cannot be read, or that has more than `most` bytes.
inline std::optional<base::Bytes> WholeFile(const std::string& file, size_t most) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!stream || ::fseeko(stream.get(), 0, SEEK_END) != 0) return std::nullopt;
  const auto size = static_cast<size_t>(::ftello(stream.get()));
  if (size > most || ::fseeko(stream.get(), 0, SEEK_SET) != 0) return std::nullopt;
  base::Bytes bytes(size);
  if (std::fread(bytes.data(), 1, size, stream.get()) != size) return std::nullopt;
  return bytes;
}

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_WHOLE_FILE_H_
