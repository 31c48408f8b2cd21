// A frame's computing is a step of a pipeline that several frames are in; its files get their names in the
// next.
#include "cli/frame_run.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>

#include "cli/file_state.h"
#include "cli/frame_files.h"
#include "cli/frame_record.h"
#include "cli/frame_stream.h"
#include "cli/json_report.h"
#include "cli/limits.h"
#include "cli/memory_gate.h"
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
// Of --parallel-frames auto.
constexpr int kMostUnasked = 16;

// The line as a shell would take it, for the history; the program by its name alone.
std::string HistoryOf(const std::vector<std::string>& words) {
  std::string line = "tessera";
  for (const std::string& word : words) {
    const bool quote = word.empty() || word.find_first_of(" \t\n\"'|$&;<>()`*?\\") != std::string::npos;
    line += " " + (quote ? "\"" + word + "\"" : word);
  }
  return line;
}

// Whether all that the line does is to make images of images and files of those.
bool IsQuiet(const Line& line) {
  const Options& o = line.options;
  if (o.verbose || o.dry_run || o.runstats || o.explain || o.verify || o.update || o.no_clobber ||
      o.adjust_time || o.safe || o.TellsInputs() || o.limits.memory || o.limits.seconds) {
    return false;
  }
  // Without --parallel-frames nobody asked for shares of the memory; and --autotrim takes its own.
  const bool stated = o.render.memory_budget != RenderOptions().memory_budget;
  if (stated && (!o.parallel_frames || o.auto_trim)) return false;
  const bool streams = o.stream.on;
  return std::all_of(line.steps.begin(), line.steps.end(), [streams](const Step& step) {
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
        return step.deferred.empty() && IsOutput(step) && !step.arguments.Given("all") &&
               (streams || !IsStandardOutput(step.arguments.Text("FILE")));
      default:
        return false;
    }
  });
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
  FrameRun(FrameLine f, Progress& all) : frame(std::move(f)), progress(all) {}
  FrameLine frame;
  Progress::Frame progress;
  std::optional<Line> line;
  std::optional<StreamFrame> input;  // of --stream
  std::optional<Session> session;    // of the line's options
  std::string messages, notes;       // for stderr and stdout
  std::exception_ptr failure;
  FrameRecord record;
  bool is_done = false;  // before it was begun
};

// What the frames of a run have in common.
struct Common {
  const std::atomic<bool>* ended = nullptr;  // where several are under way
  MemoryGate* memory = nullptr;
  const FrameRecords* records = nullptr;
  std::vector<bool> outputs;  // of the words
  FrameStream* stream = nullptr;
};

// Names and numbers of the frame differ; the whole line is checked again with them.
void Compute(FrameRun& run, const Common& common) {
  const FrameLine& frame = run.frame;
  run.line.emplace(ParseLine(frame.words));
  Line& own = *run.line;
  if (common.records != nullptr) {
    run.record = {frame.frame, MadeBy(frame.words, own), InputsNamed(frame.words, common.outputs), {}};
    run.is_done = common.records->IsDone(run.record.made_by, run.record.inputs);
    if (run.is_done) return;
  }
  Limit(own.options);
  AskForSignals(own.options, common.ended);
  for (Step& step : own.steps) {
    auto& values = step.arguments.values;
    const auto number = values.find("frame");
    if (number == values.end() || !values.contains("animate") || number->second.given) continue;
    number->second.text = std::to_string(frame.frame), number->second.numbers = {double(frame.frame)};
  }
  run.session.emplace(own.options, HistoryOf(HistoryWords(frame.words, own)), run.progress);
  run.session->frame = frame.frame;
  run.session->memory = common.memory;
  if (common.ended != nullptr) run.session->notes = &run.notes;
  run.session->stream = common.stream;
  run.session->frame_in = std::move(run.input);
  run.session->Compute(own.steps);
}

