// Runs a checked line: steps in order, then what they compute, then all outputs at once.
#include "cli/session.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <span>

#include "base/policy.h"
#include "cli/expression.h"
#include "cli/frame_files.h"
#include "cli/limits.h"
#include "cli/metadata.h"
#include "cli/signals.h"
#include "cli/validate.h"
#include "graph/topology.h"
#include "ops/apply.h"
#include "tessera/error_kind.h"
#include "tessera/ocio.h"

namespace tessera::cli {
namespace {

// Whatever an image is cut down to later is computed where it is needed only, and may come from one of any
// size.
constexpr int64_t kLongestSide = int64_t{1} << 24;
constexpr int64_t kMostSamples = int64_t{1} << 40;

bool Fits(int64_t width, int64_t height, int64_t channels) {
  return width >= 1 && height >= 1 && width <= kLongestSide && height <= kLongestSide &&
         width * height <= kMostSamples / channels;
}

std::string TooLarge(int64_t width, int64_t height, int64_t channels) {
  return "found a result of " + std::to_string(width) + " x " + std::to_string(height) + " pixels with " +
         std::to_string(channels) + (channels == 1 ? " channel" : " channels") +
         ", expected sides from 1 to " + std::to_string(kLongestSide) + " and at most 2^40 samples";
}

// A window may reach from one end of int to the other.
int64_t WidthOf(const Roi& r) { return int64_t{r.x1} - r.x0; }
int64_t HeightOf(const Roi& r) { return int64_t{r.y1} - r.y0; }

// The first where they are equal.
const LargestImage& Larger(const LargestImage& a, const LargestImage& b) {
  const auto pixels = [](const LargestImage& l) {
    return static_cast<double>(l.width) * static_cast<double>(l.height);
  };
  return pixels(b) > pixels(a) ? b : a;
}

}  // namespace

std::string WordsOf(const Step& step) {
  std::string words = step.written;
  for (const ops::ParamInfo& param : step.command->info.arguments) {
    const auto it = step.arguments.values.find(param.name);
    if (it != step.arguments.values.end() && it->second.given) words += " " + it->second.text;
  }
  return words;
}

std::string SubjectOf(const ops::OpInfo& op, const Error& error) {
  const std::string& subject = error.subject();
  const bool own = subject.substr(0, subject.find_first_of(": ")) == op.name;
  return "--" + (own ? "" : op.name + " ") + subject;
}

void RequireSize(const Entry& entry) {
  const ImageSpec& spec = entry.node.spec();
  const int64_t width = WidthOf(spec.data_window), height = HeightOf(spec.data_window);
  // A file that large has been written before.
  if (entry.largest.words.empty() || spec.data_window.empty() || Fits(width, height, spec.channel_count()))
    return;
  throw DataError(entry.largest.words, TooLarge(width, height, spec.channel_count()));
}

void RequireSize(const Step& step, const Roi& window, int channels) {
  if (!Fits(WidthOf(window), HeightOf(window), channels))
    throw UsageError(WordsOf(step), TooLarge(WidthOf(window), HeightOf(window), channels));
}

Session::Session(const Options& options, std::string history, Progress::Frame& progress)
    : options_(options), history_(std::move(history)), progress_(progress) {
  const char* const variable = std::getenv("OCIO");
  color_config = variable != nullptr && *variable != 0 ? variable : kBuiltInConfig;
}

void Session::Push(Entry entry, const std::string& words) {
  const Roi& window = entry.node.spec().data_window;
  base::RequireAllowed(words.empty() ? entry.name : words, {WidthOf(window), HeightOf(window), 1},
                       entry.node.spec().channel_count());
  entry.largest = Larger(entry.largest, {words, WidthOf(window), HeightOf(window)});
  for (Entry& part : entry.parts) {
    const Roi& own = part.node.spec().data_window;
    base::RequireAllowed(words.empty() ? part.name : words, {WidthOf(own), HeightOf(own), 1},
                         part.node.spec().channel_count());
    part.largest = Larger(part.largest, {words, WidthOf(own), HeightOf(own)});
  }
  stack_.push_back(std::move(entry));
}

Entry Session::Pop() {
  Entry entry = std::move(stack_.back());
  stack_.pop_back();
  return entry;
}

void Session::NoteSources(const std::string& word) {
  if (!options_.resume) return;
  for (const std::string& name : NamesIn(word)) {
    if (const auto state = StateOf(name)) sources.push_back(*state);
  }
}

void Session::NoteSources(const Node& image) {
  if (!options_.resume) return;
  for (const Node& node : graph::TopologicalOrder(image)) {
    const graph::Op& op = *node.data()->op;
    if (op.Kind() != graph::OpKind::kSource) continue;
    if (const auto state = StateOf(op.Describe())) sources.push_back(*state);
  }
}

Step Session::Resolved(const Step& step) {
  std::vector<std::string> words = step.deferred;
  for (std::string& word : words) {
    word = Evaluate(word, *this);
    if (!IsOutput(step)) NoteSources(word);
  }
  return ParseStep(words);
}

void Session::RunSteps(const std::vector<Step>& steps) {
  const bool ahead = IsKnownAhead(steps);
  blocks_.emplace(steps);
  std::vector<Step> done, waiting;  // those that have run; those that stand before their operands
  const auto run = [&](const Step& step) {
    const int before = Depth();
    step.command->run(step, *this);
    if (ahead) return;
    done.push_back(step);
    done.back().pushed = Depth() - before + 1;
  };
  for (flow.next = 0; flow.next < steps.size();) {
    step_ = flow.next++;
    const Step& written = steps[step_];
    const Step step = written.deferred.empty() ? written : Resolved(written);
    RequireTime(at_hand_ = WordsOf(step));
    if (SignalsEndJob::Asked() != 0) throw Cancelled();
    if (!ahead && Depth() < Needs(step)) {
      waiting.push_back(step);
      continue;
    }
    run(step);
    while (!waiting.empty() && Depth() >= Needs(waiting.back())) {
      const Step late = std::move(waiting.back());
      waiting.pop_back();
      run(late);
    }
  }
  if (ahead) return;
  done.insert(done.end(), waiting.begin(), waiting.end());  // says what they lack
  CheckStack(done, options_.TellsInputs());
}

void Session::Compute(const std::vector<Step>& steps) {
  try {
    RunSteps(steps);
    for (; !work_.empty(); work_.pop_front()) {
      RequireTime(work_.front().words);
      work_.front().run();
    }
  } catch (const Cancelled&) {
    RequireTime();
    throw;
  }
}

int Session::Commit(std::vector<std::string>& written, const PendingOutput::Look& look) {
  std::vector<PendingOutput*> outputs;
  for (PendingOutput& output : outputs_) outputs.push_back(&output);
  written.reserve(written.size() + files_.size());  // nothing may fail once they are in their places
  const SignalsWait wait;                           // no interrupt between the first and the last
  PendingOutput::CommitTogether(outputs, look);
  for (const auto& work : in_place_) work();
  std::move(files_.begin(), files_.end(), std::back_inserter(written));
  return exit_code;
}

void Session::ForParts(const std::function<void(Entry&)>& change) {
  change(Top());
  if (!options_.all_parts) return;
  OpenParts(Top(), options_);
  for (Entry& part : Top().parts) change(part);
}

namespace {

// One image out of one of each operand.
Entry Apply(const Step& step, std::vector<Entry> operands, Session& session) {
  const ops::OpInfo& op = step.command->info;
  std::vector<Node> inputs;
  for (const Entry& e : operands) inputs.push_back(e.node);
  Entry result;
  ops::Arguments arguments = step.arguments;
  std::vector<std::string> notes;
  if (!session.options().dry_run) arguments.notes = &notes;
  const auto config = arguments.values.find("config");
  if (config != arguments.values.end() && !config->second.given) config->second.text = session.color_config;
  try {
    result.node = ops::Apply(op, inputs, arguments, nullptr);
  } catch (const Error& e) {
    if (KindOf(e) != ErrorKind::kUsage) ThrowAbout(SubjectOf(op, e), e);
    std::vector<std::string> values;
    for (const ops::ParamInfo& p : op.arguments) values.push_back(arguments.Text(p.name));
    throw UsageError(SubjectOf(op, e), e.reason() + ModifiersBehind(op, values));
  }
  for (const std::string& note : notes) {
    const std::string line = step.written + ": " + note + "\n";
    session.notes != nullptr ? void(*session.notes += line) : void(std::cout << line << std::flush);
  }
  result.name = step.written;
  if (!operands.empty()) {
    if (session.options().metadata_merge) MergeMetadata(operands);
    result.attributes = std::move(operands.front().attributes);
    result.file = operands.front().file;
    result.suggested = operands.front().suggested;
  }
  for (const Entry& e : operands) result.largest = Larger(result.largest, e.largest);
  return result;
}

}  // namespace

void ApplyOperation(const Step& step, Session& session) {
  const Options& options = session.options();
  std::vector<Entry> operands(static_cast<size_t>(step.command->info.Operands(step.arguments)));
  for (auto it = operands.rbegin(); it != operands.rend(); ++it) *it = session.Pop();
  // An operand of fewer parts than another gives its last to the rest.
  std::vector<std::vector<Entry>> rows;
  size_t parts = 0;
  for (Entry& e : operands) {
    if (options.all_parts) {
      rows.push_back(TakeParts(e, options));
      parts = std::max(parts, rows.back().size());
    } else {
      LeaveParts(e, WordsOf(step), options);
    }
  }
  std::vector<Entry> others;
  for (size_t k = 0; k < parts; ++k) {
    std::vector<Entry> own;
    for (size_t i = 0; i < operands.size(); ++i)
      own.push_back(rows[i].empty() ? operands[i] : rows[i][std::min(k, rows[i].size() - 1)]);
    others.push_back(Apply(step, std::move(own), session));
  }
  Entry result = Apply(step, std::move(operands), session);
  result.parts = std::move(others);
  session.Push(std::move(result), WordsOf(step));
}

}  // namespace tessera::cli
