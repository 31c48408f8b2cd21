// From the words of the command line to checked steps; nothing is opened or computed here.
#ifndef TESSERA_CLI_ARGUMENTS_H_
#define TESSERA_CLI_ARGUMENTS_H_

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cli/command.h"
#include "cli/options.h"
#include "tessera/error.h"

namespace tessera::cli {

// A wrong command line: exit code 2. what() is "SUBJECT: REASON".
class UsageError : public std::runtime_error {
 public:
  UsageError(const std::string& subject, const std::string& reason)
      : std::runtime_error(subject + ": " + reason) {}
};

// One command of the line with its checked arguments.
struct Step {
  const Command* command = nullptr;
  std::string written;  // as the user wrote it, for messages
  ops::Arguments arguments;
  const ops::OpInfo* generator = nullptr;  // --pattern: its row and its modifiers
  ops::Arguments generator_arguments;
  // The words with expressions in them, which become arguments when the step is run; empty for most.
  std::vector<std::string> deferred = {};
  int pushed = 0;  // kSplit: images, known once it has run
};

// `--name:key=value:flag` taken apart. Values may be quoted ("a:b" or 'a:b') to hold a colon.
using Modifiers = std::vector<std::pair<std::string, std::string>>;
struct Token {
  std::string name;
  Modifiers modifiers;
};
// What CHANNEL=CHOICE,CHANNEL=CHOICE names, in order; empty for a text without =.
std::vector<std::pair<std::string, std::string>> ByChannel(const std::string& text);
// `word` without its dashes.
Token SplitToken(const std::string& word);

// What to say of modifiers that stand behind an argument (--hue 30:preserve=none): where they belong. Empty
// when there are none.
std::string ModifiersBehind(const ops::OpInfo& row, const std::vector<std::string>& values);

// A whole line.
struct Line {
  Options options;
  std::vector<Step> steps;                     // without the options
  std::vector<size_t> file_words;              // positions of words that may hold a frame pattern
  std::vector<size_t> run_words, frame_words;  // of options that bear on the run, on which frames
};

// Checks everything that can be known from the words alone: names, modifiers, arguments, ranges, operands on
// the stack, images without an output. Throws UsageError.
Line ParseLine(const std::vector<std::string>& words);
// `run FILE -i NAME=FILE ...` in the words of --load-graph; every other line as it is.
std::vector<std::string> WithoutRun(const std::vector<std::string>& words);
// The words that are written into files: without options of the run, by --sansattrib without metadata.
std::vector<std::string> HistoryWords(const std::vector<std::string>& words, const Line& line);
// One command with its arguments, or a file, whose expressions have been replaced. Throws UsageError.
Step ParseStep(const std::vector<std::string>& words);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_ARGUMENTS_H_
