// File names with a frame's number in them: where it stands, how many digits it has, which files there are.
#ifndef TESSERA_CLI_FRAME_NAMES_H_
#define TESSERA_CLI_FRAME_NAMES_H_

#include <optional>
#include <string>
#include <vector>

namespace tessera::cli {

// The first #, @ or %04d of a name. What stands before and behind it is text, whatever signs it has.
struct FrameName {
  std::string before, behind;
  std::string range;  // written before the sign, as in a.1-10#.exr; empty for none
  int digits = 1;     // at least
  char fill = '0';

  std::string At(int frame) const;
  // The frames of the files that there are, in order.
  std::vector<int> Present() const;
};

// Empty for a name without one. `padding`: the digits in place of those of the name, 0 for none. Throws
// UsageError for more digits than a file name could hold.
std::optional<FrameName> FindFrame(const std::string& name, int padding);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_FRAME_NAMES_H_
