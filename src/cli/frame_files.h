// Which files the frames of a line read and write, as far as their words tell.
#ifndef TESSERA_CLI_FRAME_FILES_H_
#define TESSERA_CLI_FRAME_FILES_H_

#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/frames.h"

namespace tessera::cli {

// Whether it is -o.
bool IsOutput(const Step& step);
// For each word whether it is the name of an output.
std::vector<bool> OutputWords(const Line& line, const std::vector<std::string>& words);

// What of a word may be a file's name: all of it, and what stands in a modifier (:file=a.tif).
std::vector<std::string> NamesIn(const std::string& word);

// Whether a frame may read what one before it writes.
bool MayReadWritten(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs);
// An output that several frames write; empty for none.
std::string OutputOfSeveral(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs);
// An output that its own frame reads; empty for none.
std::string OutputThatIsRead(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FRAME_FILES_H_
