// What a reader's process may do from here on: read one file, write into memory, speak on one socket, compute
// on its own threads, end.
#ifndef TESSERA_IO_SANDBOX_CONFINE_H_
#define TESSERA_IO_SANDBOX_CONFINE_H_

#include <cstdint>
#include <string>

namespace tessera::io::sandbox {

struct ChildLimits {
  int64_t memory = INT64_MAX;  // bytes of its own
  double cpu_seconds = 1e9;
};

// The socket's number in a process that is confined.
inline constexpr int kSocket = 3;

// Why this build or system cannot confine a process; empty where it can.
std::string WhyNotConfined();

// Before anything else of a process: closes all descriptors but these two, of which the socket becomes
// kSocket. Readers ask for files by name; from Confine on `file` is the one name that there is, and opens the
// descriptor `input`, as often as readers like. Any other name is absent. What else a process could ask the
// system for ends it (SIGSYS). Throws std::runtime_error, to be taken for what it is: not confined.
void KeepTwo(int& socket, int& input);
void Confine(const std::string& file, int input, const ChildLimits& limits);

}  // namespace tessera::io::sandbox

#endif  // TESSERA_IO_SANDBOX_CONFINE_H_
