// A frame's computing is a step of a pipeline that several frames are in; its files get their names in the
// next.
#include "cli/frame_run.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <system_error>

#include "cli/limits.h"
#include "cli/messages.h"
#include "cli/outcome.h"
#include "cli/pipes.h"
#include "cli/report.h"
#include "cli/session.h"
#include "cli/signals.h"
#include "sched/scheduler.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

// Each takes memory of its own; one more than two threads, as one may wait for the one before it.
constexpr int kMostAtOnce = 3;

// The line as a shell would take it, for the history; the program by its name alone.
std::string HistoryOf(const std::vector<std::string>& words) {
  std::string line = "tessera";
  for (const std::string& word : words) {
    const bool quote = word.empty() || word.find_first_of(" \t\n\"'|$&;<>()`*?\\") != std::string::npos;
    line += " " + (quote ? "\"" + word + "\"" : word);
  }
  return line;
}

bool IsOutput(const Step& step) { return step.command->run == WriteOutput; }

// Whether all that the line does is to make images of images and files of those.
bool IsQuiet(const Line& line) {
  const Options& o = line.options;
  if (o.verbose || o.dry_run || o.runstats || o.explain || o.verify || o.json || o.update || o.no_clobber ||
      o.adjust_time || o.safe || o.TellsInputs() || o.ShowsProgress() || o.limits.memory ||
      o.limits.seconds || o.render.memory_budget != RenderOptions().memory_budget) {
    return false;
  }
  return std::all_of(line.steps.begin(), line.steps.end(), [](const Step& step) {
    if (step.arguments.values.contains("SEQUENCE")) return false;  // frames of any number
    switch (step.command->effect) {
      case Effect::kSetting:
      case Effect::kPush:
      case Effect::kApply:
      case Effect::kDup:
      case Effect::kSwap:
      case Effect::kPop:
        return step.deferred.empty();
      case Effect::kUse:
        return step.deferred.empty() && IsOutput(step) && !IsStandardOutput(step.arguments.Text("FILE"));
      default:
        return false;
    }
  });
}

// Files by one name each, whatever words name them.
class Names {
 public:
  std::string Of(const std::string& word) {
    namespace fs = std::filesystem;
    std::error_code code;
    fs::path path(word);
    if (fs::is_symlink(fs::symlink_status(path, code))) path = fs::weakly_canonical(path, code);
    const std::string directory = path.parent_path().string();
    auto at = directories_.find(directory);
    if (at == directories_.end()) {
      const fs::path whole = fs::weakly_canonical(directory.empty() ? "." : directory, code);
      at = directories_.emplace(directory, whole.string()).first;
    }
    return at->second + "/" + path.filename().string();
  }

 private:
  std::map<std::string, std::string> directories_;
};

