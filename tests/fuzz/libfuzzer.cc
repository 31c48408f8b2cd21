// With libFuzzer: `fuzz_NAME --seeds FOLDER` writes what mutation starts from, and a dictionary beside it.
#include <cstdlib>
#include <string>

#include "fuzz/seed_files.h"

extern "C" int LLVMFuzzerInitialize(int* count, char*** words) {
  if (*count == 3 && std::string((*words)[1]) == "--seeds") {
    const std::string folder = (*words)[2];
    tessera::fuzz::WriteSeeds(folder);
    tessera::fuzz::WriteDictionary(folder + ".dict");
    std::exit(0);
  }
  return 0;
}
