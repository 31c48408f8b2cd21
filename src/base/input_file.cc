// Regular files, looked at through the descriptor that is read.
#include "base/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::base {
namespace {

std::string Reason(int code) { return std::error_code(code, std::generic_category()).message(); }

// O_NONBLOCK: a pipe that nobody writes to opens at once.
int OpenRegular(const std::string& file, std::string_view expected, int64_t most, int64_t& size) {
  const std::string wanted = ", expected " + std::string(expected);
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
  if (descriptor < 0) {
    const int code = errno;
    if (code == ENOENT || code == ENOTDIR || file.empty())
      throw DataError(Shown(file), "no such file" + wanted);
    if (code == ENXIO) throw SystemError(file, "found a device, pipe or socket" + wanted);
    throw SystemError(Shown(file), "cannot be read: " + Reason(code));
  }
  struct stat found;
  const int code = ::fstat(descriptor, &found) == 0 ? 0 : errno;
  size = found.st_size;
  if (code == 0 && S_ISREG(found.st_mode) && size <= most) return descriptor;
  ::close(descriptor);
  if (code != 0) throw SystemError(file, "cannot be read: " + Reason(code));
  if (S_ISDIR(found.st_mode)) throw DataError(file, "found a directory" + wanted);
  if (!S_ISREG(found.st_mode)) throw SystemError(file, "found a device, pipe or socket" + wanted);
  throw DataError(file, "found " + std::to_string(size) + " bytes" + wanted + " of at most " +
                            std::to_string(most) + " bytes");
}

}  // namespace

int64_t RequireFile(const std::string& file, std::string_view expected, int64_t most) {
  int64_t size = 0;
  ::close(OpenRegular(file, expected, most, size));
  return size;
}

InputFile::InputFile(const std::string& file, std::string_view expected, int64_t most)
    : std::istream(nullptr) {
  buffer_.descriptor = OpenRegular(file, expected, most, buffer_.size);
  buffer_.file = file;
  buffer_.most = most;
  rdbuf(&buffer_);
  exceptions(std::ios_base::badbit);  // what the buffer throws
}

InputFile::Buffer::~Buffer() {
  if (descriptor >= 0) ::close(descriptor);
}

InputFile::Buffer::int_type InputFile::Buffer::underflow() {
  if (gptr() < egptr()) return traits_type::to_int_type(*gptr());
  const auto wanted = static_cast<size_t>(std::min<int64_t>(std::ssize(bytes), most - end));
  ssize_t read = 0;
  do read = wanted > 0 ? ::pread(descriptor, bytes.data(), wanted, end) : 0;
  while (read < 0 && errno == EINTR);
  if (read < 0) throw SystemError(file, "cannot be read: " + Reason(errno));
  if (read == 0) return traits_type::eof();
  end += read;
  setg(bytes.data(), bytes.data(), bytes.data() + read);
  return traits_type::to_int_type(bytes[0]);
}

InputFile::Buffer::pos_type InputFile::Buffer::seekoff(off_type offset, std::ios_base::seekdir from,
                                                       std::ios_base::openmode mode) {
  const int64_t here = end - (egptr() - gptr());
  if (from == std::ios_base::cur && offset == 0) return here;
  const int64_t start = from == std::ios_base::beg ? 0 : from == std::ios_base::cur ? here : size;
  return seekpos(start + offset, mode);
}

InputFile::Buffer::pos_type InputFile::Buffer::seekpos(pos_type to, std::ios_base::openmode) {
  if (to < 0) return pos_type(off_type{-1});
  const int64_t first = end - (egptr() - eback());
  if (to >= first && to < end) {  // what is held is not read again
    setg(eback(), eback() + (to - first), egptr());
    return to;
  }
  setg(nullptr, nullptr, nullptr);
  end = to;
  return to;
}

bool GetLine(std::istream& stream, std::string& line, const std::string& file, int number, size_t most) {
  line.clear();
  std::streambuf& bytes = *stream.rdbuf();
  for (int c = bytes.sbumpc();; c = bytes.sbumpc()) {
    if (c == std::char_traits<char>::eof()) {
      stream.setstate(line.empty() ? std::ios_base::eofbit | std::ios_base::failbit : std::ios_base::eofbit);
      return !line.empty();
    }
    if (c == '\n') return true;
    if (line.size() == most) {
      throw DataError(file, "line " + std::to_string(number) + ": found more than " + std::to_string(most) +
                                " bytes, expected a shorter line");
    }
    line += static_cast<char>(c);
  }
}

std::string Shown(std::string_view word) {
  constexpr size_t kMost = 80;
  return word.size() <= kMost ? std::string(word) : std::string(word.substr(0, kMost)) + "…";
}

}  // namespace tessera::base