// What of a word may be a file's name: all of it, and what stands in a modifier (:file=a.tif).
std::vector<std::string> PartsOf(const std::string& word) {
  std::vector<std::string> parts = {word};
  for (size_t begin = 0; word.find_first_of(":=,") != std::string::npos && begin <= word.size();) {
    const size_t end = std::min(word.find_first_of(":=,", begin), word.size());
    if (end > begin) parts.push_back(word.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// Whether a frame may read what one before it writes.
bool MayReadWritten(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs) {
  Names names;
  std::map<std::string, size_t> writers;  // the first of each file
  for (size_t frame = 0; frame < frames.size(); ++frame) {
    for (size_t i = 0; i < outputs.size(); ++i) {
      if (outputs[i]) writers.emplace(names.Of(frames[frame].words[i]), frame);
    }
  }
  for (size_t frame = 0; frame < frames.size(); ++frame) {
    const std::vector<std::string>& words = frames[frame].words;
    for (size_t i = 0; i < outputs.size(); ++i) {
      // Of frames with the same word the last has the most before it.
      if (outputs[i] || (frame + 1 < frames.size() && frames[frame + 1].words[i] == words[i])) continue;
      for (const std::string& part : PartsOf(words[i])) {
        const auto writer = writers.find(names.Of(part));
        if (writer != writers.end() && writer->second < frame) return true;
      }
    }
  }
  return false;
}

// A job of --batch ends where it asks; what is under way when another frame has failed ends, too.
void AskForSignals(Options& options, const std::atomic<bool>* ended) {
  if (!SignalsEndJob::Alive() && ended == nullptr) return;
  options.render.progress = [ended, ask = std::move(options.render.progress)](double share) {
    return SignalsEndJob::Asked() == 0 && (ended == nullptr || !*ended) && (!ask || ask(share));
  };
}

// A frame under way.
struct FrameRun {
  explicit FrameRun(const FrameLine& f) : frame(f) {}
  const FrameLine& frame;
  std::optional<Line> line;
  std::optional<Session> session;  // of the line's options
  std::string messages, notes;     // for stderr and stdout
  std::exception_ptr failure;
};

// Names and numbers of the frame differ; the whole line is checked again with them.
void Compute(FrameRun& run, Progress& progress, const std::atomic<bool>* ended) {
  const FrameLine& frame = run.frame;
  run.line.emplace(ParseLine(frame.words));
  Line& own = *run.line;
  Limit(own.options);
  AskForSignals(own.options, ended);
  for (Step& step : own.steps) {
    auto& values = step.arguments.values;
    const auto number = values.find("frame");
    if (number == values.end() || !values.contains("animate") || number->second.given) continue;
    number->second.text = std::to_string(frame.frame), number->second.numbers = {double(frame.frame)};
  }
  run.session.emplace(own.options, HistoryOf(HistoryWords(frame.words, own.options)), progress);
  run.session->frame = frame.frame;
  if (ended != nullptr) run.session->notes = &run.notes;
  run.session->Compute(own.steps);
}

// The next of the frames, or none. Between frames a line may be asked to end.
std::shared_ptr<FrameRun> Next(const Line& line, const std::vector<FrameLine>& frames, size_t& next) {
  if (next == frames.size()) return nullptr;
  if (SignalsEndJob::Asked() != 0) throw Cancelled();
  RequireTime();
  auto run = std::make_shared<FrameRun>(frames[next++]);
  if (line.options.verbose && frames.size() > 1)
    std::fprintf(Messages(), "tessera: frame %d\n", run->frame.frame);
  return run;
}

}  // namespace

void PrintError(const std::string& message) {
  std::cout.flush();
  std::fprintf(Messages(), "tessera: error: %s\n", Printable(message).c_str());
}

int FramesAtOnce(const Line& line, const std::vector<FrameLine>& frames) {
  const int threads = sched::ThreadCount(line.options.render.threads);
  const std::vector<std::string>& words = frames[0].words;
  const bool reads_standard_input = std::find(words.begin(), words.end(), "-") != words.end();
  if (frames.size() < 2 || threads < 2 || SignalsEndJob::Alive() || !IsQuiet(line) || reads_standard_input)
    return 1;
  std::vector<bool> outputs(words.size());
  for (size_t i = 1; i < words.size(); ++i) {
    for (const Step& step : line.steps)
      outputs[i] = outputs[i] || (IsOutput(step) && words[i - 1] == step.written);
  }
  return MayReadWritten(frames, outputs) ? 1 : kMostAtOnce;
}

int RunFrames(const Line& line, const std::vector<FrameLine>& frames, std::vector<std::string>& written) {
  const int at_once = FramesAtOnce(line, frames);
  int code = kDone;
  const auto outputs = std::count_if(line.steps.begin(), line.steps.end(), IsOutput);
  Progress progress(frames.size(), static_cast<size_t>(outputs),
                    line.options.ShowsProgress() && !line.options.dry_run && !line.options.explain);
  size_t next = 0;
  std::atomic<bool> ended = false;
  sched::PipelineSteps steps;
  steps.read = [&]() -> std::shared_ptr<void> { return Next(line, frames, next); };
  steps.work = [&](void* item, int /*worker*/) {
    FrameRun& run = *static_cast<FrameRun*>(item);
    std::optional<KeptMessages> messages;
    if (at_once > 1) messages.emplace(KeptMessages::Of::kThisThread);
    try {
      Compute(run, progress, at_once > 1 ? &ended : nullptr);
    } catch (...) {
      run.failure = std::current_exception();
    }
    if (!run.failure || line.options.skip_bad_frames) progress.EndFrame();
    if (messages) run.messages = messages->Text();
  };
  steps.write = [&](void* item) {
    FrameRun& run = *static_cast<FrameRun*>(item);
    std::cout << run.notes << std::flush;
    if (!run.messages.empty()) std::fputs(run.messages.c_str(), Messages());
    try {
      if (run.failure) std::rethrow_exception(run.failure);
      code = std::max(code, run.session->Commit(written));
    } catch (const Error& e) {
      if (!line.options.skip_bad_frames || KindOf(e) == ErrorKind::kCancelled) {
        ended = true;
        throw;
      }
      RequireTime();
      PrintError(std::string(e.what()) + " (frame " + std::to_string(run.frame.frame) + " skipped)");
      code = kFailed;
    } catch (...) {
      ended = true;
      throw;
    }
    run.session.reset();
  };
  sched::Pipeline(at_once > 1 ? sched::ThreadCount(line.options.render.threads) : 1, at_once, steps);
  return code;
}

}  // namespace tessera::cli
