// The program's own way to stderr.
#include "cli/messages.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#include <sanitizer/common_interface_defs.h>
#endif

namespace tessera::cli {
namespace {

std::FILE*& Stream() {
  static std::FILE* stream = stderr;
  return stream;
}

// Null where the thread has none of its own.
std::FILE*& ThreadStream() {
  thread_local std::FILE* stream = nullptr;
  return stream;
}

std::atomic<int> descriptor = STDERR_FILENO;

}  // namespace

std::FILE* Messages() { return ThreadStream() != nullptr ? ThreadStream() : Stream(); }

int MessagesDescriptor() { return descriptor.load(); }

KeptMessages::KeptMessages(Of of)
    : kept_(of == Of::kAll ? Stream() : ThreadStream()),
      before_(kept_),
      stream_(open_memstream(&bytes_, &size_)) {
  if (stream_ == nullptr) throw std::bad_alloc();
  kept_ = stream_;
}

KeptMessages::~KeptMessages() {
  kept_ = before_;
  std::fclose(stream_);
  std::free(bytes_);
}

std::string KeptMessages::Text() const {
  std::fflush(stream_);
  return std::string(bytes_, size_);
}

std::string Printable(std::string_view text) {
  constexpr size_t kMost = 2000, kStart = 1400;
  std::string cut;
  if (text.size() > kMost) {
    size_t start = kStart, end = text.size() - (kMost - kStart);
    const auto continues = [&](size_t at) { return (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80; };
    for (int i = 0; i < 3 && continues(start); ++i) --start;
    for (int i = 0; i < 3 && continues(end); ++i) ++end;
    cut = std::string(text.substr(0, start)) + " [" + std::to_string(end - start) + " bytes] " +
          std::string(text.substr(end));
    text = cut;
  }
  std::string line;
  const auto escape = [&](unsigned char c) {
    char code[8];
    std::snprintf(code, sizeof code, "\\x%02x", c);
    line += code;
  };
  const auto byte = [&](size_t at) -> unsigned char { return at < text.size() ? text[at] : 0; };
  for (size_t i = 0; i < text.size();) {
    const unsigned char c = byte(i);
    const size_t length = c < 0x80                ? 1
                          : c >= 0xC2 && c < 0xE0 ? 2
                          : c >= 0xE0 && c < 0xF0 ? 3
                          : c >= 0xF0 && c < 0xF5 ? 4
                                                  : 0;
    bool whole = length > 0;
    for (size_t k = 1; k < length; ++k) whole &= (byte(i + k) & 0xC0) == 0x80;
    const bool c1 = c == 0xC2 && byte(i + 1) < 0xA0;
    if (c == '\n' || c == '\t' || c == '\r') {
      line += ' ', ++i;
    } else if (!whole || c < 0x20 || c == 0x7F) {
      escape(c), ++i;  // a byte that no character begins with is a C1 control to some terminals
    } else if (c1) {
      escape(byte(i + 1)), i += 2;
    } else {
      line += text.substr(i, length), i += length;
    }
  }
  return line;
}

void SilenceLibraries() {
  if (Stream() != stderr) return;
  const int own = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
  std::FILE* stream = own < 0 ? nullptr : fdopen(own, "w");
  if (stream != nullptr && nothing >= 0 && dup2(nothing, STDERR_FILENO) >= 0) {
    setvbuf(stream, nullptr, _IOLBF, BUFSIZ);
    Stream() = stream;
    descriptor.store(own);
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    __sanitizer_set_report_fd(reinterpret_cast<void*>(static_cast<intptr_t>(own)));
#endif
  }
  if (nothing >= 0) close(nothing);
}

}  // namespace tessera::cli
