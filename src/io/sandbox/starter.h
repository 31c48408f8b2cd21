// Who starts readers' processes: a copy of the program as it was at its start, with one thread, which copies
// itself whenever it is asked. (A program that has threads cannot copy itself and then do anything useful.)
#ifndef TESSERA_IO_SANDBOX_STARTER_H_
#define TESSERA_IO_SANDBOX_STARTER_H_

#include <memory>
#include <string>

#include "io/sandbox/channel.h"
#include "io/sandbox/confine.h"

namespace tessera::io::sandbox {

// A reader's process, which ends with it.
class Child {
 public:
  Child(int pid, Channel channel) : pid_(pid), channel_(std::move(channel)) {}
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  Channel& channel() { return channel_; }
  // Ends it where it has not ended by itself, and says how that was: "crashed (signal 11, ...)". Where it
  // wants libraries that are loaded on demand, they are, which does not return.
  std::string End();

 private:
  int pid_;
  Channel channel_;
};

// Throws SystemError about the file where there is none to be had.
std::unique_ptr<Child> StartChild(const std::string& file, int input, const ChildLimits& limits);

// What such a process does: answers on the socket, about the file.
[[noreturn]] void RunChild(int socket, int input, const ChildLimits& limits);

}  // namespace tessera::io::sandbox

#endif  // TESSERA_IO_SANDBOX_STARTER_H_
