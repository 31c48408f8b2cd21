// Messages, and descriptors beside them, between two processes.
#ifndef TESSERA_IO_SANDBOX_CHANNEL_H_
#define TESSERA_IO_SANDBOX_CHANNEL_H_

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace tessera::io::sandbox {

// Closed by whoever has it last.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  int number() const { return number_; }
  int Release() { return std::exchange(number_, -1); }

 private:
  int number_;
};

// Two connected ends; of numbers -1 where the system refuses.
std::pair<Descriptor, Descriptor> MakeSockets();

class Channel {
 public:
  enum class Received { kMessage, kEnd, kLate };

  explicit Channel(Descriptor socket) : socket_(std::move(socket)) {}

  // False where nobody is at the other end.
  bool Send(const std::string& bytes, const std::vector<int>& descriptors = {});
  // Waits so long for all of a message, for ever where that is infinite. Descriptors that nobody takes are
  // closed. kEnd for a message of an absurd size too.
  Received Receive(std::string& bytes, double seconds, std::vector<Descriptor>* descriptors = nullptr);

 private:
  Descriptor socket_;
};

// Memory of its own that both may write, and whose size neither can change.
class SharedMemory {
 public:
  // Throws std::bad_alloc.
  explicit SharedMemory(size_t bytes);
  SharedMemory(const Descriptor& descriptor, size_t bytes);
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  std::byte* data() const { return data_; }
  size_t size() const { return size_; }
  int descriptor() const { return descriptor_.number(); }

 private:
  void Map(int descriptor);

  Descriptor descriptor_;
  std::byte* data_ = nullptr;
  size_t size_;
};

}  // namespace tessera::io::sandbox

#endif  // TESSERA_IO_SANDBOX_CHANNEL_H_
