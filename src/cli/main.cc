// The `tessera` command: checks the line, runs it once per frame, turns errors and signals into exit codes.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <new>

#include "cli/arguments.h"
#include "cli/frames.h"
#include "cli/help.h"
#include "cli/messages.h"
#include "cli/session.h"
#include "cli/signals.h"
#include "cli/start.h"
#include "tessera/context.h"
#include "tessera/targets.h"

namespace tessera::cli {
namespace {

constexpr int kDone = 0, kFailed = 1, kWrongLine = 2;

// One line on stderr, whatever the message holds.
void PrintError(const std::string& message) {
  std::cout.flush();
  std::fprintf(Messages(), "tessera: error: %s\n", Printable(message).c_str());
}

// The line as a shell would take it, for the history; the program by its name alone.
std::string HistoryOf(const std::vector<std::string>& words) {
  std::string line = "tessera";
  for (const std::string& word : words) {
    const bool quote = word.empty() || word.find_first_of(" \t\n\"'|$&;<>()`*?\\") != std::string::npos;
    line += " " + (quote ? "\"" + word + "\"" : word);
  }
  return line;
}

// --help and its like; true when one of them was asked for.
bool Inform(const Options& options) {
  if (options.help) {
    options.help_topic.empty() ? PrintOverview(std::cout) : PrintCommandHelp(std::cout, options.help_topic);
  } else if (options.version) {
    PrintVersion(std::cout);
  } else if (options.list_commands) {
    PrintCommandList(std::cout, options.list_format);
  } else if (options.simd == "list") {
    for (const std::string& target : SimdTargets()) std::cout << target << "\n";
  } else {
    return false;
  }
  return true;
}

void ChooseTarget(const std::string& name) {
  if (name.empty()) return;
  try {
    SetSimdTarget(name);
  } catch (const Error& e) {
    throw UsageError("--simd " + name, e.reason());
  }
}

int RunFrames(const Line& line, const std::vector<FrameLine>& frames) {
  int code = kDone;
  for (const FrameLine& frame : frames) {
    if (line.options.verbose && frames.size() > 1)
      std::fprintf(Messages(), "tessera: frame %d\n", frame.frame);
    try {
      // Names and numbers of the frame differ; the whole line is checked again with them.
      Line own = ParseLine(frame.words);
      for (Step& step : own.steps) {
        auto& values = step.arguments.values;
        const auto number = values.find("frame");
        if (number == values.end() || !values.contains("animate") || number->second.given) continue;
        number->second.text = std::to_string(frame.frame), number->second.numbers = {double(frame.frame)};
      }
      Session session(own.options, HistoryOf(frame.words));
      session.frame = frame.frame;
      code = std::max(code, session.Run(own.steps));
    } catch (const Error& e) {
      if (!line.options.skip_bad_frames) throw;
      PrintError(std::string(e.what()) + " (frame " + std::to_string(frame.frame) + " skipped)");
      code = kFailed;
    }
  }
  return code;
}

int Main(const std::vector<std::string>& words) {
  const Line line = ParseLine(WithFrame(words, 1));
  if (Inform(line.options)) return kDone;
  ChooseTarget(line.options.simd);
  CatchSignals();
  if (!line.options.verbose) SilenceLibraries();
  if (const size_t budget = line.options.render.memory_budget; budget != RenderOptions().memory_budget) {
    const ContextLimits limits;
    Context::Default().Limit({std::min(limits.memory, budget / 8), std::min(limits.cache, budget / 8)});
  }
  return RunFrames(line, ExpandFrames(words, line));
}

}  // namespace
}  // namespace tessera::cli

int main(int argc, char** argv) {
  using namespace tessera::cli;
  Start(argv);
  int code = kFailed;
  try {
    code = Main(std::vector<std::string>(argv + 1, argv + argc));
    // What was asked for on stdout must have arrived there.
    if (!std::cout.flush()) {
      PrintError("standard output: cannot be written");
      code = kFailed;
    }
  } catch (const UsageError& e) {
    PrintError(e.what());
    code = kWrongLine;
  } catch (const std::bad_alloc&) {
    PrintError("memory: refused by the system");
  } catch (const std::exception& e) {
    PrintError(e.what());
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // All that was asked for is done: what libraries do at their own end, a refused allocation there say, is
  // not to change the exit code.
  std::cout.flush();
  std::fflush(nullptr);
  _exit(code);
#endif
  return code;
}
