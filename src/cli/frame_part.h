// --part: the frames of a line that one of several processes makes.
#ifndef TESSERA_CLI_FRAME_PART_H_
#define TESSERA_CLI_FRAME_PART_H_

#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/frames.h"

namespace tessera::cli {

struct FramePart {
  int index = 1, count = 1;  // the index from 1
  // "3-of-16", for names of files.
  std::string Name() const;
};

// K/N; auto, and auto/N, from what a scheduler has put into the environment. Throws UsageError.
FramePart ParseFramePart(const std::string& text);
// The rule for auto, for help: a scheduler a line.
std::string SchedulerHelp();

// Every count-th frame from the index-th on, so that parts are equally long where frames become slower. May
// be none.
std::vector<FrameLine> FramesOfPart(const std::vector<FrameLine>& frames, const FramePart& part);

// A line and the frames that this process is to make of it.
struct FrameJob {
  std::vector<std::string> words;
  FramePart part;
  size_t all = 0;  // frames of the line
  std::vector<FrameLine> frames;
};
// As ExpandFrames. Throws UsageError for --part, where frames of other parts would be waited for, and for
// --resume, where what a frame reads is replaced by what it makes.
FrameJob MakeFrameJob(const std::vector<std::string>& words, const Line& line);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FRAME_PART_H_
