// Forked workers that write records into pipes, and their parent.
#include "random/workers.h"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "random/shrink.h"
#include "support/sanitized.h"
#include "support/shaker.h"
#include "tessera/error.h"

namespace tessera::random {
namespace {

constexpr double kHang = 120;  // seconds in one case
// ThreadSanitizer cannot follow a process that has threads, libraries' own, into its child: a thread works
// there, and whatever ends it ends the run.
constexpr bool kForks = !testing::kThreadSanitized;

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// What a worker is at, for the parent to see when it has died.
struct Place {
  std::atomic<uint64_t> index{0};
  std::atomic<double> since{0};
  std::atomic<bool> shrinking{false};
  std::atomic<bool> stop{false};
};

// Records: a letter, a tab, text without line breaks (they are written as \v), a line break.
void Send(int fd, char kind, std::string text) {
  std::replace(text.begin(), text.end(), '\n', '\v');
  text = std::string(1, kind) + "\t" + text + "\n";
  for (size_t at = 0; at < text.size();) {
    const ssize_t n = write(fd, text.data() + at, text.size() - at);
    if (n <= 0) _exit(3);
    at += static_cast<size_t>(n);
  }
}

void KeepSlowest(std::vector<std::pair<double, std::string>>& slowest, double took, const std::string& line) {
  slowest.emplace_back(took, line);
  std::sort(slowest.rbegin(), slowest.rend());
  if (slowest.size() > 10) slowest.pop_back();
}

std::string FolderOf(int worker) {
  const auto folder = std::filesystem::temp_directory_path() /
                      ("random_pipelines." + std::to_string(getpid()) + "." + std::to_string(worker));
  std::filesystem::create_directories(folder);
  return folder.string();
}

// A finding in words, and its shortest case.
std::string Described(const Case& c, const Finding& finding, bool shrink, const std::string& folder) {
  std::string text = std::string(CheckName(finding.check)) + ": " + finding.what + "\n";
  if (!shrink) return text + InWords(c);
  Tally unused;
  Comparer comparer(folder, unused);
  const Case shortest = ShrunkOf(c, finding, comparer, 20);
  const std::optional<Finding> last = comparer.Run(shortest);
  if (last) text += "  shrunk: " + last->what + "\n";
  return text + InWords(shortest);
}

void Work(const Run& run, int worker, uint64_t first, double deadline, const std::string& folder, int fd,
          Place& place) {
  std::optional<testing::Shaker> shaker;
  if (run.shake) shaker.emplace(run.seed + static_cast<uint64_t>(worker));
  Tally tally;
  Generator generator(run.rows, folder, tally);
  Comparer comparer(folder, tally);
  std::vector<std::pair<double, std::string>> slowest;
  int64_t done = 0;
  double reported = Now();
  for (uint64_t i = first;; i += static_cast<uint64_t>(run.workers)) {
    if (run.count >= 0 ? i >= run.from + static_cast<uint64_t>(run.count) : Now() >= deadline) break;
    if (place.stop) break;
    const double begin = Now();
    place.index = i, place.since = begin;
    const Case c = generator.Make(run.seed, i, run.only);
    const std::optional<Finding> finding = comparer.Run(c);
    ++done;
    const double took = Now() - begin;
    if (slowest.size() < 10 || took > slowest.back().first)
      KeepSlowest(slowest, took, std::to_string(run.seed) + " " + std::to_string(i) + "  " + CommandLine(c));
    if (finding) {
      place.shrinking = true;
      Send(fd, 'F', Described(c, *finding, run.shrink, folder));
      place.shrinking = false;
    }
    if (Now() - reported > 0.5) {
      Send(fd, 'N', std::to_string(done));
      done = 0, reported = Now();
    }
  }
  Send(fd, 'N', std::to_string(done));
  for (const auto& [seconds, line] : slowest) Send(fd, 'S', std::to_string(seconds) + "\t" + line);
  for (const auto& [kind, names] : tally.counts()) {
    for (const auto& [name, count] : names) Send(fd, 'T', kind + "\t" + name + "\t" + std::to_string(count));
  }
  Send(fd, 'E', std::to_string(worker));
}

// The parent's side of a worker.
struct Worker {
  pid_t pid = -1;
  std::thread thread;
  int fd = -1;
  std::string folder, unread;
  Place* place = nullptr;
  bool ended = false;  // said so itself
};

class Parent {
 public:
  explicit Parent(const Run& run) : run_(run), start_(Now()), deadline_(start_ + run.seconds) {
    void* const memory = mmap(nullptr, sizeof(Place) * static_cast<size_t>(run.workers),
                              PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw Error("random pipelines", "no shared memory");
    for (int k = 0; k < run.workers; ++k) {
      Worker w;
      w.place = new (static_cast<char*>(memory) + sizeof(Place) * static_cast<size_t>(k)) Place;
      w.folder = FolderOf(k);
      workers_.push_back(std::move(w));
    }
    for (int k = 0; k < run.workers; ++k) Start(k, run.from + static_cast<uint64_t>(k));
  }
  ~Parent() {
    for (Worker& w : workers_) {
      w.place->stop = true;
      if (w.thread.joinable()) w.thread.join();
      if (w.pid > 0) kill(w.pid, SIGKILL), waitpid(w.pid, nullptr, 0);
      std::filesystem::remove_all(w.folder);
    }
  }

  Report Run() {
    while (std::any_of(workers_.begin(), workers_.end(), [](const Worker& w) { return w.fd >= 0; })) {
      std::vector<pollfd> fds;
      for (const Worker& w : workers_) fds.push_back({w.fd, POLLIN, 0});
      poll(fds.data(), fds.size(), 500);
      for (int k = 0; k < run_.workers; ++k) {
        Worker& w = workers_[static_cast<size_t>(k)];
        if (w.fd < 0) continue;
        if ((fds[static_cast<size_t>(k)].revents & (POLLIN | POLLHUP)) != 0) Read(k);
        if (w.fd >= 0 && w.pid > 0 && !w.place->shrinking && w.place->since > 0 &&
            Now() - w.place->since > kHang)
          kill(w.pid, SIGKILL);
      }
      if (run_.progress) {
        std::fprintf(stderr, "\r%lld cases, %.0f s, %zu failed ", static_cast<long long>(report_.cases),
                     Now() - start_, report_.failures.size());
      }
      if (static_cast<int>(report_.failures.size()) >= run_.failures) break;
    }
    if (run_.progress) std::fprintf(stderr, "\n");
    report_.seconds = Now() - start_;
    return std::move(report_);
  }

 private:
  void Start(int k, uint64_t first) {
    Worker& w = workers_[static_cast<size_t>(k)];
    int ends[2];
    if (pipe(ends) != 0) throw Error("random pipelines", "no pipe");
    std::fflush(nullptr);
    w.place->since = 0.0;
    w.fd = ends[0];
    w.unread.clear();
    if (!kForks) {
      w.thread = std::thread([this, k, first, &w, fd = ends[1]] {
        Work(run_, k, first, deadline_, w.folder, fd, *w.place);
        close(fd);
      });
      return;
    }
    w.pid = fork();
    if (w.pid == 0) {
      close(ends[0]);
      Work(run_, k, first, deadline_, w.folder, ends[1], *w.place);
      // No destructors: threads of libraries may still be there.
      _exit(0);
    }
    close(ends[1]);
  }

  void Read(int k) {
    Worker& w = workers_[static_cast<size_t>(k)];
    char buffer[65536];
    const ssize_t n = read(w.fd, buffer, sizeof buffer);
    if (n > 0) {
      w.unread.append(buffer, static_cast<size_t>(n));
      for (size_t end; (end = w.unread.find('\n')) != std::string::npos; w.unread.erase(0, end + 1))
        Take(w, w.unread.substr(0, end));
      return;
    }
    close(w.fd);
    w.fd = -1;
    if (w.thread.joinable()) w.thread.join();
    int status = 0;
    if (w.pid > 0) waitpid(w.pid, &status, 0);
    w.pid = -1;
    if (w.ended) return;
    const uint64_t index = w.place->index;
    const bool hung = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
    std::string words = hung ? "hangs" : WIFSIGNALED(status) ? strsignal(WTERMSIG(status)) : "exits";
    if (w.place->shrinking) words += " while another finding is shrunk";
    Died(k, index, words);
    ++report_.cases;
    w.place->shrinking = false;
    Start(k, index + static_cast<uint64_t>(run_.workers));
  }

  // The case, shrunk in further processes where it is quick.
  void Died(int k, uint64_t index, const std::string& words) {
    Worker& w = workers_[static_cast<size_t>(k)];
    int ends[2];
    if (pipe(ends) != 0) throw Error("random pipelines", "no pipe");
    const pid_t pid = fork();
    if (pid == 0) {
      close(ends[0]);
      Tally tally;
      Generator generator(run_.rows, w.folder, tally);
      Case c = generator.Make(run_.seed, index, run_.only);
      Send(ends[1], 'F', "crash: " + words + "\n" + InWords(c));
      const auto dies = [&](const Case& candidate) {
        const pid_t child = fork();
        if (child == 0) {
          alarm(10);
          Comparer(w.folder, tally).Run(candidate);
          _exit(0);
        }
        int status = 0;
        waitpid(child, &status, 0);
        return WIFSIGNALED(status) && WTERMSIG(status) != SIGALRM;
      };
      if (run_.shrink && words != "hangs" && dies(c)) {
        for (int check = 0; check < static_cast<int>(Check::kCount); ++check) {
          Case one = c;
          one.checks = 1u << check;
          if ((c.checks & one.checks) == 0 || !dies(one)) continue;
          c = one;
          break;
        }
        c = Shrunk(std::move(c), dies, 200);
        Send(ends[1], 'F', "crash: " + words + ", shrunk\n" + InWords(c));
      }
      _exit(0);
    }
    close(ends[1]);
    std::string text;
    char buffer[4096];
    for (ssize_t n; (n = read(ends[0], buffer, sizeof buffer)) > 0;)
      text.append(buffer, static_cast<size_t>(n));
    close(ends[0]);
    waitpid(pid, nullptr, 0);
    // The last record is the shortest case; none where the case cannot even be made.
    if (text.empty()) text = "F\tcrash: " + words + " while it is made, case " + std::to_string(index) + "\n";
    text.pop_back();
    Take(w, text.substr(text.rfind('\n') + 1));
  }

  void Take(Worker& w, std::string record) {
    std::replace(record.begin(), record.end(), '\v', '\n');
    const std::string text = record.substr(std::min<size_t>(2, record.size()));
    const size_t tab = text.find('\t');
    switch (record[0]) {
      case 'F':
        report_.failures.push_back(text);
        std::printf("FAILED %s\n", text.c_str());
        std::fflush(stdout);
        break;
      case 'N':
        report_.cases += std::atoll(text.c_str());
        break;
      case 'S':
        KeepSlowest(report_.slowest, std::atof(text.c_str()), text.substr(tab + 1));
        break;
      case 'T': {
        const size_t second = text.find('\t', tab + 1);
        report_.tally.Add(text.substr(0, tab), text.substr(tab + 1, second - tab - 1),
                          std::atoll(text.c_str() + second + 1));
        break;
      }
      case 'E':
        w.ended = true;
        break;
      default:
        break;
    }
  }

  const random::Run& run_;
  double start_, deadline_;
  std::vector<Worker> workers_;
  Report report_;
};

}  // namespace

Report RunCases(const Run& run) {
  Run own = run;
  if (!kForks) own.workers = 1;  // what runs are compared with is one's own: the target, say
  return Parent(own).Run();
}

}  // namespace tessera::random
