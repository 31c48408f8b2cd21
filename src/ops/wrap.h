// One word for what lies beyond an edge, whatever an operation, another program or an earlier line calls it.
#ifndef TESSERA_OPS_WRAP_H_
#define TESSERA_OPS_WRAP_H_

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "tessera/wrap.h"

TESSERA_API_BEGIN
namespace tessera::ops {

// `:wrap=`. Its choices are those of clamp, repeat, mirror, mirror101, black, renormalize, valid, stop, ...
// that the operation has.
ParamInfo WrapModifier(std::vector<std::string> choices, const char* default_value, const char* help);
// What a row's own word for it means: renormalize and stop are the same.
Wrap WrapNamed(const std::string& word);
// Throws Error("wrap", "found mirror101, expected clamp or ...") unless `wrap` is one of them.
void RequireWrap(const std::string& op, Wrap wrap, std::initializer_list<Wrap> expected);
// What most operations have: black, clamp, repeat or mirror.
void RequireImageWrap(const std::string& op, Wrap wrap);

// Other words for a parameter: border= for wrap=, and for bordervalue=, where the operation has one.
std::vector<std::string> OtherNames(const ParamInfo& param);
// Other words for its choices, and what each stands for: {"periodic", "repeat"}.
std::vector<std::pair<std::string, std::string>> OtherChoices(const ParamInfo& param);
// A choice, or several between commas, in the row's own words.
std::string OwnWords(const ParamInfo& param, const std::string& text);

// Whether it is meant as a list of numbers.
bool IsNumeric(const std::string& text);
// The modifier of that name or other name, null for none. `text` is what is to be its value: where two share
// a word, numbers are the list of numbers and words the other.
const ParamInfo* FindModifier(const OpInfo& op, const std::string& name, const std::string& text);

}  // namespace tessera::ops
TESSERA_API_END

#endif  // TESSERA_OPS_WRAP_H_
