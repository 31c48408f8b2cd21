// Images for random pipelines: contents, pixel types and layouts in memory of every kind.
#ifndef TESSERA_TESTS_RANDOM_IMAGES_H_
#define TESSERA_TESTS_RANDOM_IMAGES_H_

#include <memory>
#include <string>
#include <vector>

#include "random/draw.h"
#include "tessera/image.h"
#include "tessera/node.h"

namespace tessera::random {

enum class Content {
  kFlat,        // one colour
  kChecker,     // two colours in squares
  kNoise,       // [0, 1]
  kWide,        // noise of both signs and above 1
  kRamp,        // along x and y
  kEdge,        // black beside white, somewhere
  kTies,        // codes of 8 bits and halfway between them
  kTiny,        // denormals and smallest normal numbers
  kRare,        // noise with one hard value in fifty: NaN, infinities, huge, tiny, signed zeros
  kSpecial,     // a third of such values
  kPhotograph,  // a part of a photograph
  kCount
};
const char* ContentName(Content content);
// Whether every value of it is a finite, ordinary number.
bool IsOrdinary(Content content);

// How pixels lie in memory.
struct Layout {
  bool planar = false;
  int pixel_gap = 0, row_gap = 0;             // bytes after each pixel (or sample of a plane) and each row
  int misaligned = 0;                         // bytes before the first pixel
  bool rows_up = false, pixels_left = false;  // negative strides
  bool operator==(const Layout&) const = default;
  bool dense() const { return *this == Layout(); }
  std::string Words() const;
};
Layout DrawLayout(Draw& draw);

// What an image is; its pixels follow from it.
struct Picture {
  Roi window;
  int channels = 4;
  PixelType type = PixelType::kFloat;
  Content content = Content::kNoise;
  uint32_t seed = 0;
  Layout layout;
  std::string Words() const;
};
Picture DrawPicture(Draw& draw, const Roi& window);
// 1x1 to wider than four blocks, on and off the origin.
Roi DrawWindow(Draw& draw);
PixelType DrawType(Draw& draw);
int DrawChannels(Draw& draw);

// Pixels in some layout, amid bytes that nobody may write.
class Pixels {
 public:
  Pixels(const Roi& roi, int channels, PixelType type, const Layout& layout);
  ImageView view() const { return view_; }
  // Fills the view's own bytes with another pattern than those between them.
  void Scribble() const;
  // Whether each byte that belongs to no pixel is as it was.
  bool GapsAreWhole() const;

 private:
  std::shared_ptr<std::vector<std::byte>> bytes_;
  ImageView view_;
};

// The pixels in the picture's own layout.
Pixels Paint(const Picture& picture);
// The spec of a picture: default channel names.
ImageSpec SpecOf(const Picture& picture);
// Sample by sample, of one type.
void CopySamples(const ConstImageView& from, const ImageView& to);
// A source that gives its rows once and in order, as files do; throws Error where it is asked otherwise.
Node Streamed(const Image& image);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_IMAGES_H_
