// Words for an operation's arguments and modifiers, drawn from its row in the registry.
#ifndef TESSERA_TESTS_RANDOM_VALUES_H_
#define TESSERA_TESTS_RANDOM_VALUES_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "random/draw.h"

namespace tessera::random {

struct Words {
  std::vector<std::string> positional;
  std::vector<std::pair<std::string, std::string>> modifiers;
  bool operator==(const Words&) const = default;
};
// One of OpInfo::examples, as ops::ParseExample reads it.
Words WordsOf(const ops::OpInfo& op, const std::string& example);
ops::Arguments Parsed(const ops::OpInfo& op, const Words& words);
// Whether the numbers that a row's time hangs on are as small as those that are drawn.
bool IsCheap(const ops::OpInfo& op, const ops::Arguments& arguments);

// What the values are for.
struct Surroundings {
  int channels = 4, width = 16, height = 16;
};

// Draws words; knows what the examples of all rows say, and files that arguments may name.
class WordSource {
 public:
  // `folder`: where files for arguments are written (LUTs, a colour config); it has to exist.
  WordSource(const std::vector<const ops::OpInfo*>& rows, const std::string& folder);
  Words Drawn(Draw& draw, const ops::OpInfo& op, const Surroundings& around) const;

 private:
  Words Any(Draw& draw, const ops::OpInfo& op, const Surroundings& around) const;
  std::string Value(Draw& draw, const ops::OpInfo& op, const ops::ParamInfo& param,
                    const Surroundings& around) const;
  std::string Text(Draw& draw, const ops::OpInfo& op, const ops::ParamInfo& param,
                   const Surroundings& around) const;

  std::map<std::string, std::vector<std::string>> own_,
      shared_;                                             // examples' values by "op param" and "param"
  std::map<std::string, std::vector<std::string>> files_;  // by parameter
};

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_VALUES_H_
