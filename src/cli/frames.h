// Frame ranges and file name patterns: one line becomes one line per frame.
#ifndef TESSERA_CLI_FRAMES_H_
#define TESSERA_CLI_FRAMES_H_

#include <string>
#include <vector>

#include "cli/arguments.h"

namespace tessera::cli {

// The frames of a range such as 1-10, 1-100x2 or 3,7,10-20. Throws UsageError: not a range, backwards, step
// below 1, more than a million frames.
std::vector<int> ParseFrameRange(const std::string& subject, const std::string& range);

// The files of a pattern (with #, @ or %04d) for these frames, or, without any, for the range that the name
// brings. Throws UsageError when it is no pattern.
std::vector<std::string> SequenceFiles(const std::string& pattern, const std::vector<int>& frames,
                                       int padding);

// Expressions in braces of numbers, FRAME_NUMBER, + - * / and parentheses, such as {FRAME_NUMBER/24},
// replaced by their value; others stay for when their command is reached. Throws UsageError for one that is
// not finite.
std::vector<std::string> WithFrame(std::vector<std::string> words, int frame);

// The words of the line for each frame, its number in names and expressions: just `words` when there is
// neither a pattern nor --frames. Frames come from --frames, else from a range in a name, else from the files
// that match the first name.
// Throws UsageError, and Error when no file matches.
struct FrameLine {
  int frame = 0;
  std::vector<std::string> words;
};
std::vector<FrameLine> ExpandFrames(const std::vector<std::string>& words, const Line& line);
// The words for one frame of a number that is known only when it comes. Throws UsageError for a range in a
// name.
FrameLine ExpandFrame(const std::vector<std::string>& words, const Line& line, int frame);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FRAMES_H_
