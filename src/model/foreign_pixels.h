// A function of pixels that another library computes, as a plain parameter: the engine runs it, the reference
// checks it, and neither needs to know the library.
#ifndef TESSERA_MODEL_FOREIGN_PIXELS_H_
#define TESSERA_MODEL_FOREIGN_PIXELS_H_

#include <functional>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::model {

struct ForeignPixels {
  // On `count` RGBA float pixels in place; may be called by several threads at once.
  using Function = std::function<void(float* rgba, int count)>;
  Function run;    // what the pipeline runs
  Function check;  // the same computation as the library takes it step by step, nothing merged or rearranged
  bool alpha = false;  // reads and writes the image's alpha; otherwise it sees an alpha of 1
};

}  // namespace tessera::model
TESSERA_API_END

#endif  // TESSERA_MODEL_FOREIGN_PIXELS_H_
