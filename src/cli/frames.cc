// Frame ranges, and the line once per frame.
#include "cli/frames.h"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <string_view>

#include "cli/frame_names.h"
#include "tessera/error.h"

namespace tessera::cli {
namespace {

constexpr int64_t kMostFrames = 1000000;

// Takes a non-negative number off the front.
bool TakeNumber(std::string_view& text, int& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || value < 0) return false;
  text.remove_prefix(static_cast<size_t>(end - text.data()));
  return true;
}

// One part of a range.
struct Part {
  int first = 0, last = 0, step = 1;
  bool others = false;  // those that the steps leave out

  int64_t Count() const {
    const int64_t all = int64_t{last} - first + 1, steps = (all + step - 1) / step;
    return others ? all - steps : steps;
  }
  void AddTo(std::vector<int>& frames) const {
    for (int64_t f = first; f <= last; f += others ? 1 : step) {
      if (!others || (f - first) % step != 0) frames.push_back(static_cast<int>(f));
    }
  }
};

Part ParsePart(const std::string& subject, std::string_view part) {
  const std::string shown(part);
  const auto refuse = [&](const std::string& expected) {
    throw UsageError(subject, "found the frames \"" + shown + "\", expected " + expected);
  };
  Part p;
  if (!TakeNumber(part, p.first)) refuse("a range such as 1-10, 1-100x2 or 3,7,10-20");
  p.last = p.first;
  if (part.empty()) return p;
  if (part[0] != '-') refuse("a range such as 1-10, 1-100x2 or 3,7,10-20");
  part.remove_prefix(1);
  if (!TakeNumber(part, p.last)) refuse("a last frame after the dash");
  if (p.last < p.first) refuse("a last frame of at least " + std::to_string(p.first));
  if (!part.empty()) {
    if (part[0] != 'x' && part[0] != 'y') refuse("x or y and a step after the last frame");
    p.others = part[0] == 'y';
    part.remove_prefix(1);
    if (!TakeNumber(part, p.step) || !part.empty() || p.step < 1) refuse("a step of at least 1");
  }
  return p;
}

struct Pattern {
  size_t word;  // which word of the line
  FrameName name;
};

std::vector<Pattern> FindPatterns(const std::vector<std::string>& words, const Line& line) {
  std::vector<Pattern> patterns;
  for (const size_t at : line.file_words) {
    // A file of just that name is meant itself.
    if (words[at].find_first_of("#@%") == std::string::npos || OIIO::Filesystem::exists(words[at])) continue;
    if (auto name = FindFrame(words[at], line.options.frame_padding))
      patterns.push_back({at, std::move(*name)});
  }
  return patterns;
}

// The frames of one name: its own range, or the files that are there.
std::vector<int> FramesOf(const std::string& word, const FrameName& name) {
  if (!name.range.empty()) return ParseFrameRange(word, name.range);
  const std::vector<int> frames = name.Present();
  if (frames.empty()) throw Error(word, "no file matches this pattern; --frames gives the frames of outputs");
  return frames;
}

// The number of frames that a command with the modifiers animate and frame asks for (--lic:animate=24); 0 for
// none.
int AnimatedFrames(const Line& line) {
  int count = 0;
  for (const Step& step : line.steps) {
    const auto& values = step.arguments.values;
    if (values.contains("animate") && values.contains("frame"))
      count = std::max(count, step.arguments.Integer("animate"));
  }
  return count;
}

constexpr std::string_view kFrameNumber = "FRAME_NUMBER";

// The number that an expression of numbers, FRAME_NUMBER, + - * / and parentheses stands for: in full, where
// those that are evaluated as commands are reached have six digits, as oiiotool's.
class FrameExpression {
 public:
  FrameExpression(std::string_view text, int frame) : whole_(text), rest_(text), frame_(frame) {}

  // None for an expression of other things too.
  std::optional<double> Value() {
    const double value = Sum();
    if (other_ || !rest_.empty()) return std::nullopt;
    if (!std::isfinite(value)) throw UsageError("{" + std::string(whole_) + "}", "found no finite number");
    return value;
  }

 private:
  bool Take(std::string_view word) {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(' '), rest_.size()));
    if (!rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    rest_.remove_prefix(std::min(rest_.find_first_not_of(' '), rest_.size()));
    return true;
  }
  double Sum() {
    double value = Product();
    while (true) {
      if (Take("+")) {
        value += Product();
      } else if (Take("-")) {
        value -= Product();
      } else {
        return value;
      }
    }
  }
  double Product() {
    double value = Factor();
    while (true) {
      if (Take("*")) {
        value *= Factor();
      } else if (Take("/")) {
        value /= Factor();
      } else {
        return value;
      }
    }
  }
  double Factor() {
    double value = 0;
    if (other_ || ++depth_ > 100) return Other();
    if (Take("-")) {
      value = -Factor();
    } else if (Take("(")) {
      value = Sum();
      if (!Take(")")) return Other();
    } else if (Take(kFrameNumber)) {
      value = frame_;
    } else {
      const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
      if (error != std::errc()) return Other();
      rest_.remove_prefix(static_cast<size_t>(end - rest_.data()));
    }
    --depth_;
    return value;
  }

  double Other() {
    other_ = true;
    return 0;
  }

  std::string_view whole_, rest_;
  int frame_, depth_ = 0;
  bool other_ = false;
};