// Gives the frame's files their names, and then says so in the records, by what they held before others could
// change it.
int Commit(FrameRun& run, FrameRecords* records, std::vector<std::string>& written) {
  if (records == nullptr) return run.session->Commit(written);
  const int code = run.session->Commit(written, [&](const std::string& temporary, const std::string& file) {
    const auto content = ContentOf(temporary);
    if (!content) throw SystemError(file, "cannot be read back for --resume");
    run.record.outputs.emplace_back(file, *content);
  });
  if (code != kDone || run.line->options.dry_run || run.record.outputs.empty()) return code;
  for (const FileState& source : run.session->sources) {
    auto& inputs = run.record.inputs;
    const bool known = std::any_of(inputs.begin(), inputs.end(),
                                   [&](const FileState& input) { return input.name == source.name; });
    if (!known) inputs.push_back(source);
  }
  records->Add(run.record);
  return code;
}

// What became of the frames.
struct Tally {
  int64_t left = 0, made = 0;
  std::vector<int> failed;
};

void TellFrames(const Line& line, const FrameJob& job, const FrameRecords* records, const Tally& tally) {
  const Options& o = line.options;
  if (o.json) {
    Json report = Report("frames");
    report["frames"] = job.frames.size();
    report["frames_in_line"] = job.all;
    report["part"] = job.part.index;
    report["parts"] = job.part.count;
    report["left"] = tally.left;
    report["made"] = o.dry_run ? 0 : tally.made;
    report["failed"] = tally.failed;
    report["records"] = records == nullptr ? Json() : Json(records->file());
    PrintJson(report);
  } else if (!o.quiet && tally.left > 0) {
    std::fprintf(Messages(),
                 "tessera: note: %lld of %zu frames are finished and stay as they are (--resume)\n",
                 static_cast<long long>(tally.left), job.frames.size());
  }
}

// The next of the frames, or none. Between frames a line may be asked to end.
std::shared_ptr<FrameRun> Next(const Line& line, const std::vector<FrameLine>& frames, size_t& next,
                               Progress& progress) {
  if (next == frames.size()) return nullptr;
  if (SignalsEndJob::Asked() != 0) throw Cancelled();
  RequireTime();
  auto run = std::make_shared<FrameRun>(frames[next++], progress);
  if (line.options.verbose && frames.size() > 1)
    std::fprintf(Messages(), "tessera: frame %d\n", run->frame.frame);
  return run;
}

// The same for frames that come from standard input, numbered from 1. What is wrong with the stream is the
// last frame's failure, told after those before it are written.
std::shared_ptr<FrameRun> NextOfStream(const Line& line, const FrameJob& job, FrameStream& stream,
                                       size_t& next, Progress& progress) {
  constexpr auto kNoMore = static_cast<size_t>(-1);
  if (next == kNoMore || (next > 0 && (line.options.explain || line.options.dry_run))) return nullptr;
  if (SignalsEndJob::Asked() != 0) throw Cancelled();
  RequireTime();
  const int number = static_cast<int>(++next);
  auto run = std::make_shared<FrameRun>(FrameLine{number, {}}, progress);
  try {
    run->input = stream.Next();
    if (!run->input) return nullptr;
    RequireFrames(line.options, "-", next);
    run->frame = ExpandFrame(job.words, line, number);
    if (line.options.verbose) std::fprintf(Messages(), "tessera: frame %d\n", number);
  } catch (...) {
    run->failure = std::current_exception();
    next = kNoMore;
  }
  return run;
}

// Whether frames that come one by one go nowhere but to standard output.
bool OnlyStreams(const Line& line) {
  return std::all_of(line.steps.begin(), line.steps.end(),
                     [](const Step& step) { return !IsOutput(step) || step.arguments.Text("FILE") == "-"; });
}

}  // namespace

void PrintError(const std::string& message) {
  std::cout.flush();
  std::fprintf(Messages(), "tessera: error: %s\n", Printable(message).c_str());
}

