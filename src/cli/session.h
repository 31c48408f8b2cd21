// One run of a line: the image stack, settings that hold from here on, and the outputs that appear together
// at its end.
#ifndef TESSERA_CLI_SESSION_H_
#define TESSERA_CLI_SESSION_H_

#include <functional>
#include <limits>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/control.h"
#include "cli/file_state.h"
#include "cli/memory_gate.h"
#include "cli/report.h"
#include "cli/stream_frame.h"
#include "tessera/io.h"

namespace tessera::cli {

// The largest of the images that one is made from.
struct LargestImage {
  std::string words;  // the command that made it, with its arguments; empty for a file
  int64_t width = 0, height = 0;
};

// An image on the stack.
struct Entry {
  Node node;
  std::string name;                   // the file or the command it came from, for reports
  std::vector<Attribute> attributes;  // set by --attrib; they travel with the lowest operand
  LargestImage largest = {};
  std::string file = {};  // that the lowest operand came from
  Node as_read = {};      // all of that file, before anything was done to it
  // Of an output that nobody asks another of, where the node has its pixels in memory.
  std::optional<PixelType> suggested = {};
  PixelType SuggestedType() const { return suggested.value_or(node.spec().type); }
  // The other images of a file of several, which are opened when something asks for them.
  std::vector<Entry> parts = {};
  int parts_in_file = 1;  // as long as `parts` is empty
  int PartCount() const { return parts.empty() ? parts_in_file : static_cast<int>(parts.size()) + 1; }
};

// Opens the other images of the file, where they are not.
void OpenParts(Entry& entry, const Options& options);
// Takes them off.
std::vector<Entry> TakeParts(Entry& entry, const Options& options);
// The image without its other parts; says that they are left, but for -q.
void LeaveParts(Entry& entry, const std::string& words, const Options& options);

// A step as written, with its arguments.
std::string WordsOf(const Step& step);
// What an error is about: an operation knows its own name, the line knows it with its dashes.
std::string SubjectOf(const ops::OpInfo& op, const Error& error);

// The thresholds of --diff, as oiiotool has them.
struct DiffLimits {
  double fail = 1e-6, fail_percent = 0, hard_fail = std::numeric_limits<double>::infinity();
  double warn = 1e-6, warn_percent = 0, hard_warn = std::numeric_limits<double>::infinity();
};

class Session {
 public:
  // `options` and `progress` must outlive the session; `history` is the line as written to the outputs'
  // metadata.
  Session(const Options& options, std::string history, Progress::Frame& progress);

  // Runs the steps of a checked line in order, then what they left for later.
  void Compute(const std::vector<Step>& steps);
  // Puts the outputs in their places. Returns the exit code; appends the names of the outputs. `look` as
  // PendingOutput::CommitTogether has it.
  int Commit(std::vector<std::string>& written, const PendingOutput::Look& look = {});

  const Options& options() const { return options_; }
  const std::string& history() const { return history_; }
  Progress::Frame& progress() { return progress_; }

  // `words`: what made it, for messages about its size; empty for a file.
  void Push(Entry entry, const std::string& words = "");
  Entry Pop();
  // The entry `depth` below the top.
  Entry& Top(int depth = 0) { return stack_[stack_.size() - 1 - static_cast<size_t>(depth)]; }
  int Depth() const { return static_cast<int>(stack_.size()); }
  // The top image, with -a each of its parts.
  void ForParts(const std::function<void(Entry&)>& change);

  // What computes pixels waits until all steps have made their images, so that whatever is wrong with one of
  // them is said before hours of work.
  void Later(std::function<void()> work) { work_.push_back({at_hand_, std::move(work)}); }

  // What is to be done once all outputs have their names.
  void WhenInPlace(std::function<void()> work) { in_place_.push_back(std::move(work)); }

  // Adds to `sources` the files that a word names, or that an image is made from.
  void NoteSources(const std::string& word);
  void NoteSources(const Node& image);

  // A file that appears when the run succeeds.
  void AddOutput(const std::string& file, PendingOutput output) {
    outputs_.push_back(std::move(output)), files_.push_back(file);
  }

  std::optional<PixelType> output_type;            // -d
  std::map<std::string, PixelType> channel_types;  // -d CHANNEL=TYPE
  std::vector<Attribute> output_hints;  // --compression, --tile and the like, for the outputs that follow
  std::string color_config;             // --colorconfig, else OCIO's variable, else the built-in one
  DiffLimits diff;
  std::string missing_file = "error";  // --missingfile
  ImageSpec first_spec;                // of the first file that was read
  int exit_code = 0;                   // set by --diff
  int frame = 0;                       // that the line is run for
  std::string* notes = nullptr;        // what operations have to say on stdout is kept here, where it is set
  Flow flow;
  std::map<std::string, Entry> labels;  // --label
  std::vector<std::string> inputs;      // files that were read
  // --resume: of those that the words of the line may not name, as they were before their pixels were read.
  std::vector<FileState> sources;
  MemoryGate* memory = nullptr;  // that frames under way at once share
  const FrameStream* stream =
      nullptr;  // --stream, with the frame that was read and the one that is to be written
  std::optional<StreamFrame> frame_in, frame_out;
  // Of the step that runs.
  size_t at() const { return step_; }
  const Blocks& blocks() const { return *blocks_; }

 private:
  const Options& options_;
  std::string history_;
  Progress::Frame& progress_;
  std::vector<Entry> stack_;
  std::string at_hand_;  // the step
  void RunSteps(const std::vector<Step>& steps);
  Step Resolved(const Step& step);
  size_t step_ = 0;
  std::optional<Blocks> blocks_;
  struct Work {
    std::string words;  // of the step that asked for it
    std::function<void()> run;
  };
  std::list<Work> work_;
  std::list<std::function<void()>> in_place_;
  std::list<PendingOutput> outputs_;
  std::vector<std::string> files_;  // the names of the outputs
};

// Throws Error where an image is larger than what is computed whole: the words that asked for it, its size.
void RequireSize(const Entry& entry);
// The same for the words of a step alone; throws UsageError.
void RequireSize(const Step& step, const Roi& window, int channels);

// The type of that name, which must be one of the four.
PixelType PixelTypeNamed(const std::string& name);

// The action of every command that is an operation of the registry.
void ApplyOperation(const Step& step, Session& session);
// -o: has the top of the stack written beside its name, with --explain and --verify.
void WriteOutput(const Step& step, Session& session);
// --diff, --printstats.
void DiffImages(const Step& step, Session& session);
void PrintStatistics(const Step& step, Session& session);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_SESSION_H_