// What stands in the braces that open here, where that names the frame; else nothing.
std::string FrameBraces(const std::string& word, size_t open) {
  const size_t close = word.find('}', open);
  if (close == std::string::npos) return "";
  std::string inner = word.substr(open + 1, close - open - 1);
  return inner.find(kFrameNumber) == std::string::npos ? "" : inner;
}

bool NamesFrame(const std::string& word) {
  for (size_t open = word.find('{'); open != std::string::npos; open = word.find('{', open + 1)) {
    if (!FrameBraces(word, open).empty()) return true;
  }
  return false;
}

}  // namespace

std::vector<int> ParseFrameRange(const std::string& subject, const std::string& range) {
  int64_t count = 0;
  std::vector<int> frames;
  for (size_t begin = 0; begin <= range.size();) {
    const size_t end = std::min(range.find(',', begin), range.size());
    const Part part = ParsePart(subject, std::string_view(range).substr(begin, end - begin));
    count += part.Count();
    if (count > kMostFrames || (part.others && int64_t{part.last} - part.first > kMostFrames)) {
      throw UsageError(subject,
                       "found the frames \"" + range + "\", expected at most " + std::to_string(kMostFrames));
    }
    part.AddTo(frames);
    begin = end + 1;
  }
  if (frames.empty())
    throw UsageError(subject, "found the frames \"" + range + "\", expected a range such as 1-10 or 1-100x2");
  return frames;
}

std::vector<std::string> SequenceFiles(const std::string& pattern, const std::vector<int>& frames,
                                       int padding) {
  const auto name = FindFrame(pattern, padding);
  if (!name) throw UsageError(pattern, "found a name without # or %04d, expected a pattern of frame numbers");
  std::vector<std::string> files;
  const bool own = frames.empty() && !name->range.empty();
  for (const int frame : own ? ParseFrameRange(pattern, name->range) : frames)
    files.push_back(name->At(frame));
  return files;
}

std::vector<std::string> WithFrame(std::vector<std::string> words, int frame) {
  for (std::string& word : words) {
    for (size_t open = word.find('{'); open != std::string::npos; open = word.find('{', open + 1)) {
      const std::string inner = FrameBraces(word, open);
      if (inner.empty()) continue;
      const std::optional<double> value = FrameExpression(inner, frame).Value();
      if (!value) continue;
      char number[64];
      const auto end = std::to_chars(number, number + sizeof number, *value);
      word.replace(open, inner.size() + 2, number, static_cast<size_t>(end.ptr - number));
    }
  }
  return words;
}

std::vector<FrameLine> ExpandFrames(const std::vector<std::string>& words, const Line& line) {
  const std::string& range = line.options.frames;
  const std::vector<Pattern> patterns = FindPatterns(words, line);
  std::vector<int> frames;
  if (!range.empty()) frames = ParseFrameRange("--frames", range);
  const int animated = AnimatedFrames(line);
  if (patterns.empty()) {
    if (animated > 0)
      throw UsageError("animate", "found no file name with # or %04d, expected one for the frames");
    if (!range.empty()) {
      // The sequence of --motionblur is read whole for every frame of the line.
      const auto reads_sequence = [](const Step& s) { return s.arguments.values.contains("SEQUENCE"); };
      const bool sequence = std::any_of(line.steps.begin(), line.steps.end(), reads_sequence);
      throw UsageError(
          "--frames", sequence
                          ? "found # or %04d in no name but that of --motionblur, expected it in the output's"
                          : "found no file name with # or %04d, expected at least one");
    }
    if (std::any_of(words.begin(), words.end(), NamesFrame))
      throw UsageError("{FRAME_NUMBER}", "found no frames, expected a file name with # or %04d");
    return {{0, words}};
  }

  // Every name has as many frames as the first, in its own numbers where it brings a range of its own.
  std::vector<std::vector<int>> numbers;
  if (range.empty() && animated > 0) {
    frames.resize(static_cast<size_t>(animated));
    std::iota(frames.begin(), frames.end(), 1);
  } else if (range.empty()) {
    frames = FramesOf(words[patterns[0].word], patterns[0].name);
  }
  for (const Pattern& p : patterns) {
    std::vector<int> own = p.name.range.empty() ? frames : ParseFrameRange(words[p.word], p.name.range);
    if (own.size() != frames.size()) {
      throw UsageError(words[p.word], "found " + std::to_string(own.size()) + " frames, expected " +
                                          std::to_string(frames.size()) + " as for " +
                                          (range.empty() ? words[patterns[0].word] : "--frames"));
    }
    numbers.push_back(std::move(own));
  }
  std::vector<FrameLine> lines;
  for (size_t f = 0; f < frames.size(); ++f) {
    lines.push_back({frames[f], words});
    for (size_t p = 0; p < patterns.size(); ++p)
      lines.back().words[patterns[p].word] = patterns[p].name.At(numbers[p][f]);
    lines.back().words = WithFrame(std::move(lines.back().words), frames[f]);
  }
  return lines;
}

FrameLine ExpandFrame(const std::vector<std::string>& words, const Line& line, int frame) {
  FrameLine own{frame, words};
  for (const Pattern& p : FindPatterns(words, line)) {
    if (!p.name.range.empty())
      throw UsageError(words[p.word], "found a range, expected # or %04d alone: frames are counted from 1");
    own.words[p.word] = p.name.At(frame);
  }
  own.words = WithFrame(std::move(own.words), frame);
  return own;
}

}  // namespace tessera::cli
