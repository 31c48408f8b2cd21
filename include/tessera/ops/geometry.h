/// Resampling: resize, pixel zoom, sub-pixel shift, affine and projective warp, warps by coordinate images,
/// mip chains. @file
#ifndef TESSERA_OPS_GEOMETRY_H_
#define TESSERA_OPS_GEOMETRY_H_

#include <cstdint>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/ops/filter.h"
#include "tessera/roi.h"
#include "tessera/wrap.h"

TESSERA_API_BEGIN
namespace tessera {

/// Pixel (x, y) covers [x, x+1) x [y, y+1), its centre is at (x + 1/2, y + 1/2); x right, y down. Every
/// channel is resampled alike; nothing is clamped. Coordinates are computed in double; one within 2^-17 of a
/// pixel's centre or edge counts as there, so identities, whole shifts, flips and quarter turns keep the
/// pixels' bits. Weights sum to 1 within 1 ULP. NaN and infinities spread only to results that give them
/// weight. |error| <= 6 u V, V the largest |value| under the filter times the sum of |weight|, u = 2^-24.
/// Sources: Keys 1981; Mitchell and Netravali 1988; doc/maths/geometry.md.
///
/// Filters, by oiiotool's names (width in pixels of the coarser image): box 1, triangle (linear) 2, gaussian
/// 3, sharp-gaussian 2, catmull-rom (catrom) 4, blackman-harris 3, sinc 4, lanczos3 6, radial-lanczos3 6,
/// mitchell 4, bspline 4, disk 1, cubic 4, keys 4, simon 4, rifman 4. Error for any other name. @file

/// The display window becomes width x height, as oiiotool's --resize; beyond the data window the rest of
/// the display window is black, beyond both the edge is repeated. The filter's distance is in result pixels
/// when reducing, in source pixels when enlarging, per axis. An empty filter is lanczos3, or blackman-harris
/// when either side grows. The result's display window is (x, y, x + width, y + height), its data window is
/// scaled along, the origin rounded down and the size up.
/// Where a box halves both sides of an image of 8- or 16-bit integers, the result, written as such, is the
/// exact mean of four codes, rounded half to even. `compress_highlights`: oiiotool's highlightcomp=,
/// logarithms of what is brighter than 0.18 in R, G and B are filtered. Error unless 1 <= width, height <=
/// 2^24. Cost: O(pixels x (height + width of filter)).
struct ResizeParams {
  int width = 0;                     ///< of the display window
  int height = 0;                    ///< of the display window
  int x = 0;                         ///< of the display window
  int y = 0;                         ///< of the display window
  std::string filter;                ///< empty: lanczos3 or blackman-harris
  bool compress_highlights = false;  ///< logarithms of what is bright
};
/// Another resolution, as ResizeParams says.
Node Resize(const Node& image, const ResizeParams& params);

/// Mip levels. Level k has the sides max(1, floor(side / 2^k)) and is filtered from level 0 with the filter
/// widened to 2^k pixels: box, linear, mitchell or lanczos3. A level of its own starts at the image's corner.
/// All levels (-1) make one picture: level 0 on the left, levels 1, 2, ... below each other in a column on
/// its right; what is left over is zero. Halves of integers by a box are rounded as Resize does. Error for a
/// level that the image does not have.
struct MipParams {
  std::string filter = "box";  ///< box, linear, mitchell or lanczos3
  Wrap wrap = Wrap::kClamp;    ///< as the texture is wrapped
  int level = -1;              ///< -1: all

