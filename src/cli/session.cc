// Runs a checked line: steps in order, then what they compute, then all outputs at once.
#include "cli/session.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <span>

#include "base/policy.h"
#include "cli/limits.h"
#include "cli/signals.h"
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

Session::Session(const Options& options, std::string history)
    : options_(options), history_(std::move(history)) {
  const char* const variable = std::getenv("OCIO");
  color_config = variable != nullptr && *variable != 0 ? variable : kBuiltInConfig;
}

void Session::Push(Entry entry, const std::string& words) {
  const Roi& window = entry.node.spec().data_window;
  base::RequireAllowed(words.empty() ? entry.name : words, {WidthOf(window), HeightOf(window), 1},
                       entry.node.spec().channel_count());
  entry.largest = Larger(entry.largest, {words, WidthOf(window), HeightOf(window)});
  stack_.push_back(std::move(entry));
}

Entry Session::Pop() {
  Entry entry = std::move(stack_.back());
  stack_.pop_back();
  return entry;
}

int Session::Run(const std::vector<Step>& steps, std::vector<std::string>& written) {
  try {
    for (const Step& step : steps) {
      RequireTime(at_hand_ = WordsOf(step));
      step.command->run(step, *this);
    }
    for (; !work_.empty(); work_.pop_front()) {
      RequireTime(work_.front().words);
      work_.front().run();
    }
  } catch (const Cancelled&) {
    RequireTime();
    throw;
  }
  std::vector<PendingOutput*> outputs;
  for (PendingOutput& output : outputs_) outputs.push_back(&output);
  written.reserve(written.size() + files_.size());  // nothing may fail once they are in their places
  const SignalsWait wait;                           // no interrupt between the first and the last
  PendingOutput::CommitTogether(outputs);
  std::move(files_.begin(), files_.end(), std::back_inserter(written));
  return exit_code;
}

void ApplyOperation(const Step& step, Session& session) {
  const ops::OpInfo& op = step.command->info;
  std::vector<Entry> operands(static_cast<size_t>(op.Operands(step.arguments)));
  for (auto it = operands.rbegin(); it != operands.rend(); ++it) *it = session.Pop();
  std::vector<Node> inputs;
  for (const Entry& e : operands) inputs.push_back(e.node);
  Entry result;
  ops::Arguments arguments = step.arguments;
  std::vector<std::string> notes;
  if (!session.options().dry_run) arguments.notes = &notes;
  const auto config = arguments.values.find("config");
  if (config != arguments.values.end() && !config->second.given) config->second.text = session.color_config;
  try {
    result.node = op.make(inputs, arguments, nullptr);
  } catch (const Error& e) {
    if (KindOf(e) != ErrorKind::kUsage) ThrowAbout(SubjectOf(op, e), e);
    std::vector<std::string> values;
    for (const ops::ParamInfo& p : op.arguments) values.push_back(arguments.Text(p.name));
    throw UsageError(SubjectOf(op, e), e.reason() + ModifiersBehind(op, values));
  }
  for (const std::string& note : notes) std::cout << step.written << ": " << note << std::endl;
  result.name = step.written;
  if (!operands.empty()) result.attributes = std::move(operands.front().attributes);
  for (const Entry& e : operands) result.largest = Larger(result.largest, e.largest);
  session.Push(std::move(result), WordsOf(step));
}

}  // namespace tessera::cli
