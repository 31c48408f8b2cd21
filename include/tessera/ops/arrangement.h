/// Where pixels and windows lie: flips and turns, moves, display windows, orientation, fitting, pasting,
/// mosaics, trimming. What resamples is said beside tessera/ops/geometry.h. @file
#ifndef TESSERA_OPS_ARRANGEMENT_H_
#define TESSERA_OPS_ARRANGEMENT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/roi.h"

TESSERA_API_BEGIN
namespace tessera {

struct RenderOptions;

/// Pixels change places within the display window, bit for bit; a data window within it goes along. kFlip:
/// top and bottom; kFlop: left and right; kRotate90, kRotate180, kRotate270: clockwise, the display window
/// keeps its upper left corner; kTranspose: (x, y) goes to (y, x), the windows with it. As oiiotool's
/// commands of these names, but that those lose pixels in a quarter turn of a display window off the origin.
/// Error where windows would lead beyond 2^31.
enum class Rearrangement : uint8_t { kFlip, kFlop, kRotate90, kRotate180, kRotate270, kTranspose };
/// Other places, as Rearrangement says.
Node Rearrange(const Node& image, Rearrangement how);
/// Rearrangement::kFlip.
inline Node Flip(const Node& image) { return Rearrange(image, Rearrangement::kFlip); }
/// Rearrangement::kFlop.
inline Node Flop(const Node& image) { return Rearrange(image, Rearrangement::kFlop); }
/// Rearrangement::kRotate90.
inline Node Rotate90(const Node& image) { return Rearrange(image, Rearrangement::kRotate90); }
/// Rearrangement::kRotate180.
inline Node Rotate180(const Node& image) { return Rearrange(image, Rearrangement::kRotate180); }
/// Rearrangement::kRotate270.
inline Node Rotate270(const Node& image) { return Rearrange(image, Rearrangement::kRotate270); }
/// Rearrangement::kTranspose.
inline Node Transpose(const Node& image) { return Rearrange(image, Rearrangement::kTranspose); }

/// Whole pixels to the right and down.
struct Offset {
  int x = 0;  ///< to the right
  int y = 0;  ///< down

