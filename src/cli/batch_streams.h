// Standard input and output as --batch and --stream have them.
#ifndef TESSERA_CLI_BATCH_STREAMS_H_
#define TESSERA_CLI_BATCH_STREAMS_H_

#include <cstddef>
#include <string>

namespace tessera::cli {

constexpr size_t kLongestLine = size_t{1} << 20;

// A descriptor of our own for the stream, which is /dev/null from here on: libraries print to stdout, and
// lines may name /dev/stdin. Throws Error.
int Take(int stream, const char* name, int flags);

// After a call that failed: whether it may be made again. Waits for events of poll where the descriptor does
// not.
bool Again(int descriptor, short events);

// Lines, whether a newline ends them or the stream. Of one that is too long the start.
class Lines {
 public:
  explicit Lines(int descriptor) : descriptor_(descriptor) {}

  // Waits for the next; false at the end.
  bool Next(std::string& line);

  // The same by one who waits for other things too: a line of what has been read, false where it takes more.
  bool Held(std::string& line);
  // Reads more, once; false at the end of the stream, where Held may have a last line.
  bool Fill();
  int descriptor() const { return descriptor_; }

 private:
  const int descriptor_;
  std::string held_, line_;
  size_t next_ = 0;
  bool ended_ = false;
};

// Ends the process where nobody reads any more.
void WriteAll(int descriptor, const std::string& text);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_BATCH_STREAMS_H_
