// How text is laid out for whoever reads it: columns, and bold and colour where that is a terminal.
#ifndef TESSERA_CLI_LAYOUT_H_
#define TESSERA_CLI_LAYOUT_H_

#include <cstddef>
#include <string>

namespace tessera::cli {

struct Layout {
  size_t columns = 100;
  bool color = false;

  std::string Heading(const std::string& text) const;
  // The first word of a synopsis, up to its modifiers.
  std::string Name(const std::string& synopsis) const;
  // `text` broken at blanks, every line indented; ends with a line end.
  std::string Wrapped(const std::string& text, size_t indent) const;
};

// Columns of the terminal behind a descriptor: $COLUMNS where that is a number, else what the terminal says;
// 0 where it is no terminal.
size_t TerminalColumns(int descriptor);
// Columns that a text takes, which is UTF-8.
size_t ColumnsOf(const std::string& text);
// Of standard output: 100 columns and no colour where that is no terminal; no colour either with $NO_COLOR
// (no-color.org) or TERM=dumb.
Layout LayoutOfOutput();

}  // namespace tessera::cli

#endif  // TESSERA_CLI_LAYOUT_H_
