// What the program and a reader's process say to each other: numbers, texts, and descriptions of images. What
// a reader sends is held against its bytes: it may be in a stranger's hands.
#ifndef TESSERA_IO_SANDBOX_MESSAGE_H_
#define TESSERA_IO_SANDBOX_MESSAGE_H_

#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "tessera/image.h"

namespace tessera::io::sandbox {

// What is asked for. A reader answers each with an Answer.
enum class Ask : uint8_t {
  kOpen,     // file, options, what the policy lets in: header
  kNames,    // names of parts
  kDecoder,  // who decodes the pixels
  kRows,     // channels, and the Shape: from here on rows of these, into the memory that comes with it
  kLimit,    // threads and memory of these rows
  kRead,     // rows, from the beginning of that memory on
  kSlices,  // channels, type, and the Shape: from here on slices of these, into the memory that comes with it
  kSlice,   // slices, from the beginning of that memory on
};
enum class Answer : uint8_t { kDone, kError, kNoMemory };

// What rows depend on; the file may be another by the time that it is opened once more.
struct Shape {
  int x, y, width, height, depth, channels, tile_width, tile_height;
  PixelType type;
  bool operator==(const Shape&) const = default;
};
Shape ShapeOf(const OIIO::ImageSpec& spec);

class MessageWriter {
 public:
  template <typename T>
  MessageWriter& Put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  MessageWriter& PutText(std::string_view text) {
    Put<uint64_t>(text.size());
    bytes_.append(text);
    return *this;
  }
  MessageWriter& PutSpec(const OIIO::ImageSpec& spec);

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// Throws std::runtime_error for a message that is not as expected.
class MessageReader {
 public:
  explicit MessageReader(std::string_view bytes) : left_(bytes) {}

  template <typename T>
  T Get() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    std::memcpy(static_cast<void*>(&value), Take(sizeof value).data(), sizeof value);
    return value;
  }
  // Any value but 0 is true; a bool of another would be undefined.
  bool GetFlag() { return Get<uint8_t>() != 0; }
  std::string GetText() { return std::string(Take(Get<uint64_t>())); }
  OIIO::ImageSpec GetSpec();
  // So many things follow, each of `least` bytes or more.
  size_t GetCount(size_t least);

 private:
  std::string_view Take(uint64_t size);

  std::string_view left_;
};

}  // namespace tessera::io::sandbox

#endif  // TESSERA_IO_SANDBOX_MESSAGE_H_