int FramesAtOnce(const Line& line, const std::vector<FrameLine>& frames) {
  const int threads = sched::ThreadCount(line.options.render.threads);
  const bool unknown = frames.empty() && line.options.stream.on;  // how many will come
  if ((frames.size() < 2 && !unknown) || threads < 2 || SignalsEndJob::Alive() || !IsQuiet(line)) return 1;
  const int asked = line.options.parallel_frames.value_or(kMostAtOnce);
  const int most = asked > 0 ? asked : std::clamp(threads + 1, kMostAtOnce, kMostUnasked);
  if (unknown) return OnlyStreams(line) ? most : 1;
  const std::vector<std::string>& words = frames[0].words;
  const bool input = std::find(words.begin(), words.end(), "-") != words.end();
  if (input && !line.options.stream.on) return 1;  // standard input
  if (most > 1 && MayReadWritten(frames, OutputWords(line, words))) return 1;
  return static_cast<int>(std::min(static_cast<size_t>(most), frames.size()));
}

int RunFrames(const Line& line, const FrameJob& job, std::vector<std::string>& written, FrameStream* stream) {
  const std::vector<FrameLine>& frames = job.frames;
  const int at_once = FramesAtOnce(line, frames);
  const bool reads_stream = stream != nullptr && stream->Reads();
  Common common;
  common.stream = stream;
  common.outputs = OutputWords(line, job.words);
  std::optional<FrameRecords> records;
  if (line.options.resume) {
    const auto first = std::find(common.outputs.begin(), common.outputs.end(), true);
    const auto& output = job.words[static_cast<size_t>(first - common.outputs.begin())];
    records.emplace(output, line.options.frame_padding, job.part);
    common.records = &*records;
  }
  int code = kDone;
  const auto outputs = std::count_if(line.steps.begin(), line.steps.end(), IsOutput);
  Progress progress(frames.size(), static_cast<size_t>(outputs),
                    line.options.ShowsProgress() && !line.options.dry_run && !line.options.explain);
  size_t next = 0;
  bool pipe_failed = false;  // standard output
  std::atomic<bool> ended = false;
  MemoryGate memory(at_once);
  if (at_once > 1) common.ended = &ended, common.memory = &memory;
  Tally tally;
  sched::PipelineSteps steps;
  steps.read = [&]() -> std::shared_ptr<void> {
    return reads_stream ? NextOfStream(line, job, *stream, next, progress)
                        : Next(line, frames, next, progress);
  };
  steps.work = [&](void* item, int /*worker*/) {
    FrameRun& run = *static_cast<FrameRun*>(item);
    std::optional<KeptMessages> messages;
    if (at_once > 1) messages.emplace(KeptMessages::Of::kThisThread);
    try {
      if (!run.failure) Compute(run, common);
    } catch (...) {
      run.failure = std::current_exception();
    }
    if (!run.failure || line.options.skip_bad_frames) run.progress.Done();
    if (messages) run.messages = messages->Text();
  };
  steps.write = [&](void* item) {
    FrameRun& run = *static_cast<FrameRun*>(item);
    progress.MakeWay();
    std::cout << run.notes << std::flush;
    if (!run.messages.empty()) std::fputs(run.messages.c_str(), Messages());
    try {
      if (run.failure) std::rethrow_exception(run.failure);
      if (run.is_done) {
        ++tally.left;
        return;
      }
      code = std::max(code, Commit(run, records ? &*records : nullptr, written));
      if (run.session->frame_out) {
        pipe_failed = true;
        stream->Write(*run.session->frame_out);
        pipe_failed = false;
      }
      ++tally.made;
    } catch (const Error& e) {
      if (!line.options.skip_bad_frames || pipe_failed || KindOf(e) == ErrorKind::kCancelled) {
        ended = true;
        throw;
      }
      RequireTime();
      PrintError(std::string(e.what()) + " (frame " + std::to_string(run.frame.frame) + " skipped)");
      tally.failed.push_back(run.frame.frame);
      code = kFailed;
    } catch (...) {
      ended = true;
      throw;
    }
    run.session.reset();
  };
  sched::Pipeline(at_once > 1 ? sched::ThreadCount(line.options.render.threads) : 1, at_once, steps);
  if (line.options.resume || !line.options.part.empty())
    TellFrames(line, job, records ? &*records : nullptr, tally);
  return code;
}

}  // namespace tessera::cli
