// --resume: records of the frames that are finished, beside what was made.
#ifndef TESSERA_CLI_FRAME_RECORD_H_
#define TESSERA_CLI_FRAME_RECORD_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "cli/arguments.h"
#include "cli/file_state.h"
#include "cli/frame_part.h"

namespace tessera::cli {

// What a frame was made by, from and into.
struct FrameRecord {
  int frame = 0;
  std::string made_by;            // see MadeBy
  std::vector<FileState> inputs;  // as they were before the frame was begun
  std::vector<std::pair<std::string, FileContent>> outputs;
};

// The hash of what of a frame's words bears on its files, of the program's version and of OCIO's variable.
std::string MadeBy(const std::vector<std::string>& words, const Line& line);
// The files that the words of a frame name and that are there, but for its outputs; and OCIO's config.
std::vector<FileState> InputsNamed(const std::vector<std::string>& words, const std::vector<bool>& outputs);

// Every process adds to a file of its own and reads those of all parts. A record is one line of JSON with its
// own hash behind it, written by one call: a torn one is none, and nothing has to be locked.
class FrameRecords {
 public:
  // NAMEframes.K-of-N.jsonl, NAME being the output's name up to the frame's number. Throws Error for a file
  // that cannot be read.
  FrameRecords(const std::string& output, int padding, const FramePart& part);
  ~FrameRecords();
  FrameRecords(const FrameRecords&) = delete;
  FrameRecords& operator=(const FrameRecords&) = delete;

  // Whether one says that these words were carried out with these inputs, whose other inputs are as they
  // were, too, and whose outputs hold what was written then, byte for byte.
  bool IsDone(const std::string& made_by, const std::vector<FileState>& inputs) const;
  // Throws SystemError. The outputs must have their names.
  void Add(const FrameRecord& record);

  const std::string& file() const { return file_; }

 private:
  void ReadAll(const std::string& file);

  std::string file_;
  int descriptor_ = -1;
  std::multimap<std::string, FrameRecord> records_;  // by made_by
};

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FRAME_RECORD_H_
