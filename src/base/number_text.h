// Numbers as messages and help show them: the shortest text that reads back as the same number.
#ifndef TESSERA_BASE_NUMBER_TEXT_H_
#define TESSERA_BASE_NUMBER_TEXT_H_

#include <charconv>
#include <concepts>
#include <string>

namespace tessera::base {

// A template, so that a float does not show the digits it gets as a double.
template <std::floating_point T>
std::string NumberText(T value) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

}  // namespace tessera::base

#endif  // TESSERA_BASE_NUMBER_TEXT_H_
