// How channels are found and recognised by name.
#ifndef TESSERA_OPS_CHANNELS_NAMES_H_
#define TESSERA_OPS_CHANNELS_NAMES_H_

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "tessera/image.h"

namespace tessera::ops {

inline bool EqualIgnoringCase(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

inline bool IsAlphaName(const std::string& name) {
  return EqualIgnoringCase(name, "A") || EqualIgnoringCase(name, "alpha");
}

// The first channel named as alpha is, or -1.
inline int AlphaByName(const std::vector<std::string>& names) {
  const auto it = std::find_if(names.begin(), names.end(), IsAlphaName);
  return it == names.end() ? -1 : static_cast<int>(it - names.begin());
}

// "R,G,B": the channels of an image, for messages.
inline std::string ListChannels(const ImageSpec& spec) {
  constexpr size_t kShown = 32;
  std::string text;
  for (size_t c = 0; c < spec.channels.size() && c < kShown; ++c)
    text += (c > 0 ? "," : "") + spec.channels[c];
  if (spec.channels.size() > kShown) text += ",…";
  return text;
}

// The conventional name of a channel at a position: R, G, B, A, channel4, ...
inline std::string PositionName(size_t position) {
  return DefaultChannelNames(std::max(4, static_cast<int>(position) + 1))[position];
}

// Comma-separated words, empty ones included.
inline std::vector<std::string> SplitCommas(const std::string& text) {
  std::vector<std::string> words;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CHANNELS_NAMES_H_
