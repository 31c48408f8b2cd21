// The loop of --batch: what a job prints is kept for its answer, what it sets ends with it.
#include "cli/batch.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <system_error>

#include "cli/batch_job.h"
#include "cli/messages.h"
#include "cli/outcome.h"
#include "cli/signals.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

constexpr size_t kLongestLine = size_t{1} << 20;

[[noreturn]] void Fail(const char* what, const char* why, int code) {
  throw SystemError(what, std::string(why) + ": " + std::error_code(code, std::generic_category()).message());
}

// True where the call may be made again.
bool Again(int descriptor, short events) {
  if (errno == EINTR) return true;
  if (errno != EAGAIN && errno != EWOULDBLOCK) return false;
  pollfd wait{descriptor, events, 0};
  ::poll(&wait, 1, -1);
  return true;
}

// A descriptor of our own for the stream, which is /dev/null from here on: libraries print to stdout, and
// lines may name /dev/stdin.
int Take(int stream, const char* name, int flags) {
  const int own = ::fcntl(stream, F_DUPFD_CLOEXEC, 3);
  if (own < 0) Fail(name, "cannot be used", errno);
  const int nothing = ::open("/dev/null", flags | O_CLOEXEC);
  if (nothing < 0 || ::dup2(nothing, stream) < 0) Fail(name, "cannot be used", errno);
  ::close(nothing);
  return own;
}

class Lines {
 public:
  explicit Lines(int descriptor) : descriptor_(descriptor) {}

  // The next line, whether a newline ends it or the stream; false at the end. Of one that is too long the
  // start.
  bool Next(std::string& line) {
    line.clear();
    for (;;) {
      const auto end = std::find(held_.begin() + static_cast<std::ptrdiff_t>(next_), held_.end(), '\n');
      const size_t count = static_cast<size_t>(end - held_.begin()) - next_;
      line.append(held_, next_, std::min(count, kLongestLine + 1 - std::min(line.size(), kLongestLine + 1)));
      next_ += count;
      if (end != held_.end()) return ++next_, true;
      if (!Fill()) return !line.empty();
    }
  }

 private:
  bool Fill() {
    held_.resize(size_t{1} << 16), next_ = 0;
    ssize_t count = 0;
    do count = ::read(descriptor_, held_.data(), held_.size());
    while (count < 0 && Again(descriptor_, POLLIN));
    if (count < 0) Fail("standard input", "cannot be read", errno);
    held_.resize(static_cast<size_t>(count));
    return count > 0;
  }

  int descriptor_;
  std::string held_;
  size_t next_ = 0;
};

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

// While one lives, std::cout is kept.
class KeptOutput {
 public:
  KeptOutput() : before_(std::cout.rdbuf(text_.rdbuf())) { format_.copyfmt(std::cout); }
  ~KeptOutput() {
    std::cout.rdbuf(before_);  // which clears its state
    std::cout.copyfmt(format_);
  }
  KeptOutput(const KeptOutput&) = delete;
  KeptOutput& operator=(const KeptOutput&) = delete;

  std::string Text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::ios format_{nullptr};
  std::streambuf* before_;
};

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double Microseconds(double seconds) { return std::round(seconds * 1e6) / 1e6; }

// Runs the job of a line; the answer without its newline.
std::string Answer(int64_t number, const std::string& line, const std::vector<std::string>& common,
                   const RunLine& run) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const double cpu = CpuSeconds();
  KeptOutput output;
  KeptMessages messages;
  Job job;
  std::vector<std::string> written;
  Outcome outcome = Attempt([&] {
    if (line.size() > kLongestLine) {
      throw DataError("job", "found a line of more than " + std::to_string(kLongestLine) + " bytes");
    }
    job = ParseJob(line);
    std::vector<std::string> words = common;
    words.insert(words.end(), job.words.begin(), job.words.end());
    return run(words, written);
  });
  if (const int signal = SignalsEndJob::Asked(); signal != 0 && outcome.kind == "cancelled") {
    outcome.code = 128 + signal;
    outcome.message = "ended by signal " + std::to_string(signal);
  }
  if (outcome.kind == "system") Context::Default().Release();  // memory, perhaps

  nlohmann::ordered_json answer;
  answer["job"] = number;
  if (!job.id.empty()) answer["id"] = nlohmann::ordered_json::parse(job.id);
  answer["ok"] = outcome.code == kDone;
  answer["exit_code"] = outcome.code;
  if (!outcome.kind.empty()) {
    answer["error"] = {{"kind", outcome.kind}, {"message", Printable(outcome.message)}};
  } else if (outcome.code != kDone) {
    answer["error"] = {{"kind", "result"}, {"message", "the line's own verdict, see output and messages"}};
  }
  answer["outputs"] = written;
  answer["seconds"] = Microseconds(std::chrono::duration<double>(Clock::now() - start).count());
  answer["cpu_seconds"] = Microseconds(CpuSeconds() - cpu);
  answer["output"] = output.Text();
  answer["messages"] = messages.Text();
  return answer.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

bool IsBatch(const std::string& word) { return word == "-batch" || word == "--batch"; }

}  // namespace

bool AsksForBatch(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), IsBatch);
}

int RunBatch(const std::vector<std::string>& words, const RunLine& run) {
  std::vector<std::string> common = words;
  std::erase_if(common, IsBatch);
  Lines lines(Take(STDIN_FILENO, "standard input", O_RDONLY));
  const int answers = Take(STDOUT_FILENO, "standard output", O_WRONLY);
  std::string line;
  for (int64_t number = 1; lines.Next(line); ++number) {
    if (!IsJob(line)) continue;
    const SignalsEndJob wait;
    WriteAll(answers, Answer(number, line, common, run) + "\n");
  }
  return kDone;
}

}  // namespace tessera::cli
