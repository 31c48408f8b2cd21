// File names with a frame's number in them, by the rules that OpenImageIO has for sequences. Its own
// functions for them take the whole name for a format string and for a regular expression.
#include "cli/frame_names.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "base/directory.h"
#include "cli/arguments.h"

namespace tessera::cli {
namespace {

constexpr int64_t kMostDigits = 64;
constexpr size_t kLongestRange = 4096;
constexpr std::string_view kDigits = "0123456789";

size_t DigitsAt(std::string_view text, size_t at) {
  return std::min(text.find_first_not_of(kDigits, at), text.size()) - at;
}

// Whether the whole text is ranges such as 3,7,10-20x2, as far as signs go.
bool IsRange(std::string_view text) {
  size_t at = 0;
  const auto number = [&] {
    const size_t length = DigitsAt(text, at);
    at += length;
    return length > 0;
  };
  while (number()) {
    if (at < text.size() && text[at] == '-') {
      ++at;
      if (!number()) return false;
      if (at < text.size() && (text[at] == 'x' || text[at] == 'y')) {
        ++at;
        if (!number()) return false;
      }
    }
    if (at == text.size()) return true;
    if (text[at++] != ',') return false;
  }
  return false;
}

// Where the range begins that ends with the text; its size where there is none.
size_t RangeAt(std::string_view text) {
  const size_t least = text.size() - std::min(text.size(), kLongestRange);
  size_t first = text.size();
  while (first > least && (kDigits.find(text[first - 1]) != std::string_view::npos ||
                           std::string_view(",-xy").find(text[first - 1]) != std::string_view::npos)) {
    --first;
  }
  for (; first < text.size(); ++first) {
    const bool inside = first > 0 && DigitsAt(text.substr(0, first), first - 1) == 1;
    if (!inside && IsRange(text.substr(first))) return first;
  }
  return text.size();
}

// The length of the sign at this place, 0 for none, and the digits that it asks for.
size_t SignAt(std::string_view name, size_t at, int64_t& digits, char& fill) {
  digits = 1, fill = '0';
  if (name[at] == '#' || name[at] == '@') {
    const size_t end = std::min(name.find_first_not_of("#@", at), name.size());
    digits = 0;
    for (size_t i = at; i < end; ++i) digits += name[i] == '#' ? 4 : 1;
    return end - at;
  }
  if (name[at] != '%') return 0;
  const size_t width = DigitsAt(name, at + 1), end = at + 1 + width;
  if (end >= name.size() || name[end] != 'd') return 0;
  if (width > 0) {
    fill = name[at + 1] == '0' ? '0' : ' ';
    if (std::from_chars(name.data() + at + 1, name.data() + end, digits).ec != std::errc())
      digits = kMostDigits + 1;
    digits = std::max<int64_t>(digits, 1);
  }
  return end + 1 - at;
}

}  // namespace

std::string FrameName::At(int frame) const {
  std::string number = std::to_string(frame);
  const auto wanted = static_cast<size_t>(digits);
  if (number.size() < wanted) number.insert(0, wanted - number.size(), fill);
  return before + number + behind;
}

std::vector<int> FrameName::Present() const {
  const size_t slash = before.rfind('/');
  const std::string directory = slash == std::string::npos ? "" : before.substr(0, slash + 1);
  // The number may be a directory's.
  const size_t end = std::min(behind.find('/'), behind.size());
  const std::string first = before.substr(directory.size()), last = behind.substr(0, end);
  std::vector<int> frames;
  for (const std::string& name : base::NamesIn(directory.empty() ? "." : directory)) {
    if (name.size() <= first.size() + last.size() || !name.starts_with(first) || !name.ends_with(last))
      continue;
    const char* number = name.data() + first.size();
    const char* const stop = name.data() + name.size() - last.size();
    while (fill == ' ' && number != stop && *number == ' ') ++number;
    int frame = 0;
    const auto [read, error] = std::from_chars(number, stop, frame);
    if (error != std::errc() || read != stop || frame < 0) continue;
    const std::string whole = At(frame);
    if (whole.compare(directory.size(), name.size(), name) != 0) continue;
    std::error_code code;
    if (end == behind.size() || std::filesystem::exists(whole, code)) frames.push_back(frame);
  }
  std::sort(frames.begin(), frames.end());
  return frames;
}

std::optional<FrameName> FindFrame(const std::string& name, int padding) {
  for (size_t at = 0; (at = name.find_first_of("#@%", at)) != std::string::npos; ++at) {
    int64_t digits = 1;
    char fill = '0';
    const size_t length = SignAt(name, at, digits, fill);
    if (length == 0) continue;
    if (padding > 0) digits = padding, fill = '0';
    if (digits > kMostDigits) {
      throw UsageError(name, "found a frame number of " + std::to_string(digits) +
                                 " digits or more, expected at most " + std::to_string(kMostDigits));
    }
    const size_t range = RangeAt(std::string_view(name).substr(0, at));
    return FrameName{name.substr(0, range), name.substr(at + length), name.substr(range, at - range),
                     static_cast<int>(digits), fill};
  }
  return std::nullopt;
}

}  // namespace tessera::cli