  /// kAuto: all levels of a box in one pass, which takes the whole picture; kDirect: each by itself, in
  /// tiles.
  FilterMethod method = FilterMethod::kAuto;
};
/// A level, or all in one picture, as MipParams says.
Node Mip(const Node& image, const MipParams& params = {});
/// Levels 0, 1, ... down to 1 x 1, each a node of its own.
std::vector<Node> MipChain(const Node& image, const MipParams& params = {});
/// Levels down to 1 x 1.
int MipLevelCount(const ImageSpec& image);
/// Where a level lies in the picture of all levels; the whole picture for -1.
Roi MipLevelWindow(const ImageSpec& image, int level);

/// GL's pixel zoom: pixel (i, j) becomes the rectangle between (i x, j y) and ((i+1) x, (j+1) y), counted
/// from the display window's corner; a result pixel takes the pixel whose rectangle holds its centre, bit for
/// bit. Negative factors reflect about that corner, so that windows lie left of or above it. Error when a
/// factor is 0, not finite, or no pixel would be left.
struct ZoomParams {
  double x = 1;  ///< factor across
  double y = 1;  ///< factor down
};
/// Pixels as rectangles, as ZoomParams says.
Node Zoom(const Node& image, const ZoomParams& params);

/// The content moves by (x, y) pixels, right and down; the windows stay. Whole shifts keep bits.
struct ShiftParams {
  double x = 0;                     ///< pixels to the right
  double y = 0;                     ///< pixels down
  std::string filter = "lanczos3";  ///< of fractions of a pixel
  Wrap wrap = Wrap::kClamp;         ///< what is seen beyond the data window
};
/// Moved, as ShiftParams says.
Node Shift(const Node& image, const ShiftParams& params);

/// The image is carried over by a 3x3 matrix, row-major; as oiiotool a position is a ROW vector: (x' q, y' q,
/// q) = (x, y, 1) M. A result pixel gathers about its centre's origin with the filter, widened by the map's
/// derivatives where it reduces (to at most 65,536 pixels per axis). The windows stay, or with
/// `recompute_window` hold the warped data window. What lies behind the projector (q <= 0 where the centre of
/// the image has q > 0) is black, as is NaN. Error unless M is finite and invertible. An empty filter is
/// lanczos3. `compress_highlights` as in Resize.
///
/// Two filters follow the footprint of a result pixel, a parallelogram of any direction, instead of the box
/// around it, at a cost that the map does not change (doc/maths/geometry.md). "trilinear": the mean of up to
/// `anisotropy` look-ups in mip levels along the footprint's longer axis, as graphics hardware does it;
/// "ewa": an elliptical Gaussian (Heckbert 1989), up to 70 * `anisotropy` pixels of two mip levels.
/// Footprints longer than `anisotropy` times their width are widened to that. Both need a third more memory
/// than the image. Error unless 1 <= anisotropy <= 64.
struct WarpParams {
  std::vector<double> matrix;        ///< 9 numbers, row-major, for row vectors
  std::string filter;                ///< empty: lanczos3; also trilinear, ewa
  Wrap wrap = Wrap::kBlack;          ///< what is seen beyond the data window
  bool recompute_window = false;     ///< to hold the warped data window
  bool compress_highlights = false;  ///< logarithms of what is bright
  int anisotropy = 16;               ///< of trilinear and ewa: a footprint's longest length, in widths of it
};
/// Carried over by a matrix, as WarpParams says.
Node Warp(const Node& image, const WarpParams& params);

/// Each result pixel is the image at (s, t), read from two channels of `coordinates`, in [0, 1] across the
/// image's display window (`flip` counts from the other side). The result has the coordinates' windows and
/// the image's channels. The filter keeps its width of source pixels. A coordinate that is NaN or infinite
/// gives black. An empty filter is lanczos3.
struct StWarpParams {
  std::string filter;          ///< empty: lanczos3
  Wrap wrap_s = Wrap::kBlack;  ///< beyond the left and right edge
  Wrap wrap_t = Wrap::kBlack;  ///< beyond the upper and lower edge
  int channel_s = 0;           ///< of the coordinates
  int channel_t = 1;           ///< of the coordinates
  bool flip_s = false;         ///< s counts from the right
  bool flip_t = false;         ///< t counts from the bottom
};
/// Read at an image's coordinates, as StWarpParams says.
Node StWarp(const Node& image, const Node& coordinates, const StWarpParams& params = {});

/// result(x, y) = image(x + amount (d_x - centre), y + amount (d_y - centre)), d_x and d_y two channels of
/// the displacement image (the same one where it has one channel); amount in pixels. SVG's feDisplacementMap
/// with a filter. Both need the same data window. An empty filter is triangle.
struct DistortParams {
  double amount = 0;         ///< pixels per unit of displacement
  double centre = 0.5;       ///< the displacement that moves nothing
  int channel_x = 0;         ///< of the displacement image
  int channel_y = 1;         ///< of the displacement image
  std::string filter;        ///< empty: triangle
  Wrap wrap = Wrap::kClamp;  ///< what is seen beyond the data window
};
/// Displaced, as DistortParams says.
Node Distort(const Node& image, const Node& displacement, const DistortParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_GEOMETRY_H_
