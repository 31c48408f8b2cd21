// Workers are this program with --batch: what a job sets is a process's own, and so is a crash. Here lines
// are handed to those that have none, and answers put back into the lines' order.
#include "cli/batch_workers.h"

#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "cli/batch_job.h"
#include "cli/messages.h"
#include "cli/outcome.h"
#include "cli/signals.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

[[noreturn]] void Fail(const char* why, int code) {
  throw SystemError("--batch",
                    std::string(why) + ": " + std::error_code(code, std::generic_category()).message());
}

// A job that was handed out, or whose answer waits for those before it.
struct Asked {
  int64_t number = 0;
  std::string id;  // JSON text, or empty
  std::optional<std::string> answer;
};

std::string IdOf(const std::string& line) try { return ParseJob(line).id; } catch (const std::exception&) {
  return "";  // the worker says what is wrong with it
}

// What the worker would have said of it.
std::string AnswerOfCrash(const Asked& job, int status) {
  nlohmann::ordered_json answer;
  answer["job"] = job.number;
  if (!job.id.empty()) answer["id"] = nlohmann::ordered_json::parse(job.id);
  const bool signal = WIFSIGNALED(status);
  answer["ok"] = false;
  answer["exit_code"] = signal ? 128 + WTERMSIG(status) : std::max(1, WEXITSTATUS(status));
  const std::string end = signal ? "signal " + std::to_string(WTERMSIG(status))
                                 : "exit code " + std::to_string(WEXITSTATUS(status));
  answer["error"] = {{"kind", "internal"}, {"message", "the process that ran it ended with " + end}};
  answer["outputs"] = nlohmann::ordered_json::array();
  answer["seconds"] = answer["cpu_seconds"] = 0;
  answer["output"] = answer["messages"] = "";
  return answer.dump();
}

class Worker {
 public:
  explicit Worker(std::vector<std::string> words) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) Fail("no socket", errno);
    socket_ = ends[0];
    lines_ = std::make_unique<Lines>(socket_);
    std::array<char, 4096> program{};
    if (::readlink("/proc/self/exe", program.data(), program.size() - 1) <= 0) Fail("no program", errno);
    std::vector<char*> argv = {program.data()};
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, MessagesDescriptor(), STDERR_FILENO);
    const int code = ::posix_spawn(&process_, program.data(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    if (code != 0) Fail("a process cannot be started", code);
  }
  ~Worker() { End(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // Whoever has died is noticed where its answer is read.
  void Give(const std::string& line, Asked* job) {
    job_ = job;
    const std::string text = line + "\n";
    for (size_t done = 0; done < text.size();) {
      const ssize_t count = ::send(socket_, text.data() + done, text.size() - done, MSG_NOSIGNAL);
      if (count < 0 && errno != EINTR) return;
      done += static_cast<size_t>(std::max<ssize_t>(count, 0));
    }
  }

  // When there is something to read; false for a worker that has ended.
  bool Listen() {
    const bool lives = Read();
    std::string text;
    while (job_ != nullptr && lines_->Held(text)) {
      // {"job":17,... with the number that it has here.
      const std::string number = "{\"job\":" + std::to_string(job_->number);
      job_->answer = number + text.substr(std::min(text.find_first_of(",}"), text.size()));
      job_ = nullptr;
    }
    if (lives) return true;
    const int status = End();
    if (job_ != nullptr) job_->answer = AnswerOfCrash(*job_, status);
    job_ = nullptr;
    return false;
  }

  void Signal(int signal) const { ::kill(process_, signal); }
  bool idle() const { return job_ == nullptr; }
  int socket() const { return socket_; }

 private:
  bool Read() try { return lines_->Fill(); } catch (const Error&) {
    return false;  // a connection that was reset
  }
  // It ends where its lines do.
  int End() {
    if (socket_ < 0) return 0;
    ::close(socket_);
    socket_ = -1;
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
  }

  int socket_ = -1;
  pid_t process_ = -1;
  std::unique_ptr<Lines> lines_;
  Asked* job_ = nullptr;
};

class Workers {
 public:
  Workers(const std::vector<std::string>& common, int count, Lines& lines, int answers)
      : words_(common), lines_(lines), answers_(answers), workers_(static_cast<size_t>(count)) {
    words_.insert(words_.begin(), "--batch");
  }

  void Run() {
    while (HandOut(), !asked_.empty() || !ended_) {
      Wait();
      PassSignals();
      for (; !asked_.empty() && asked_.front().answer; asked_.pop_front())
        WriteAll(answers_, *asked_.front().answer + "\n");
    }
  }

 private:
  // Answers that wait for one before them are few.
  static constexpr size_t kMostWaiting = 1024;

  bool Reads() const {
    return !ended_ && asked_.size() < kMostWaiting &&
           std::any_of(workers_.begin(), workers_.end(), [](const auto& w) { return !w || w->idle(); });
  }

  void HandOut() {
    std::string line;
    while (Reads() && lines_.Held(line)) {
      ++number_;
      if (!IsJob(line)) continue;
      asked_.push_back({number_, IdOf(line), {}});
      auto& worker =
          *std::find_if(workers_.begin(), workers_.end(), [](const auto& w) { return !w || w->idle(); });
      if (!worker) worker = std::make_unique<Worker>(words_);
      worker->Give(line, &asked_.back());
    }
    if (at_end_ && Reads()) ended_ = true;  // and nothing is held
  }

  void Wait() {
    std::vector<pollfd> streams;
    for (const auto& worker : workers_) streams.push_back({worker ? worker->socket() : -1, POLLIN, 0});
    streams.push_back({Reads() && !at_end_ ? lines_.descriptor() : -1, POLLIN, 0});
    // A signal may come between the last look and the call, which it does not end then.
    constexpr int kMilliseconds = 200;
    if (::poll(streams.data(), streams.size(), kMilliseconds) < 0) {
      if (errno != EINTR) Fail("no way to wait", errno);
      return;
    }
    for (size_t i = 0; i < workers_.size(); ++i) {
      if (streams[i].revents != 0 && !workers_[i]->Listen()) workers_[i].reset();
    }
    if (streams.back().revents != 0) at_end_ = !lines_.Fill();
  }

  // Jobs end where they ask, and are answered; no more are begun.
  void PassSignals() {
    const int signal = SignalsEndJob::Asked();
    if (signal == 0 || passed_) return;
    passed_ = ended_ = true;
    for (const auto& worker : workers_) {
      if (worker) worker->Signal(signal);
    }
  }

  std::vector<std::string> words_;
  Lines& lines_;
  const int answers_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::deque<Asked> asked_;  // whose elements stay where they are
  int64_t number_ = 0;
  bool at_end_ = false;  // of the stream
  bool ended_ = false;   // no more are handed out
  bool passed_ = false;
};

}  // namespace

int RunWorkers(const std::vector<std::string>& common, int count, Lines& lines, int answers) {
  const SignalsEndJob wait;
  Workers(common, count, lines, answers).Run();
  return kDone;
}

}  // namespace tessera::cli
