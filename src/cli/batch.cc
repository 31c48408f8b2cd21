// The loop of --batch: what a job prints is kept for its answer, what it sets ends with it.
#include "cli/batch.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <thread>

#include "cli/batch_job.h"
#include "cli/batch_streams.h"
#include "cli/batch_workers.h"
#include "cli/messages.h"
#include "cli/outcome.h"
#include "cli/signals.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

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

bool IsBatch(const std::string& word) {
  const std::string name = word.substr(0, word.find(':'));
  return name == "-batch" || name == "--batch";
}

}  // namespace

bool AsksForBatch(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), IsBatch);
}

int RunBatch(const std::vector<std::string>& words, int jobs, const RunLine& run) {
  std::vector<std::string> common = words;
  std::erase_if(common, IsBatch);
  Lines lines(Take(STDIN_FILENO, "standard input", O_RDONLY));
  const int answers = Take(STDOUT_FILENO, "standard output", O_WRONLY);
  if (jobs == 0) jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  if (jobs > 1) return RunWorkers(common, jobs, lines, answers);
  std::string line;
  for (int64_t number = 1; lines.Next(line); ++number) {
    if (!IsJob(line)) continue;
    const SignalsEndJob wait;
    WriteAll(answers, Answer(number, line, common, run) + "\n");
  }
  return kDone;
}

}  // namespace tessera::cli
