// Mutations as other fuzzers have them: none knows what the bytes mean but for digits.
#include "fuzz/mutate.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace tessera::fuzz {
namespace {

using random::Draw;

// Where something may be put.
size_t Gap(Draw& draw, const std::string& s) {
  return static_cast<size_t>(draw.Below(static_cast<int>(s.size()) + 1));
}
// An existing byte.
size_t At(Draw& draw, const std::string& s) {
  return static_cast<size_t>(draw.Below(static_cast<int>(s.size())));
}

// A part of it, short ones more often.
std::string_view PartOf(Draw& draw, const std::string& s) {
  const size_t first = At(draw, s), left = s.size() - first;
  const size_t longest = draw.Chance(0.7) ? std::min<size_t>(left, 16) : left;
  return std::string_view(s).substr(first, 1 + static_cast<size_t>(draw.Below(static_cast<int>(longest))));
}

// Limits of integers, in either order of bytes.
void PutNumber(Draw& draw, std::string& s) {
  const int size = draw.Of({1, 2, 4, 8});
  const uint64_t limit = draw.Of({uint64_t{0}, uint64_t{1}, uint64_t{0x7F}, uint64_t{0x80}, uint64_t{0xFF},
                                  uint64_t{0x7FFF}, uint64_t{0x8000}, uint64_t{0xFFFF}, uint64_t{0x10000},
                                  uint64_t{0x7FFFFFFF}, uint64_t{0x80000000}, uint64_t{0xFFFFFFFF},
                                  uint64_t{1} << 32, ~uint64_t{0}, ~uint64_t{0} >> 1});
  uint64_t value = limit + static_cast<uint64_t>(draw.Between(-2, 2));
  char bytes[8];
  for (int i = 0; i < size; ++i, value >>= 8) bytes[i] = static_cast<char>(value);
  if (draw.Chance(0.5)) std::reverse(bytes, bytes + size);
  const size_t at = At(draw, s);
  s.replace(at, std::min(static_cast<size_t>(size), s.size() - at), bytes, static_cast<size_t>(size));
}

// Digits become another number.
void ChangeDigits(Draw& draw, std::string& s) {
  constexpr std::string_view kDigits = "0123456789";
  size_t first = s.find_first_of(kDigits, At(draw, s));
  if (first == std::string::npos) first = s.find_first_of(kDigits);
  if (first == std::string::npos) return;
  const size_t end = std::min(s.find_first_not_of(kDigits, first), s.size());
  const char* const number = draw.Of({"0",
                                      "1",
                                      "2",
                                      "-1",
                                      "00",
                                      "7",
                                      "16",
                                      "255",
                                      "256",
                                      "1000000",
                                      "2147483647",
                                      "2147483648",
                                      "-2147483648",
                                      "4294967296",
                                      "9223372036854775807",
                                      "9223372036854775808",
                                      "1e-300",
                                      "1e300",
                                      "1e999",
                                      "-0",
                                      "nan",
                                      "inf",
                                      "-inf",
                                      ".5",
                                      "0x10",
                                      "1.5",
                                      "99999999999999999999999999"});
  if (draw.Chance(0.3)) {
    s[first] = static_cast<char>('0' + draw.Below(10));
  } else {
    s.replace(first, end - first, number);
  }
}

}  // namespace

void MutateOnce(Draw& draw, std::string& s, const std::string& other, const std::vector<std::string>& words) {
  if (s.empty()) s.assign(1, static_cast<char>(draw.Below(256)));
  switch (draw.Weighted({6, 5, 4, 4, 4, 4, 3, 3, words.empty() ? 0.0 : 8.0, 3, 2})) {
    case 0:
      s[At(draw, s)] ^= static_cast<char>(1 << draw.Below(8));
      break;
    case 1:
      s[At(draw, s)] = static_cast<char>(draw.Below(256));
      break;
    case 2:
      PutNumber(draw, s);
      break;
    case 3:
      ChangeDigits(draw, s);
      break;
    case 4: {  // gone
      const std::string_view part = PartOf(draw, s);
      s.erase(static_cast<size_t>(part.data() - s.data()), part.size());
      break;
    }
    case 5: {  // once more, somewhere
      const std::string part(PartOf(draw, s));
      s.insert(Gap(draw, s), part);
      break;
    }
    case 6: {  // over something else
      const std::string part(PartOf(draw, s));
      const size_t at = At(draw, s);
      s.replace(at, std::min(part.size(), s.size() - at), part);
      break;
    }
    case 7: {  // of the other
      if (other.empty()) break;
      const std::string part(PartOf(draw, other));
      const size_t at = Gap(draw, s);
      s.replace(at, draw.Chance(0.5) ? 0 : std::min(part.size(), s.size() - at), part);
      break;
    }
    case 8: {
      const std::string& word = draw.Of(words);
      const size_t at = Gap(draw, s);
      s.replace(at, draw.Chance(0.6) ? 0 : std::min(word.size(), s.size() - at), word);
      break;
    }
    case 9:  // the start of one, the end of the other
      if (!other.empty()) s = s.substr(0, Gap(draw, s)) + other.substr(Gap(draw, other));
      break;
    default:
      s.insert(Gap(draw, s), static_cast<size_t>(draw.Between(1, 40)), static_cast<char>(draw.Below(256)));
  }
}

void Mutate(Draw& draw, std::string& input, const std::string& other, const std::vector<std::string>& words,
            size_t most) {
  do {
    MutateOnce(draw, input, other, words);
  } while (draw.Chance(0.6));
  if (input.size() > most) input.resize(most);
}

}  // namespace tessera::fuzz
