// Inputs made from other inputs.
#ifndef TESSERA_TESTS_FUZZ_MUTATE_H_
#define TESSERA_TESTS_FUZZ_MUTATE_H_

#include <string>
#include <vector>

#include "random/draw.h"

namespace tessera::fuzz {

// Changes `input` once: bits, bytes, numbers, words, parts moved, doubled, dropped or of `other`. `words` may
// be empty.
void MutateOnce(random::Draw& draw, std::string& input, const std::string& other,
                const std::vector<std::string>& words);
// A few times, to at most `most` bytes.
void Mutate(random::Draw& draw, std::string& input, const std::string& other,
            const std::vector<std::string>& words, size_t most);

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_MUTATE_H_
