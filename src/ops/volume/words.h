// What the parts of --volume's words share: choices, refusals, and where the volume comes from.
#ifndef TESSERA_OPS_VOLUME_WORDS_H_
#define TESSERA_OPS_VOLUME_WORDS_H_

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/node.h"
#include "tessera/ops/volume.h"

namespace tessera::ops::volume {

inline constexpr char kWordsName[] = "volume";

inline const std::vector<std::string> kModes = {"iso",   "solid", "bump",  "melt",      "fur",  "fire",
                                                "hyper", "over",  "under", "attenuate", "xray", "mip"};
inline const std::vector<std::string> kTypes = {"uint8", "uint16", "half", "float"};

template <typename E>
E ChoiceOf(const Arguments& a, const char* name, const std::vector<std::string>& choices) {
  return static_cast<E>(std::find(choices.begin(), choices.end(), a.Text(name)) - choices.begin());
}

inline Vector3 VectorOf(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

// A modifier, and the words of which one is needed beside it.
struct Use {
  const char *name, *words;
};
inline bool Holds(const std::string& words, const std::string& word) {
  return (" " + words + " ").find(" " + word + " ") != std::string::npos;
}
[[noreturn]] inline void Refuse(const std::string& name, const std::string& beside,
                                const std::string& expected) {
  throw Error(kWordsName,
              "found " + name + "= beside " + beside + ", which has no use for it, expected " + expected);
}

// The volume that solid=, mesh=, file= or the image below are. What does not change between calls is made
// once: fields of solids, and of files as long as they stay as they are.
Volume VolumeOfWords(std::span<const Node> inputs, const Arguments& a);

// Five numbers a point (value, colour, opacity), or a file of them.
VolumeTransferFunction TransferOfWords(const std::string& text);

// What mode=solid is made of: texture=, block= and ramp= into the parameters.
void SetTexture(const Arguments& a, VolumeParams& p);

}  // namespace tessera::ops::volume

#endif  // TESSERA_OPS_VOLUME_WORDS_H_
