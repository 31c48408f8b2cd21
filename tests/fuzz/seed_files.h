// Seeds and words of a target as files.
#ifndef TESSERA_TESTS_FUZZ_SEED_FILES_H_
#define TESSERA_TESTS_FUZZ_SEED_FILES_H_

#include <string>

namespace tessera::fuzz {

// One file for each seed.
void WriteSeeds(const std::string& folder);
// As libFuzzer and AFL read dictionaries.
void WriteDictionary(const std::string& file);

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_SEED_FILES_H_
