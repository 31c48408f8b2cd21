// LUT files as --lut reads them: our checks, then OpenColorIO, then the picture.
#include "fuzz/luts.h"

#include <OpenColorIO/OpenColorIO.h>

#include "fuzz/operations.h"
#include "tessera/ocio.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() { return LutSeeds(); }
std::vector<std::string> Words() { return LutWords(); }
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const Node kPicture = fuzz::SmallPicture(3);
  fuzz::Input in(data, size);
  const std::string& name = fuzz::PutLut(in);
  fuzz::Try([&] { fuzz::RenderSmall(ApplyLut(kPicture, name)); });
  OCIO_NAMESPACE::ClearAllCaches();  // they go by names
  return 0;
}
