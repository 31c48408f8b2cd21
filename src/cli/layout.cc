// Lines, columns, terminals.
#include "cli/layout.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace tessera::cli {
namespace {

constexpr size_t kLeast = 40, kMost = 120;  // that lines of help may have

}  // namespace

std::string Layout::Heading(const std::string& text) const {
  return color ? "\033[1m" + text + "\033[0m" : text;
}

std::string Layout::Name(const std::string& synopsis) const {
  if (!color) return synopsis;
  const size_t end = std::min(synopsis.find_first_of(" ["), synopsis.size());
  return "\033[1;36m" + synopsis.substr(0, end) + "\033[0m" + synopsis.substr(end);
}

std::string Layout::Wrapped(const std::string& text, size_t indent) const {
  std::string result;
  const std::string margin(indent, ' ');
  size_t column = 0;
  for (size_t begin = 0; begin < text.size();) {
    size_t end = text.find_first_of(" \n", begin);
    if (end == std::string::npos) end = text.size();
    const size_t length = end - begin, shown = ColumnsOf(text.substr(begin, length));
    if (column > 0 && column + 1 + shown > columns) {
      result += '\n';
      column = 0;
    }
    if (length > 0) {
      result += column == 0 ? margin : " ";
      column += (column == 0 ? indent : 1) + shown;
      result.append(text, begin, length);
    }
    if (end < text.size() && text[end] == '\n') {
      result += '\n';
      column = 0;
    }
    begin = end + 1;
  }
  if (!result.empty() && result.back() != '\n') result += '\n';
  return result;
}

size_t TerminalColumns(int descriptor) {
  if (isatty(descriptor) != 1) return 0;
  if (const char* const text = std::getenv("COLUMNS"); text != nullptr) {
    const long columns = std::strtol(text, nullptr, 10);
    if (columns > 0 && columns < 10000) return static_cast<size_t>(columns);
  }
  winsize size{};
  return ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

size_t ColumnsOf(const std::string& text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

Layout LayoutOfOutput() {
  Layout layout;
  const size_t columns = TerminalColumns(STDOUT_FILENO);
  if (columns == 0) return layout;
  layout.columns = std::clamp(columns, kLeast, kMost);
  const char *const refused = std::getenv("NO_COLOR"), *const terminal = std::getenv("TERM");
  layout.color =
      (refused == nullptr || *refused == 0) && terminal != nullptr && std::strcmp(terminal, "dumb") != 0;
  return layout;
}

}  // namespace tessera::cli
