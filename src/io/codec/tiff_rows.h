// TIFF's predictors (TIFF 6.0, section 14; Adobe Photoshop TIFF Technical Note 3): rows as differences of
// samples, or of the bytes of floats sorted by their weight.
#ifndef TESSERA_IO_CODEC_TIFF_ROWS_H_
#define TESSERA_IO_CODEC_TIFF_ROWS_H_

#include <cstddef>
#include <cstdint>

namespace tessera::io {

enum class TiffPredictor : uint8_t { kNone = 1, kHorizontal = 2, kFloat = 3 };

// Rows of `samples` samples of `sample` bytes each (1, 2 or 4; kHorizontal 1 or 2), `channels` of them to a
// pixel.
void TiffPredict(TiffPredictor predictor, const uint8_t* from, size_t samples, size_t sample, size_t channels,
                 uint8_t* to);
void TiffUnpredict(TiffPredictor predictor, uint8_t* row, size_t samples, size_t sample, size_t channels,
                   uint8_t* scratch);  // in place; a row's bytes of scratch

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_TIFF_ROWS_H_
