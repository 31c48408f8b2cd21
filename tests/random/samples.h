// Samples of two images side by side: where they differ, in words.
#ifndef TESSERA_TESTS_RANDOM_SAMPLES_H_
#define TESSERA_TESTS_RANDOM_SAMPLES_H_

#include <functional>
#include <optional>
#include <string>

#include "tessera/image.h"

namespace tessera::random {

// One channel of the pixels, as pixels of their own.
ConstImageView Channel(ConstImageView view, int channel);
// The value of a sample; exact.
double SampleAt(const ConstImageView& view, int x, int y, int c);
// Nothing where all samples of got.roi have the same bits (any NaN is like any other), else the first that
// differs. With `floats`, the result before it was rounded, integers may differ by one code where that lies
// within 2^-12 of a code and a few roundings from a tie; `off`, where given, is asked how far roundings of
// terms that cancel may take it.
using OffFunction = std::function<double(int x, int y, int channel)>;
std::optional<std::string> Differ(const ConstImageView& got, const ConstImageView& want,
                                  const ConstImageView* floats = nullptr, const OffFunction& off = {});
// The same for a packed result against the float result, rounded in plain C++.
std::optional<std::string> DifferRounded(const ConstImageView& packed, const ConstImageView& floats,
                                         bool near_ties, const OffFunction& off = {});
// Whether every sample is finite and of ordinary size.
bool AllOrdinary(const ConstImageView& view);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_SAMPLES_H_