  /// The same two numbers.
  bool operator==(const Offset&) const = default;
};
/// The pixels of the data window move in a circle: what leaves on one side comes in on the other. Bits stay.
Node CircularShift(const Node& image, const Offset& by);
/// Pixels and data window move, the display window stays. Bits stay. Error where that leads beyond 2^31.
Node Move(const Node& image, const Offset& by);
/// Moved until the data window begins there.
Node WithOrigin(const Node& image, const Offset& origin);

/// Another display window; no pixel is touched.
Node WithDisplayWindow(const Node& image, const Roi& window);
/// The data window becomes the display window; pixels that the image does not have are zero.
Node CropToDisplay(const Node& image);

/// How the camera was held, 1 to 8 as Exif and TIFF number it: the item Orientation, 1 where there is none.
int OrientationOf(const ImageSpec& spec);
/// The item Orientation said anew; no pixel is touched. Error unless it is 1 to 8.
Node WithOrientation(const Node& image, int orientation);
/// Turned and mirrored as OrientationOf says, bit for bit; the result's is 1.
Node Reorient(const Node& image);

/// A turn of the picture by an angle, clockwise as it is seen, about a point, by default the display window's
/// centre: Warp with that matrix. Quarter turns about a centre that lets them keep bits.
struct RotateParams {
  double degrees = 0;                ///< clockwise
  bool about_center = true;          ///< of the display window; else about the point
  double center_x = 0;               ///< of the point, in pixels
  double center_y = 0;               ///< of the point, in pixels
  std::string filter;                ///< empty: lanczos3
  bool recompute_window = false;     ///< to hold the turned data window
  bool compress_highlights = false;  ///< logarithms of what is bright
};
/// Turned, as RotateParams says.
Node Rotate(const Node& image, const RotateParams& params);

/// Another resolution without a filter, as oiiotool's --resample: the windows of Resize; every result pixel
/// is the image at its centre, interpolated between four pixels, or the nearest pixel bit for bit. Positions
/// are those of oiiotool, in float. Beyond the data window the rest of the display window is black, beyond
/// both the edge is repeated. |error| <= 4 u V, V the largest of the four values. Error as Resize.
struct ResampleParams {
  int width = 0;            ///< of the display window
  int height = 0;           ///< of the display window
  int x = 0;                ///< of the display window
  int y = 0;                ///< of the display window
  bool interpolate = true;  ///< else the nearest
};
/// Another resolution, as ResampleParams says.
Node Resample(const Node& image, const ResampleParams& params);

/// Resized to fit into a window with its aspect kept. kLetterbox: all of the picture, as large as may be;
/// kWidth, kHeight: that side is filled, whatever becomes of the other. The picture lies in the window's
/// middle, to a whole pixel; with `exact` to a fraction, its aspect to the last digit, its edge pixels mixed
/// with nothing.
enum class FitMode : uint8_t { kLetterbox, kWidth, kHeight };
/// What is fitted how; as oiiotool's --fit.
struct FitParams {
  int width = 0;                       ///< of the display window
  int height = 0;                      ///< of the display window
  int x = 0;                           ///< of the display window
  int y = 0;                           ///< of the display window
  FitMode mode = FitMode::kLetterbox;  ///< which side is filled
  bool pad = false;                    ///< the data window becomes the display window
  bool exact = false;                  ///< no rounding to whole pixels
  std::string filter;                  ///< empty: lanczos3 or blackman-harris, as Resize
  bool compress_highlights = false;    ///< as in Resize
};
/// Fitted, as FitParams says.
Node Fit(const Node& image, const FitParams& params);

/// The front image's pixels take the place of the back image's where they lie, moved by an offset; alpha is a
/// channel as any other. Windows are the back image's, or with `merge_windows` hold both; channels that the
/// front image does not have stay, those that it has beyond them are left out. Bits stay.
struct PasteParams {
  Offset at;                   ///< that the front image moves
  bool merge_windows = false;  ///< both images' windows
};
/// One image in another, as PasteParams says.
Node Paste(const Node& front, const Node& back, const PasteParams& params = {});

/// Images side by side, row after row, each in a field as large as the largest display window, its own
/// window's origin counted; or fitted into fields of a stated size. As many channels as the image with most
/// has; what is left over is zero. Bits stay where nothing is fitted.
struct MosaicParams {
  int columns = 1;     ///< images side by side
  int pad = 0;         ///< pixels between fields
  int fit_width = 0;   ///< of a field, 0 for the largest
  int fit_height = 0;  ///< of a field
};
/// Images side by side, as MosaicParams says. Error without an image.
Node Mosaic(const std::vector<Node>& images, const MosaicParams& params);

/// Offset and blend: along an axis x + share (shifted - x), `shifted` the image shifted by half in a circle,
/// share 1 in the first and last pixel and 0 from `blend` of the size on. Edges meet without a seam, the
/// middle keeps its bits. Made of other operations. Error unless blend is in [0.01, 0.5].
struct TileableParams {
  double blend = 0.25;  ///< of the data window's width and height
  bool x = true;        ///< left and right meet
  bool y = true;        ///< top and bottom meet
};
/// A texture that repeats, as TileableParams says.
Node Tileable(const Node& image, const TileableParams& params = {});

/// The smallest window that holds every pixel with a sample other than zero (a NaN is none), found by
/// computing the whole image; its first pixel where there is no such one, or where the image is empty
/// nothing.
Roi NonZeroWindow(const Node& image, const RenderOptions& options);
/// Cropped to NonZeroWindow; the display window stays.
Node Trim(const Node& image, const RenderOptions& options);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_ARRANGEMENT_H_
