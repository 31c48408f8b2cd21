// Temporary names, their removal from signal handlers, and the stream that remembers failures.
#include "io/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "base/file_names.h"
#include "base/stale_files.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"

namespace tessera {
namespace io {
namespace {

base::FileNames& Unfinished() { return Context::Default().files(); }

std::string Reason(int code) { return std::error_code(code, std::generic_category()).message(); }

// Every name on the way, from the root or the directory that the program runs in.
void RequireNoLinks(const std::string& file) {
  std::filesystem::path way;
  for (const auto& part : std::filesystem::path(file)) {
    way /= part;
    std::error_code code;
    if (!std::filesystem::is_symlink(std::filesystem::symlink_status(way, code))) continue;
    throw DataError(file,
                    "found the symbolic link " + way.string() + ", expected none on the way to an output");
  }
}

}  // namespace

std::string ResolveTarget(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code code;
  fs::path path(file);
  if (!Context::Default().policy().output_links) RequireNoLinks(file);
  if (fs::is_symlink(fs::symlink_status(path, code))) {
    const fs::path real = fs::weakly_canonical(path, code);
    if (!code) path = real;
  }
  const auto type = fs::status(path, code).type();
  if (type == fs::file_type::directory) throw DataError(file, "found a directory, expected a file to write");
  if (type != fs::file_type::not_found && type != fs::file_type::regular && type != fs::file_type::none) {
    throw DataError(file, "found a device or pipe, expected a file to write");
  }
  if (type == fs::file_type::regular && ::access(path.c_str(), W_OK) != 0) {
    throw SystemError(file, "cannot be written: " + Reason(errno));
  }
  return path.string();
}

void RequireDirectory(const std::string& target, const std::string& shown) {
  const auto directory = std::filesystem::path(target).parent_path();
  std::error_code code;
  if (!directory.empty() && !std::filesystem::exists(directory, code)) {
    throw DataError(shown, "cannot be written: no directory " + directory.string());
  }
  if (::access(directory.empty() ? "." : directory.c_str(), W_OK | X_OK) != 0)
    throw SystemError(shown, "cannot be written: " + Reason(errno));
}

std::string CreateTemporary(const std::string& target, const std::string& shown) {
  const std::filesystem::path path(target);
  const auto directory = path.parent_path();
  RequireDirectory(target, shown);
  // Names are limited to 255 bytes; the stem is only there for the eye.
  const std::string stem = path.stem().string().substr(0, 100);
  base::SweepBeside(target);
  for (;;) {
    // Not const: what is returned is moved, and a copy for which there is no memory would leave the file.
    std::string name = (directory / ("." + stem + base::TemporaryMark() + std::to_string(::getpid()) + "-" +
                                     std::to_string(Unfinished().Next()) + path.extension().string()))
                           .string();
    const base::FileNames::Step step(Unfinished());
    Unfinished().Remember(name);
    const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) {
      ::close(descriptor);
      return name;
    }
    const int error = errno;
    Unfinished().Forget(name);
    if (error != EEXIST) throw SystemError(shown, "cannot be written: " + Reason(error));
  }
}

void RemoveTemporary(const std::string& temporary) noexcept {
  if (temporary.empty()) return;
  ::unlink(temporary.c_str());
  Unfinished().Forget(temporary);
}

int GrowthFailure(const std::string& name) {
  const int descriptor = ::open(name.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  static constexpr std::array<char, 1 << 16>
      kMore{};  // more than the buffer whose last write may have been lost
  const off_t size = ::lseek(descriptor, 0, SEEK_END);
  int failure = size < 0 ? errno : 0;
  if (failure == 0) {
    const ssize_t done = ::write(descriptor, kMore.data(), kMore.size());
    if (done < 0)
      failure = errno;
    else if (done < static_cast<ssize_t>(kMore.size()))
      failure = ENOSPC;
    if (::ftruncate(descriptor, size) != 0 && failure == 0) failure = errno;
  }
  if (::close(descriptor) != 0 && failure == 0) failure = errno;
  return failure;
}

CheckedFile::CheckedFile(const std::string& name)
    // Not "w": of a file that was cut off, if only to the nothing it was, ext4 waits for the disk when it is
    // closed.
    : IOProxy(name, Write), file_(std::fopen(name.c_str(), "r+b")) {
  if (!file_) {
    failure_ = errno;
    m_mode = Closed;
  }
}

CheckedFile::~CheckedFile() { CheckedFile::close(); }

void CheckedFile::Note(bool ok) const {
  if (!ok && failure_ == 0) failure_ = errno ? errno : EIO;
}

void CheckedFile::close() {
  const std::lock_guard lock(mutex_);
  if (!file_) return;
  Note(std::fflush(file_) == 0);
  Note(std::fclose(file_) == 0);
  file_ = nullptr;
  m_mode = Closed;
}

bool CheckedFile::seek(int64_t offset) {
  const std::lock_guard lock(mutex_);
  if (!file_) return false;
  Note(::fseeko(file_, offset, SEEK_SET) == 0);
  return true;
}

int64_t CheckedFile::tell() {
  const std::lock_guard lock(mutex_);
  return file_ ? ::ftello(file_) : -1;
}

size_t CheckedFile::read(void* buffer, size_t size) {
  const std::lock_guard lock(mutex_);
  if (!file_) return 0;
  const size_t done = std::fread(buffer, 1, size, file_);
  Note(done == size || !std::ferror(file_));  // what waits to be written goes first
  return done;
}

size_t CheckedFile::write(const void* buffer, size_t size) {
  const std::lock_guard lock(mutex_);
  if (file_ && failure_ == 0 && size > 0) Note(std::fwrite(buffer, 1, size, file_) == size);
  return size;
}

size_t CheckedFile::pread(void* buffer, size_t size, int64_t offset) {
  const std::lock_guard lock(mutex_);
  const int64_t here = tell();
  const size_t done = seek(offset) ? read(buffer, size) : 0;
  seek(here);
  return done;
}

size_t CheckedFile::pwrite(const void* buffer, size_t size, int64_t offset) {
  const std::lock_guard lock(mutex_);
  const int64_t here = tell();
  const size_t done = seek(offset) ? write(buffer, size) : 0;
  seek(here);
  return done;
}

size_t CheckedFile::size() const {
  const std::lock_guard lock(mutex_);
  struct stat now;
  if (!file_) return 0;
  Note(std::fflush(file_) == 0);
  if (::fstat(::fileno(file_), &now) != 0) return 0;
  return static_cast<size_t>(now.st_size);
}

void CheckedFile::flush() const {
  const std::lock_guard lock(mutex_);
  if (file_) Note(std::fflush(file_) == 0);
}

}  // namespace io

void RemoveUnfinishedOutputs() {
  std::array<const char*, 16> folders;  // that some of the files are in
  size_t count = 0;
  Context::Default().files().TakeEach([&](const char* name) {
    if (::unlink(name) != 0 && errno == EISDIR && count < folders.size()) folders[count++] = name;
  });
  for (size_t i = 0; i < count; ++i) ::rmdir(folders[i]);
}

}  // namespace tessera
