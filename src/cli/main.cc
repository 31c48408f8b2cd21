// The `tessera` command: checks the line, runs it once per frame, turns errors and signals into exit codes.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <optional>

#include "cli/arguments.h"
#include "cli/batch.h"
#include "cli/frame_part.h"
#include "cli/frame_run.h"
#include "cli/frame_stream.h"
#include "cli/frames.h"
#include "cli/help.h"
#include "cli/limits.h"
#include "cli/messages.h"
#include "cli/outcome.h"
#include "cli/pipes.h"
#include "cli/session.h"
#include "cli/signals.h"
#include "cli/start.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"
#include "tessera/sandbox.h"
#include "tessera/targets.h"

namespace tessera::cli {
namespace {

// --help and its like; true when one of them was asked for.
bool Inform(const Options& options, const Layout& layout) {
  if (options.help) {
    options.help_topic.empty() ? PrintOverview(std::cout, layout)
                               : PrintCommandHelp(std::cout, options.help_topic, layout);
  } else if (options.search) {
    PrintSearch(std::cout, options.help_search, layout);
  } else if (options.manual) {
    PrintManual(std::cout);
  } else if (!options.completion.empty()) {
    PrintCompletion(std::cout, options.completion);
  } else if (options.version) {
    PrintVersion(std::cout);
  } else if (options.list_commands) {
    PrintCommandList(std::cout, options.list_format);
  } else if (options.list_formats) {
    std::cout << FormatList();
  } else if (options.simd == "list") {
    for (const std::string& target : SimdTargets()) std::cout << target << "\n";
  } else {
    return false;
  }
  return true;
}

// What a line sets for the whole process, for as long as it runs.
class ProcessSettings {
 public:
  explicit ProcessSettings(const Options& options)
      : simd_(options.simd),
        budget_(options.render.memory_budget != RenderOptions().memory_budget),
        limits_(options) {
    LimitCodecThreads(options.render.threads);
    if (!simd_.empty()) ChooseTarget(simd_);
    if (!budget_) return;
    const size_t budget = options.render.memory_budget;
    const ContextLimits limits;
    // A limit alone refuses: who sets one wants no disk filled either.
    const size_t whole = options.pages && !options.safe ? budget / 2 : 0;
    Context::Default().Limit(
        {std::min(limits.memory, budget / 8), std::min(limits.cache, budget / 8), whole});
  }
  ~ProcessSettings() {
    if (!simd_.empty()) ChooseTarget("auto");
    if (budget_) Context::Default().Limit(ContextLimits());
  }
  ProcessSettings(const ProcessSettings&) = delete;
  ProcessSettings& operator=(const ProcessSettings&) = delete;

 private:
  // What was prepared by kernels of one target may differ in bits from what another's would be.
  static void ChooseTarget(const std::string& name) {
    Context::Default().Release();
    try {
      SetSimdTarget(name);
    } catch (const Error& e) {
      throw UsageError("--simd " + name, e.reason());
    }
  }

  std::string simd_;
  bool budget_;
  ProcessLimits limits_;
};

// A whole line of its own or a job of --batch.
int RunLine(Line line, const std::vector<std::string>& words, std::vector<std::string>& written) {
  if (line.options.safe && !HasLeftEnvironment())
    throw UsageError("--safe", "found in a job, expected on the program's own line");
  if (!line.options.sandbox && !HasWaivedSandbox())
    throw UsageError("--no-sandbox", "found in a job, expected on the program's own line");
  if (line.options.stream.on && SignalsEndJob::Alive())
    throw UsageError("--stream", "found in a job, expected on the program's own line");
  Limit(line.options);
  const ProcessSettings settings(line.options);
  std::optional<FrameStream> stream;
  if (line.options.stream.on) stream.emplace(line);
  const FrameJob job = stream && stream->Reads() ? FrameJob{words, {}, 0, {}} : MakeFrameJob(words, line);
  if (!job.frames.empty()) {
    const auto named = std::mismatch(words.begin(), words.end(), job.frames[0].words.begin()).first;
    RequireFrames(line.options, named == words.end() ? "--frames" : *named, job.frames.size());
  }
  return RunFrames(line, job, written, stream ? &*stream : nullptr);
}

int RunJob(const std::vector<std::string>& words, std::vector<std::string>& written) {
  const Line line = ParseLine(WithFrame(words, 1));
  if (line.options.batch) throw UsageError("--batch", "found in a job, expected on the program's own line");
  return Inform(line.options, {}) ? kDone : RunLine(line, words, written);
}

int Main(const std::vector<std::string>& words) {
  const Line line = ParseLine(WithFrame(words, 1));
  if (Inform(line.options, LayoutOfOutput())) return kDone;
  CatchSignals();
  if (!line.options.verbose) SilenceLibraries();
  if (line.options.batch) return RunBatch(words, line.options.batch_jobs, RunJob);
  std::vector<std::string> written;
  return RunLine(line, words, written);
}

}  // namespace
}  // namespace tessera::cli

int main(int argc, char** argv) {
  using namespace tessera::cli;
  Start(argv);
  Outcome outcome = Attempt(
      [&] { return Main(WithoutRun(WithWordsOfFiles(std::vector<std::string>(argv + 1, argv + argc)))); });
  // What was asked for on stdout must have arrived there.
  if (outcome.message.empty() && !std::cout.flush())
    outcome = {kFailed, "system", "standard output: cannot be written"};
  if (!outcome.message.empty()) PrintError(outcome.message);
  const int code = outcome.code;
  tessera::EndSandbox();
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(TESSERA_COVERAGE)
  // All that was asked for is done: what libraries do at their own end, a refused allocation there say, is
  // not to change the exit code.
  std::cout.flush();
  std::fflush(nullptr);
  _exit(code);
#endif
  return code;
}
