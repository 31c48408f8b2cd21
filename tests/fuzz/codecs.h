// Our decoders beside OpenImageIO's: what both read has the same pixels.
#ifndef TESSERA_TESTS_FUZZ_CODECS_H_
#define TESSERA_TESTS_FUZZ_CODECS_H_

#include <string>

#include "fuzz/fuzz.h"
#include "io/outcome.h"

namespace tessera::fuzz {

// `checked`: what was damaged on the way shows, so that what both read must be equal.
inline void CompareCodecs(const std::string& file, bool checked) {
  const std::string ours = testing_io::OutcomeOf(file, Codec::kAuto, 1);
  if (!checked || testing_io::IsRefusal(ours, file)) return;
  const std::string theirs = testing_io::OutcomeOf(file, Codec::kOpenImageIO, 1);
  // OpenEXR, libtiff and libpng refuse, or give up, at things of no consequence for the pixels.
  if (testing_io::IsRefusal(theirs, file)) return;
  Require(ours == theirs, "pixels that are not OpenImageIO's");
}

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_CODECS_H_
