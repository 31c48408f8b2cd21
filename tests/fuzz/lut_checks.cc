// What is checked of a LUT's text before OpenColorIO reads it.
#include "fuzz/luts.h"
#include "ocio/config.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() { return LutSeeds(); }
std::vector<std::string> Words() { return LutWords(); }
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const std::string& name = fuzz::PutLut(in);
  fuzz::Try([&] { ocio::RequireLutFile(name); });
  fuzz::Try([&] { ocio::CheckedLutFile checked(name); });
  return 0;
}
