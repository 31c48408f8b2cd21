// A checked line once per frame: frames under way at once, their outputs and messages in order.
#ifndef TESSERA_CLI_FRAME_RUN_H_
#define TESSERA_CLI_FRAME_RUN_H_

#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/frame_part.h"
#include "cli/stream_frame.h"

namespace tessera::cli {

inline constexpr int kMostParallelFrames = 256;

// Frames of the line that may be computed at the same time: 1 where it tells something while it runs, or asks
// for something between frames, where a frame may read what one before it writes, and with a limit of
// memory or time, which is for all that is under way.
int FramesAtOnce(const Line& line, const std::vector<FrameLine>& frames);

// Appends the names of the files that are written; returns the exit code. Whatever is under way at once, each
// frame's files get their names after those of the frame before it, and after an error no more do. Frames
// that --resume finds finished stay as they are.
// `stream`: of --stream; where it reads, its frames are those of the run, whatever the job's.
int RunFrames(const Line& line, const FrameJob& job, std::vector<std::string>& written,
              FrameStream* stream = nullptr);

// One line on stderr, whatever the message holds.
void PrintError(const std::string& message);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FRAME_RUN_H_
