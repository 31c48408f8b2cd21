// The part of the frames, from the line or from a scheduler's variables.
#include "cli/frame_part.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "cli/frame_files.h"

namespace tessera::cli {
namespace {

constexpr int kMostParts = 1000000;

// What the tasks of a job are told by. Where `last` is null or not set, the number of tasks is the line's to
// say.
struct Scheduler {
  const char* name;
  const char* task;   // the number of this one
  const char* first;  // variables of the first number, of the last one and of the step
  const char* last;
  const char* step;
  const char* count;  // of the tasks, where gaps are possible or numbers begin at 0
  int base;           // the first number where no variable says it
  const char* none;   // what stands for no number
};
constexpr Scheduler kSchedulers[] = {
    {"Slurm (an array)", "SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_MAX",
     "SLURM_ARRAY_TASK_STEP", "SLURM_ARRAY_TASK_COUNT", 1, nullptr},
    {"Grid Engine", "SGE_TASK_ID", "SGE_TASK_FIRST", "SGE_TASK_LAST", "SGE_TASK_STEPSIZE", nullptr, 1,
     "undefined"},
    {"LSF", "LSB_JOBINDEX", nullptr, "LSB_JOBINDEX_END", "LSB_JOBINDEX_STEP", nullptr, 1, "0"},
    {"PBS", "PBS_ARRAY_INDEX", nullptr, nullptr, nullptr, nullptr, 1, nullptr},
    {"Torque", "PBS_ARRAYID", nullptr, nullptr, nullptr, nullptr, 1, nullptr},
    {"AWS Batch", "AWS_BATCH_JOB_ARRAY_INDEX", nullptr, nullptr, nullptr, nullptr, 0, nullptr},
    {"Kubernetes (an indexed job)", "JOB_COMPLETION_INDEX", nullptr, nullptr, nullptr, nullptr, 0, nullptr},
    {"Slurm (srun -n)", "SLURM_PROCID", nullptr, nullptr, nullptr, "SLURM_NTASKS", 0, nullptr},
};

std::optional<int64_t> NumberIn(std::string_view text) {
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

// Of a variable; empty where it is not set. Throws UsageError for what is no number.
std::optional<int64_t> Variable(const char* name) {
  const char* const text = name == nullptr ? nullptr : std::getenv(name);
  if (text == nullptr || *text == 0) return std::nullopt;
  if (const auto value = NumberIn(text)) return value;
  throw UsageError("--part auto", std::string("found ") + name + "=" + text + ", expected a number");
}

FramePart Checked(const std::string& subject, int64_t index, int64_t count) {
  if (count < 1 || count > kMostParts || index < 1 || index > count) {
    throw UsageError(subject, "found part " + std::to_string(index) + " of " + std::to_string(count) +
                                  ", expected K/N with K from 1 to N and N up to " +
                                  std::to_string(kMostParts));
  }
  return {static_cast<int>(index), static_cast<int>(count)};
}

FramePart PartOf(const Scheduler& s, const std::string& subject, std::optional<int64_t> count) {
  const int64_t task = *Variable(s.task);
  // As the line says, tasks are numbered through; so one may be run again alone.
  if (count) return Checked(subject + " (" + s.task + ")", task - s.base + 1, *count);
  const int64_t first = Variable(s.first).value_or(s.base), step = Variable(s.step).value_or(1);
  const auto last = Variable(s.last), all = Variable(s.count);
  if ((!last && !all) || step < 1)
    throw UsageError(subject, std::string("found ") + s.task + "=" + std::to_string(task) +
                                  " and no number of tasks, expected auto/N");
  const int64_t tasks = last ? (*last - first) / step + 1 : *all;
  if (all && *all != tasks) {
    throw UsageError(subject, std::string("found an array of ") + std::to_string(*all) +
                                  " tasks with gaps, expected one without, or auto/N, where tasks are "
                                  "numbered from 1 to N");
  }
  return Checked(subject + " (" + s.task + ")", (task - first) / step + 1, tasks);
}

}  // namespace

std::string FramePart::Name() const { return std::to_string(index) + "-of-" + std::to_string(count); }

FramePart ParseFramePart(const std::string& text) {
  const std::string subject = "--part " + text;
  const auto refuse = [&]() -> FramePart {
    throw UsageError(subject, "found no part, expected K/N, such as 3/16, auto or auto/N");
  };
  const size_t slash = std::min(text.find('/'), text.size());
  std::optional<int64_t> count;
  if (slash < text.size()) {
    count = NumberIn(std::string_view(text).substr(slash + 1));
    if (!count) return refuse();
  }
  if (const auto index = NumberIn(std::string_view(text).substr(0, slash))) {
    return count ? Checked(subject, *index, *count) : refuse();
  }
  if (text.substr(0, slash) != "auto") return refuse();
  for (const Scheduler& s : kSchedulers) {
    const char* const task = std::getenv(s.task);
    if (task != nullptr && *task != 0 && (s.none == nullptr || std::string_view(task) != s.none))
      return PartOf(s, subject, count);
  }
  std::string names;
  for (const Scheduler& s : kSchedulers) names += std::string(names.empty() ? "" : ", ") + s.task;
  throw UsageError(subject,
                   "found none of the variables " + names + ", expected a task of a scheduler, or K/N");
}

std::string SchedulerHelp() {
  std::string text;
  for (const Scheduler& s : kSchedulers) {
    text += std::string(text.empty() ? "" : "; ") + s.name + ": " + s.task;
    if (s.last == nullptr && s.count == nullptr) {
      text += std::string(" from ") + (s.base == 0 ? "0" : "1") + ", auto/N";
    } else if (s.last == nullptr) {
      text += std::string(" from 0 of ") + s.count;
    } else {
      text += std::string(" from ") + (s.first != nullptr ? s.first : "1") + " to " + s.last;
    }
  }
  return text;
}

std::vector<FrameLine> FramesOfPart(const std::vector<FrameLine>& frames, const FramePart& part) {
  std::vector<FrameLine> own;
  const auto step = static_cast<size_t>(part.count);
  for (size_t i = static_cast<size_t>(part.index) - 1; i < frames.size(); i += step) own.push_back(frames[i]);
  return own;
}

namespace {

void RequireParts(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs) {
  if (const std::string output = OutputOfSeveral(frames, outputs); !output.empty()) {
    throw UsageError("--part", "found the output " + output +
                                   " of several frames, expected one for each, with # or %04d in its name");
  }
  if (MayReadWritten(frames, outputs))
    throw UsageError("--part",
                     "found a frame that reads what one before it writes, expected frames that do not "
                     "wait for each other");
}

void RequireResumable(const Options& options, const std::vector<FrameLine>& frames,
                      const std::vector<bool>& outputs) {
  if (options.safe) throw UsageError("--resume", "found beside --safe, expected a line of one's own");
  if (options.no_clobber || options.update)
    throw UsageError("--resume", std::string("found beside ") + (options.update ? "-u" : "--no-clobber") +
                                     ", expected one of the two");
  if (std::find(outputs.begin(), outputs.end(), true) == outputs.end())
    throw UsageError("--resume", "found no -o, expected an output, which the records are kept beside");
  if (const std::string output = OutputThatIsRead(frames, outputs); !output.empty()) {
    throw UsageError("--resume", "found the output " + output +
                                     " among what its frame reads, expected another name: made again, a "
                                     "frame would be made of its own result");
  }
}

}  // namespace

FrameJob MakeFrameJob(const std::vector<std::string>& words, const Line& line) {
  const Options& options = line.options;
  FrameJob job{words, {}, 0, ExpandFrames(words, line)};
  job.all = job.frames.size();
  if (!options.part.empty()) {
    if (options.safe) throw UsageError("--part", "found beside --safe, expected a line of one's own");
    job.part = ParseFramePart(options.part);
    if (job.frames[0].words == words)
      throw UsageError("--part", "found no frames, expected a file name with # or %04d");
  }
  const std::vector<bool> outputs = OutputWords(line, words);
  if (job.part.count > 1) RequireParts(job.frames, outputs);
  if (options.resume) RequireResumable(options, job.frames, outputs);
  job.frames = FramesOfPart(job.frames, job.part);
  return job;
}

}  // namespace tessera::cli
