// Sizes, times and hashes of files.
#include "cli/file_state.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

// Its functions come with the header: nothing more is loaded.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <vector>

namespace tessera::cli {

struct Hash64::State {
  XXH64_state_t xxh;
};

Hash64::Hash64() : state_(std::make_unique<State>()) { XXH64_reset(&state_->xxh, 0); }
Hash64::~Hash64() = default;
void Hash64::Add(const void* bytes, size_t size) { XXH64_update(&state_->xxh, bytes, size); }
uint64_t Hash64::Value() const { return XXH64_digest(&state_->xxh); }

std::string Hash64::Text() const {
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(Value()));
  return digits.data();
}

std::string HashOf(std::string_view text) {
  Hash64 hash;
  hash.Add(text.data(), text.size());
  return hash.Text();
}

std::optional<FileState> StateOf(const std::string& file) {
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return std::nullopt;
  return FileState{file, found.st_size, int64_t{found.st_mtim.tv_sec} * 1000000000 + found.st_mtim.tv_nsec};
}

std::optional<FileContent> ContentOf(const std::string& file) {
  // A pipe of that name would never be opened.
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return std::nullopt;
  struct stat found {};
  bool whole = ::fstat(descriptor, &found) == 0 && S_ISREG(found.st_mode);
  FileContent content;
  Hash64 hash;
  std::vector<char> block(size_t{1} << 18);
  while (whole) {
    const ssize_t count = ::read(descriptor, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    whole = count >= 0;
    if (count <= 0) break;
    hash.Add(block.data(), static_cast<size_t>(count));
    content.size += count;
  }
  ::close(descriptor);
  if (!whole) return std::nullopt;
  content.hash = hash.Text();
  return content;
}

}  // namespace tessera::cli
