// Text files of numbers, a line for each of what they describe.
#ifndef TESSERA_BASE_NUMBER_LINES_H_
#define TESSERA_BASE_NUMBER_LINES_H_

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// How many numbers a line holds, and what they are: "x y z r g b size".
struct NumberLine {
  std::string numbers;
  size_t least = 1, most = 1;
};

// Gives `take` the numbers of every line that holds any, in order, and which line it is, from 1. They are
// parted by blanks or commas; # begins a remark, a byte-order mark before the first line is nothing. Throws
// Error naming the file, where it cannot be read with `what` it was expected to be, else with the line: for
// fewer or more numbers than that, for what is no number and for one that no float holds.
void ReadNumberLines(const std::string& file, const std::string& what, const NumberLine& line,
                     const std::function<void(std::span<const double> numbers, int line)>& take);

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_NUMBER_LINES_H_
