// What a file was at a moment: for records of what was made from what.
#ifndef TESSERA_CLI_FILE_STATE_H_
#define TESSERA_CLI_FILE_STATE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace tessera::cli {

// XXH64 with seed 0, which `xxhsum -H1` prints, over bytes that come in any pieces. It finds what was torn or
// altered; it is no defence against who wants two files to have the same.
class Hash64 {
 public:
  Hash64();
  ~Hash64();
  void Add(const void* bytes, size_t size);
  uint64_t Value() const;
  // 16 hexadecimal digits.
  std::string Text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};
std::string HashOf(std::string_view text);

// A regular file as it was.
struct FileState {
  std::string name;
  int64_t size = 0;
  int64_t time = 0;  // of its last change, nanoseconds since 1970 as the file system keeps them
  bool operator==(const FileState&) const = default;
};
// Empty where there is none.
std::optional<FileState> StateOf(const std::string& file);

// The size and the hash of what is in it; empty where it cannot be read.
struct FileContent {
  int64_t size = 0;
  std::string hash;
  bool operator==(const FileContent&) const = default;
};
std::optional<FileContent> ContentOf(const std::string& file);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FILE_STATE_H_
