// One run of a line: the image stack, settings that hold from here on, and the outputs that appear together
// at its end.
#ifndef TESSERA_CLI_SESSION_H_
#define TESSERA_CLI_SESSION_H_

#include <limits>
#include <list>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "tessera/io.h"

namespace tessera::cli {

// An image on the stack.
struct Entry {
  Node node;
  std::string name;                   // the file or the command it came from, for reports
  std::vector<Attribute> attributes;  // set by --attrib; they travel with the lowest operand
};

// The thresholds of --diff, as oiiotool has them.
struct DiffLimits {
  double fail = 1e-6, fail_percent = 0, hard_fail = std::numeric_limits<double>::infinity();
  double warn = 1e-6, warn_percent = 0, hard_warn = std::numeric_limits<double>::infinity();
};

class Session {
 public:
  // `options` must outlive the session; `history` is the line as written to the outputs' metadata.
  Session(const Options& options, std::string history) : options_(options), history_(std::move(history)) {}

  // Runs the steps of a checked line in order and puts the outputs in their places. Returns the exit code.
  int Run(const std::vector<Step>& steps);

  const Options& options() const { return options_; }
  const std::string& history() const { return history_; }

  void Push(Entry entry) { stack_.push_back(std::move(entry)); }
  Entry Pop();
  // The entry `depth` below the top.
  Entry& Top(int depth = 0) { return stack_[stack_.size() - 1 - static_cast<size_t>(depth)]; }

  // A file that appears when the run succeeds.
  void AddOutput(PendingOutput output) { outputs_.push_back(std::move(output)); }

  std::optional<PixelType> output_type;  // -d
  std::string color_config;              // --colorconfig
  DiffLimits diff;
  int exit_code = 0;  // set by --diff
  int frame = 0;      // that the line is run for

 private:
  const Options& options_;
  std::string history_;
  std::vector<Entry> stack_;
  std::list<PendingOutput> outputs_;
};

// The type of that name, which must be one of the four.
PixelType PixelTypeNamed(const std::string& name);

// The action of every command that is an operation of the registry.
void ApplyOperation(const Step& step, Session& session);
// -o: writes the top of the stack beside its name, with --explain and --verify.
void WriteOutput(const Step& step, Session& session);
// --diff, --printstats.
void DiffImages(const Step& step, Session& session);
void PrintStatistics(const Step& step, Session& session);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_SESSION_H_
