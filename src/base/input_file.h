// The one way in: every file that is parsed here, or given by its name to a library that parses it, is looked
// at here first.
#ifndef TESSERA_BASE_INPUT_FILE_H_
#define TESSERA_BASE_INPUT_FILE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <istream>
#include <streambuf>
#include <string>
#include <string_view>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// Of files that are read as they come, and of those that somebody keeps whole.
inline constexpr int64_t kAnySize = INT64_MAX;
inline constexpr int64_t kMostText = int64_t{1} << 29;
// Of a line of text: a curve of 2^18 numbers.
inline constexpr size_t kLongestLine = size_t{1} << 22;

// The size of a regular file that can be read. Throws Error naming it for what is missing, a directory, a
// pipe, socket or device (which may never end, or never begin), and for more than `most` bytes. `expected`:
// "a LUT that OpenColorIO reads".
int64_t RequireFile(const std::string& file, std::string_view expected, int64_t most = kAnySize);

// A stream of the same. It is the file that was looked at, whatever its name stands for by now, and ends
// after `most` bytes. Reading throws SystemError where the system cannot read, so that no end is mistaken.
class InputFile final : public std::istream {
 public:
  InputFile(const std::string& file, std::string_view expected, int64_t most = kAnySize);

  // What was found when it was opened.
  int64_t size() const { return buffer_.size; }
  // Of the file that was looked at; closed with the stream.
  int descriptor() const { return buffer_.descriptor; }

 private:
  struct Buffer final : std::streambuf {
    ~Buffer() override;
    int_type underflow() override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode mode) override;
    pos_type seekpos(pos_type to, std::ios_base::openmode mode) override;

    std::string file;
    int descriptor = -1;
    int64_t size = 0, most = 0;
    int64_t end = 0;  // where in the file the bytes held end
    std::array<char, 1 << 16> bytes;
  };
  Buffer buffer_;
};

// The next line without its end; false after the last. Throws Error of the file for one of more than `most`
// bytes.
bool GetLine(std::istream& stream, std::string& line, const std::string& file, int number,
             size_t most = kLongestLine);

// A word of a file as messages show it: short.
std::string Shown(std::string_view word);

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_INPUT_FILE_H_
