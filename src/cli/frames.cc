// Frame ranges and file name patterns, by OpenImageIO's rules for sequences; ranges are checked first,
// because its own reading takes "1-999999999" at its word.
#include "cli/frames.h"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <string_view>

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

// The number of frames that one part of a range may give.
int64_t CheckPart(const std::string& subject, std::string_view part) {
  const std::string shown(part);
  const auto refuse = [&](const std::string& expected) {
    throw UsageError(subject, "found the frames \"" + shown + "\", expected " + expected);
  };
  int first = 0, last = 0, step = 1;
  if (!TakeNumber(part, first)) refuse("a range such as 1-10, 1-100x2 or 3,7,10-20");
  if (part.empty()) return 1;
  if (part[0] != '-') refuse("a range such as 1-10, 1-100x2 or 3,7,10-20");
  part.remove_prefix(1);
  if (!TakeNumber(part, last)) refuse("a last frame after the dash");
  if (last < first) refuse("a last frame of at least " + std::to_string(first));
  if (!part.empty()) {
    if (part[0] != 'x' && part[0] != 'y') refuse("x or y and a step after the last frame");
    part.remove_prefix(1);
    if (!TakeNumber(part, step) || !part.empty() || step < 1) refuse("a step of at least 1");
  }
  return (int64_t{last} - first) / (shown.find('y') == std::string::npos ? step : 1) + 1;
}

struct Pattern {
  size_t word;         // which word of the line
  std::string normal;  // with %0Nd
  std::string range;   // embedded, or empty
};

std::vector<Pattern> FindPatterns(const std::vector<std::string>& words, const Line& line) {
  std::vector<Pattern> patterns;
  for (const size_t at : line.file_words) {
    Pattern p{at, "", ""};
    // A file of just that name is meant itself.
    if (words[at].find_first_of("#@%") != std::string::npos && !OIIO::Filesystem::exists(words[at]) &&
        OIIO::Filesystem::parse_pattern(words[at].c_str(), line.options.frame_padding, p.normal, p.range)) {
      patterns.push_back(std::move(p));
    }
  }
  return patterns;
}

// The frames of one name: its own range, or the files that are there.
std::vector<int> FramesOf(const std::string& word, const Pattern& pattern) {
  if (!pattern.range.empty()) return ParseFrameRange(word, pattern.range);
  std::vector<int> frames;
  std::vector<std::string> files;
  OIIO::Filesystem::scan_for_matching_filenames(pattern.normal, frames, files);
  if (frames.empty()) throw Error(word, "no file matches this pattern; --frames gives the frames of outputs");
  std::sort(frames.begin(), frames.end());
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

// The number that an expression of numbers, FRAME_NUMBER, + - * / and parentheses stands for.
class FrameExpression {
 public:
  FrameExpression(std::string_view text, int frame) : whole_(text), rest_(text), frame_(frame) {}

  double Value() {
    const double value = Sum();
    if (!rest_.empty() || !std::isfinite(value)) Refuse();
    return value;
  }

 private:
  [[noreturn]] void Refuse() const {
    throw UsageError("{" + std::string(whole_) + "}",
                     "found no finite number, expected an expression of numbers, FRAME_NUMBER, + - * / and "
                     "parentheses, as FRAME_NUMBER/24");
  }
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
    if (++depth_ > 100) Refuse();
    double value = 0;
    if (Take("-")) {
      value = -Factor();
    } else if (Take("(")) {
      value = Sum();
      if (!Take(")")) Refuse();
    } else if (Take(kFrameNumber)) {
      value = frame_;
    } else {
      const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
      if (error != std::errc()) Refuse();
      rest_.remove_prefix(static_cast<size_t>(end - rest_.data()));
    }
    --depth_;
    return value;
  }

  std::string_view whole_, rest_;
  int frame_, depth_ = 0;
};

}  // namespace

std::vector<int> ParseFrameRange(const std::string& subject, const std::string& range) {
  int64_t count = 0;
  for (size_t begin = 0; begin <= range.size();) {
    const size_t end = std::min(range.find(',', begin), range.size());
    count += CheckPart(subject, std::string_view(range).substr(begin, end - begin));
    if (count > kMostFrames) {
      throw UsageError(subject,
                       "found the frames \"" + range + "\", expected at most " + std::to_string(kMostFrames));
    }
    begin = end + 1;
  }
  std::vector<int> frames;
  if (!OIIO::Filesystem::enumerate_sequence(range, frames) || frames.empty()) {
    throw UsageError(subject, "found the frames \"" + range + "\", expected a range such as 1-10 or 1-100x2");
  }
  return frames;
}

std::vector<std::string> SequenceFiles(const std::string& pattern, const std::vector<int>& frames,
                                       int padding) {
  std::string normal, range;
  std::vector<std::string> files;
  if (!OIIO::Filesystem::parse_pattern(pattern.c_str(), padding, normal, range)) {
    throw UsageError(pattern, "found a name without # or %04d, expected a pattern of frame numbers");
  }
  const std::vector<int> wanted = frames.empty() && !range.empty() ? ParseFrameRange(pattern, range) : frames;
  if (!wanted.empty() && !OIIO::Filesystem::enumerate_file_sequence(normal, wanted, files)) {
    throw UsageError(pattern, "found a frame pattern that cannot be filled in, expected # or %04d");
  }
  return files;
}

std::vector<std::string> WithFrame(std::vector<std::string> words, int frame) {
  for (std::string& word : words) {
    for (size_t open = word.find('{'); open != std::string::npos; open = word.find('{', open + 1)) {
      const size_t close = word.find('}', open);
      if (close == std::string::npos) break;
      const std::string inner = word.substr(open + 1, close - open - 1);
      if (inner.find(kFrameNumber) == std::string::npos) continue;
      char number[64];
      const auto end = std::to_chars(number, number + sizeof number, FrameExpression(inner, frame).Value());
      word.replace(open, close + 1 - open, number, static_cast<size_t>(end.ptr - number));
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
    if (WithFrame(words, 1) != words)
      throw UsageError("{FRAME_NUMBER}", "found no frames, expected a file name with # or %04d");
    return {{0, words}};
  }

  // Every name has as many frames as the first, in its own numbers where it brings a range of its own.
  std::vector<std::vector<std::string>> files;
  if (range.empty() && animated > 0) {
    frames.resize(static_cast<size_t>(animated));
    std::iota(frames.begin(), frames.end(), 1);
  } else if (range.empty()) {
    frames = FramesOf(words[patterns[0].word], patterns[0]);
  }
  for (const Pattern& p : patterns) {
    std::vector<int> own = p.range.empty() ? frames : ParseFrameRange(words[p.word], p.range);
    if (own.size() != frames.size()) {
      throw UsageError(words[p.word], "found " + std::to_string(own.size()) + " frames, expected " +
                                          std::to_string(frames.size()) + " as for " +
                                          (range.empty() ? words[patterns[0].word] : "--frames"));
    }
    files.emplace_back();
    if (!OIIO::Filesystem::enumerate_file_sequence(p.normal, own, files.back()) ||
        files.back().size() != own.size()) {
      throw UsageError(words[p.word], "found a frame pattern that cannot be filled in, expected # or %04d");
    }
  }
  std::vector<FrameLine> lines;
  for (size_t f = 0; f < frames.size(); ++f) {
    lines.push_back({frames[f], words});
    for (size_t p = 0; p < patterns.size(); ++p) lines.back().words[patterns[p].word] = files[p][f];
    lines.back().words = WithFrame(std::move(lines.back().words), frames[f]);
  }
  return lines;
}

}  // namespace tessera::cli
