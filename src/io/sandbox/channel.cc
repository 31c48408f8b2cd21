// Sockets of the system, and memory that has a descriptor.
#include "io/sandbox/channel.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

namespace tessera::io::sandbox {
namespace {

using Clock = std::chrono::steady_clock;

// Profiles and thumbnails are in it, and what an EXR file declares.
constexpr uint64_t kLargestMessage = uint64_t{1} << 28;
constexpr size_t kMostDescriptors = 4;

struct alignas(cmsghdr) Control {
  std::array<char, CMSG_SPACE(kMostDescriptors * sizeof(int))> bytes{};
};

// Whether something can be received before the time is over.
bool WaitFor(int socket, Clock::time_point until) {
  for (;;) {
    const double left = std::chrono::duration<double, std::milli>(until - Clock::now()).count();
    pollfd wait{socket, POLLIN, 0};
    const int found = ::poll(&wait, 1, static_cast<int>(std::clamp(std::ceil(left), 0.0, 1e9)));
    if (found > 0) return true;
    if (found == 0 && Clock::now() >= until) return false;
    if (found < 0 && errno != EINTR) return true;  // receiving will say what it is
  }
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

std::pair<Descriptor, Descriptor> MakeSockets() {
  std::array<int, 2> ends = {-1, -1};
  ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data());  // -1 where the system refuses
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

bool Channel::Send(const std::string& bytes, const std::vector<int>& descriptors) {
  const uint64_t size = bytes.size();
  std::string all(reinterpret_cast<const char*>(&size), sizeof size);
  all += bytes;
  Control control;
  for (size_t done = 0; done < all.size();) {
    iovec part{all.data() + done, all.size() - done};
    msghdr message{};
    message.msg_iov = &part, message.msg_iovlen = 1;
    if (done == 0 && !descriptors.empty()) {
      const size_t length = descriptors.size() * sizeof(int);
      message.msg_control = control.bytes.data(), message.msg_controllen = CMSG_SPACE(length);
      cmsghdr* const header = CMSG_FIRSTHDR(&message);
      header->cmsg_level = SOL_SOCKET, header->cmsg_type = SCM_RIGHTS, header->cmsg_len = CMSG_LEN(length);
      std::memcpy(CMSG_DATA(header), descriptors.data(), length);
    }
    const ssize_t sent = ::sendmsg(socket_.number(), &message, MSG_NOSIGNAL);
    if (sent < 0 && errno != EINTR) return false;
    done += static_cast<size_t>(std::max<ssize_t>(sent, 0));
  }
  return true;
}

Channel::Received Channel::Receive(std::string& bytes, double seconds, std::vector<Descriptor>* descriptors) {
  const bool waits = seconds < 1e8;
  const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(waits ? std::max(seconds, 0.0) : 0.0));
  std::vector<Descriptor> came;
  uint64_t size = 0;
  char* to = reinterpret_cast<char*>(&size);
  bool begun = false;  // the message itself, behind its size
  for (size_t left = sizeof size;;) {
    if (waits && !WaitFor(socket_.number(), until)) return Received::kLate;
    iovec part{to, left};
    Control control;
    msghdr message{};
    message.msg_iov = &part, message.msg_iovlen = 1;
    message.msg_control = control.bytes.data(), message.msg_controllen = control.bytes.size();
    const ssize_t count = ::recvmsg(socket_.number(), &message, MSG_CMSG_CLOEXEC);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Received::kEnd;
    for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
         header = CMSG_NXTHDR(&message, header)) {
      if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS) continue;
      for (size_t at = 0; CMSG_LEN(at + sizeof(int)) <= header->cmsg_len; at += sizeof(int)) {
        int number = -1;
        std::memcpy(&number, CMSG_DATA(header) + at, sizeof number);
        came.emplace_back(number);
      }
    }
    to += count, left -= static_cast<size_t>(count);
    if (left > 0) continue;
    if (begun || size == 0) break;
    if (size > kLargestMessage) return Received::kEnd;
    bytes.resize(size);
    to = bytes.data(), left = size, begun = true;
  }
  if (!begun) bytes.clear();
  if (descriptors != nullptr) *descriptors = std::move(came);
  return Received::kMessage;
}

SharedMemory::SharedMemory(size_t bytes) : size_(bytes) {
#ifdef __linux__
  descriptor_ = Descriptor(::memfd_create("tessera rows", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  // Whoever made it smaller would take memory from under the other's feet.
  if (descriptor_.number() < 0 || ::ftruncate(descriptor_.number(), static_cast<off_t>(bytes)) != 0 ||
      ::fcntl(descriptor_.number(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    throw std::bad_alloc();
#endif
  Map(descriptor_.number());
}

SharedMemory::SharedMemory(const Descriptor& descriptor, size_t bytes) : size_(bytes) {
  Map(descriptor.number());
}

void SharedMemory::Map(int descriptor) {
  void* const mapped = ::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  if (mapped == MAP_FAILED) throw std::bad_alloc();
  data_ = static_cast<std::byte*>(mapped);
}

SharedMemory::~SharedMemory() { ::munmap(data_, size_); }

}  // namespace tessera::io::sandbox
