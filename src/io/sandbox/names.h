// The one name that opens something in a confined process.
#ifndef TESSERA_IO_SANDBOX_NAMES_H_
#define TESSERA_IO_SANDBOX_NAMES_H_

#include <string>

namespace tessera::io::sandbox {

// Numbers of the descriptors that readers are given when they open the name: each with its own place in the
// file, so each opened before. No other descriptor has a number among these.
inline constexpr int kFirstOpened = 64, kOpened = 32;  // powers of two

// Opens them, and has calls of the system that are trapped (open, stat, access, close of these descriptors)
// answered here. Throws std::runtime_error.
void AnswerNames(const std::string& file, int input);

}  // namespace tessera::io::sandbox

#endif  // TESSERA_IO_SANDBOX_NAMES_H_
