// Reads and writes that other signals interrupt, of streams that may be set not to wait.
#include "cli/batch_streams.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include "cli/signals.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

[[noreturn]] void Fail(const char* what, const char* why, int code) {
  throw SystemError(what, std::string(why) + ": " + std::error_code(code, std::generic_category()).message());
}

}  // namespace

bool Again(int descriptor, short events) {
  if (errno == EINTR) return true;
  if (errno != EAGAIN && errno != EWOULDBLOCK) return false;
  pollfd wait{descriptor, events, 0};
  ::poll(&wait, 1, -1);
  return true;
}

int Take(int stream, const char* name, int flags) {
  const int own = ::fcntl(stream, F_DUPFD_CLOEXEC, 3);
  if (own < 0) Fail(name, "cannot be used", errno);
  const int nothing = ::open("/dev/null", flags | O_CLOEXEC);
  if (nothing < 0 || ::dup2(nothing, stream) < 0) Fail(name, "cannot be used", errno);
  ::close(nothing);
  return own;
}

bool Lines::Held(std::string& line) {
  const auto end = std::find(held_.begin() + static_cast<std::ptrdiff_t>(next_), held_.end(), '\n');
  const size_t count = static_cast<size_t>(end - held_.begin()) - next_;
  line_.append(held_, next_, std::min(count, kLongestLine + 1 - std::min(line_.size(), kLongestLine + 1)));
  next_ += count;
  if (end != held_.end()) {
    ++next_;
  } else if (!ended_ || line_.empty()) {
    return false;
  }
  line = std::exchange(line_, {});
  return true;
}

bool Lines::Fill() {
  held_.resize(size_t{1} << 16), next_ = 0;
  ssize_t count = 0;
  do count = ::read(descriptor_, held_.data(), held_.size());
  while (count < 0 && Again(descriptor_, POLLIN));
  if (count < 0) Fail("standard input", "cannot be read", errno);
  held_.resize(static_cast<size_t>(count));
  ended_ = count == 0;
  return !ended_;
}

bool Lines::Next(std::string& line) {
  while (!Held(line)) {
    if (ended_) return false;
    Fill();
  }
  return true;
}

void WriteAll(int descriptor, const std::string& text) {
  for (size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(descriptor, text.data() + done, text.size() - done);
    if (count >= 0) {
      done += static_cast<size_t>(count);
    } else if (!Again(descriptor, POLLOUT)) {
      // Who reads the answers has gone. Where SIGPIPE is not ignored it was the end already.
      if (errno == EPIPE) EndBySignal(SIGPIPE);
      Fail("standard output", "cannot be written", errno);
    }
  }
}

}  // namespace tessera::cli
