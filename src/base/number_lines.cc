// Whatever the locale, a number is written as in C.
#include "base/number_lines.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <vector>

#include "base/input_file.h"
#include "tessera/error_kind.h"

namespace tessera::base {

void ReadNumberLines(const std::string& file, const std::string& what, const NumberLine& line,
                     const std::function<void(std::span<const double>, int)>& take) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF", kBetween = " \t\r,";
  InputFile stream(file, what, kMostText);
  int number = 0;
  const auto refuse = [&](const std::string& found) {
    throw DataError(file,
                    "line " + std::to_string(number) + ": found " + found + ", expected " + line.numbers);
  };
  std::vector<double> numbers;
  for (std::string text; GetLine(stream, text, file, number + 1);) {
    std::string_view rest = text;
    if (++number == 1 && rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
    rest = rest.substr(0, rest.find('#'));
    numbers.clear();
    while (true) {
      rest.remove_prefix(std::min(rest.find_first_not_of(kBetween), rest.size()));
      if (rest.empty()) break;
      const std::string_view word = rest.substr(0, rest.find_first_of(kBetween));
      if (numbers.size() == line.most) refuse("more than " + std::to_string(line.most) + " numbers");
      const char* const begin = word.data() + (word.starts_with('+') && !word.starts_with("+-") ? 1 : 0);
      double value = 0;
      const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
      if (error != std::errc() || end != word.data() + word.size() ||
          !std::isfinite(static_cast<float>(value)))
        refuse("\"" + Shown(word) + "\"");
      numbers.push_back(value);
      rest.remove_prefix(word.size());
    }
    if (numbers.empty()) continue;
    if (numbers.size() < line.least) refuse(std::to_string(numbers.size()) + " numbers");
    take(numbers, number);
  }
}

}  // namespace tessera::base
