// Sizes, times and hashes of files.
#include "cli/file_state.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

namespace tessera::cli {
namespace {

constexpr uint64_t kP1 = 0x9E3779B185EBCA87, kP2 = 0xC2B2AE3D27D4EB4F, kP3 = 0x165667B19E3779F9,
                   kP4 = 0x85EBCA77C2B2AE63, kP5 = 0x27D4EB2F165667C5;

// Little-endian, as the machines that this runs on are.
template <typename T>
uint64_t Load(const unsigned char* bytes) {
  T value = 0;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

uint64_t Round(uint64_t lane, uint64_t input) { return std::rotl(lane + input * kP2, 31) * kP1; }

}  // namespace

void Hash64::TakeStripe(const unsigned char* bytes) {
  for (size_t i = 0; i < 4; ++i) lanes_[i] = Round(lanes_[i], Load<uint64_t>(bytes + 8 * i));
}

void Hash64::Add(const void* data, size_t size) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  const size_t held = size_ % 32;
  size_ += size;
  if (held > 0) {
    const size_t more = std::min(size, 32 - held);
    std::memcpy(&rest_[held], bytes, more);
    bytes += more, size -= more;
    if (held + more < 32) return;
    TakeStripe(rest_.data());
  }
  for (; size >= 32; bytes += 32, size -= 32) TakeStripe(bytes);
  if (size > 0) std::memcpy(rest_.data(), bytes, size);
}

uint64_t Hash64::Value() const {
  uint64_t h = kP5;
  if (size_ >= 32) {
    h = std::rotl(lanes_[0], 1) + std::rotl(lanes_[1], 7) + std::rotl(lanes_[2], 12) +
        std::rotl(lanes_[3], 18);
    for (const uint64_t lane : lanes_) h = (h ^ Round(0, lane)) * kP1 + kP4;
  }
  h += size_;
  const unsigned char* bytes = rest_.data();
  const unsigned char* const end = bytes + size_ % 32;
  for (; end - bytes >= 8; bytes += 8) h = std::rotl(h ^ Round(0, Load<uint64_t>(bytes)), 27) * kP1 + kP4;
  for (; end - bytes >= 4; bytes += 4) h = std::rotl(h ^ Load<uint32_t>(bytes) * kP1, 23) * kP2 + kP3;
  for (; bytes < end; ++bytes) h = std::rotl(h ^ *bytes * kP5, 11) * kP1;
  h = (h ^ h >> 33) * kP2;
  h = (h ^ h >> 29) * kP3;
  return h ^ h >> 32;
}

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
