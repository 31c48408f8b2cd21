// PNG's filters (PNG specification, section 9): bytes of a row as differences from what is left of and above
// them.
#ifndef TESSERA_IO_CODEC_PNG_ROWS_H_
#define TESSERA_IO_CODEC_PNG_ROWS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/bytes.h"

namespace tessera::io {

// Which of a row's filters a writer takes.
enum class PngFilter : uint8_t { kNone, kAdaptive };

// Filters rows one by one; `pixel` is the bytes of a pixel, at most 8.
class PngRowFilter {
 public:
  PngRowFilter(size_t row_bytes, size_t pixel);
  // Appends the filter's number and the filtered row. `above` is null for a picture's first row. kAdaptive
  // takes the filter whose differences, read as signed bytes, have the smallest sum of magnitudes.
  void Filter(PngFilter filter, const uint8_t* row, const uint8_t* above, base::Bytes& out);

 private:
  size_t pixel_;
  std::vector<uint8_t> zeros_, left_, above_left_;  // rows with `pixel` bytes before them
  std::vector<uint8_t> tries_[2];
};

// Undoes it in place: `filtered` has the filter's number first; `above` is the unfiltered row above without
// it, null for a picture's first row. False for an unknown number.
bool PngUnfilter(uint8_t* filtered, const uint8_t* above, size_t row_bytes, size_t pixel);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_PNG_ROWS_H_
