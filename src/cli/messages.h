// The program's own way to stderr.
#ifndef TESSERA_CLI_MESSAGES_H_
#define TESSERA_CLI_MESSAGES_H_

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace tessera::cli {

// Where errors, progress and -v go.
std::FILE* Messages();
// The same for who may not use a stream.
int MessagesDescriptor();

// While one lives, what goes to Messages() is kept: of all threads, or of the one that made it.
class KeptMessages {
 public:
  enum class Of : uint8_t { kAll, kThisThread };
  explicit KeptMessages(Of of = Of::kAll);
  ~KeptMessages();
  KeptMessages(const KeptMessages&) = delete;
  KeptMessages& operator=(const KeptMessages&) = delete;

  std::string Text() const;

 private:
  char* bytes_ = nullptr;
  size_t size_ = 0;
  std::FILE*& kept_;
  std::FILE* before_;
  std::FILE* stream_;
};

// Text of files and arguments for a terminal: one line, control characters as \x1b, the middle of a long one
// left out.
std::string Printable(std::string_view text);

// Codecs (libpng, libtiff) print to stderr on their own what OpenImageIO reports as well; an error is one
// line, so from here on only Messages() reaches stderr. Sanitizers keep theirs.
void SilenceLibraries();

}  // namespace tessera::cli

#endif  // TESSERA_CLI_MESSAGES_H_
