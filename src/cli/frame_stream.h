// --stream: frames of standard input and output, one after the other, as FFmpeg has them in pipes.
#ifndef TESSERA_CLI_FRAME_STREAM_H_
#define TESSERA_CLI_FRAME_STREAM_H_

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "cli/session.h"
#include "cli/stream_frame.h"
#include "io/video/y4m.h"

namespace tessera::cli {

// Both streams of a line. Its functions may be called by several threads at once but for Next and Write,
// which are called for one frame after the other.
class FrameStream {
 public:
  // Throws UsageError for a line that neither reads nor writes frames, and for what --stream says.
  explicit FrameStream(const Line& line);
  ~FrameStream();
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;

  // Whether frames come from standard input, and go to standard output.
  bool Reads() const { return reads_; }
  bool Writes() const { return writes_; }

  // The next frame, none at the end. Throws DataError for what is no stream of frames, and where it ends
  // within one.
  std::optional<StreamFrame> Next();
  // The image of a frame: R'G'B', or Y' alone, with alpha multiplied in. It borrows the frame's memory.
  Entry ImageOf(StreamFrame& frame) const;
  // The samples that are written of an image, as an image. Throws DataError for channels that the format has
  // not.
  Node SamplesOf(const Node& image) const;
  // Evaluates what SamplesOf gave.
  StreamFrame FrameOf(const Node& samples, const RenderOptions& render, RunStats* stats) const;
  // Throws DataError for another size than the first frame's, SystemError where nobody reads any more.
  void Write(const StreamFrame& frame);

 private:
  bool Read(std::byte* to, size_t count);
  std::string ReadLine(const char* what, bool& ended);
  void ChooseFormats();
  void ReadHeader();
  const io::Y4mHeader& output() const { return given_ ? *given_ : in_; }
  io::YccCoding Coding(const io::Y4mHeader& header, int width, int height) const;

  StreamOptions options_;
  bool reads_ = false, writes_ = false, y4m_in_ = true, y4m_out_ = true;
  io::Y4mHeader in_;                    // of what is read, once it is known
  std::optional<io::Y4mHeader> given_;  // of what is written, where it is not as what is read
  int64_t frames_read_ = 0, frames_written_ = 0;
  int first_width_ = 0, first_height_ = 0;  // of those written
  std::vector<std::byte> held_;             // read and not used
  size_t used_ = 0;
  int output_file_ = -1;
};

// Whether the step reads a frame of the stream (-).
bool ReadsStandardInput(const Step& step);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FRAME_STREAM_H_
