/// Lookups: colour tables per channel, RGB through a 3-D table, pixel textures whose coordinates are an
/// image. @file
#ifndef TESSERA_OPS_LOOKUP_H_
#define TESSERA_OPS_LOOKUP_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/render.h"
#include "tessera/table.h"

TESSERA_API_BEGIN
namespace tessera {

/// Every pixel's channels are the coordinates (s,t,r,q) of a lookup; the result has the table's channels.
/// Coordinates are not rounded. Any dimension goes with any pixel format. |error| <= 3 u (four dimensions 4
/// u, cubic in D dimensions 8 u D 1.25^(D-1)) times the largest magnitude among the entries read, u = 2^-24,
/// for whatever entries: linear lookups go from the nearer entry, simplex sums from both ends. (Cubic: proved
/// with fused multiply-add, with 10.2 in place of 8 without; 10^8 adverse cases came to 5.5, 9.8, 10.6 and 15
/// u.) But for cubic, each axis whose positions are no exact products (its size, with kEnds less one, is no
/// power of two) adds u/2 of the largest difference among these entries. Nearest and lookups at an entry
/// return its bits. kMipmap: level log2(rho), rho the larger of the coordinate differences per pixel along x
/// and y in texels of level 0, each the smaller of the differences to the two neighbours that exist and are
/// valid, so that an object's edge does not blur; blended linearly between two levels of MipChain(kBox).
///
/// kTrilinear and kEwa follow what a pixel covers, in any direction: an ellipse by the differences to the
/// neighbours on both sides, each counted by the other's square, those outside of the image, behind the
/// projector or masked not at all. kTrilinear: the mean of up to `anisotropy` linear lookups in two levels of
/// the same chain along the longer axis, as graphics hardware does it; kEwa: a Gaussian's weights over a grid
/// of some 20 lookups for each width that the ellipse is long (Heckbert 1989). Longer ellipses than
/// `anisotropy` widths are widened. Where a pixel covers no more than an entry both have the bits of kLinear.
/// |error| as kLinear's and u more; each axis of N entries of a level adds 2 N u, 10 N u beyond the table, of
/// the largest difference of entries read: float places. Sources: Heidrich et al. 1999, 2 and 7; Williams
/// 1983; McReynolds et al. 1997, 5.3; doc/maths/lookup.md. Cost: one pass over the coordinates; the chain is
/// built when the node is made (or evaluated, for a node). Errors: a coordinate channel that is missing
/// (those present are listed), a chain of four dimensions, an anisotropy outside of 1 to 64.
Node Lookup(const Node& coords, const Table& table, const LookupParams& params = {});
/// The table is an image that is computed whole first; layout as in TableFromImage. The result has its
/// channel names.
Node Lookup(const Node& coords, const Node& table, const TableLayout& layout = {},
            const LookupParams& params = {});

/// Pixels of a coordinate image that have no place in a table of `dims` dimensions, whatever its sizes: those
/// whose lookup gives the border colour (or NaN) for want of a number.
struct LostCoordinates {
  int64_t pixels = 0;           ///< looked up: all but the background
  int64_t not_a_number = 0;     ///< some coordinate is NaN, or infinite along a period (kRepeat, kMirror)
  int64_t behind = 0;           ///< projective: q is not positive, NaN or below 2^-126
  int first_x = 0;              ///< column of the first of them, row by row
  int first_y = 0;              ///< its row
  std::string Summary() const;  ///< in a sentence
};
/// Counts them in one evaluation of `coords`, which is streamed; the same numbers for any threads. The
/// filter, the border and what a NaN becomes do not matter. For ApplyTables1D count one channel: dims 1, axes
/// {c}; for ApplyTable3D dims 3. Throws Error: a coordinate channel or mask that is missing.
LostCoordinates CountLostCoordinates(const Node& coords, int dims, const LookupParams& params = {},
                                     const RenderOptions& options = {});

/// R, G, B (clamped to [0,1], NaN to 0) are the coordinates of a 3-D table of three or four channels; its
/// first three results replace them, alpha and other channels keep their bits. Error unless the image has
/// three channels. kNearest, kLinear, kTetrahedral, kCubic. |error| as Lookup; uint8 and uint16 results are
/// correctly rounded but within 2^-12 of a code of a tie. Source: McReynolds et al. 1997, 12.2.3;
/// doc/maths/lookup.md.
struct Table3DParams {
  TableFilter filter = TableFilter::kTetrahedral;  ///< how entries are combined
  CubicKernel cubic = CubicKernel::kCatmullRom;    ///< of kCubic
};
/// Colours through a 3-D table, as Table3DParams says.
Node ApplyTable3D(const Node& image, const Table& table, const Table3DParams& params = {});

/// Each channel through a 1-D table of its own: tables[c] (one dimension, one result channel) for channel c
/// of the image; an empty Table, and channels beyond the list, keep their bits. Samples are clamped to [0,1]
/// for the index, NaN reads entry 0. |error| <= 2 u times the larger entry read (cubic 8 u); entries are
/// returned as they are. uint8 images are mapped code by code, correctly rounded. kNearest, kLinear, kCubic.
struct Tables1DParams {
  std::vector<Table> tables;                     ///< one per channel
  TableFilter filter = TableFilter::kLinear;     ///< how entries are combined
  CubicKernel cubic = CubicKernel::kCatmullRom;  ///< of kCubic
};
/// Channels through tables of their own, as Tables1DParams says.
Node ApplyTables1D(const Node& image, const Tables1DParams& params);

/// False colours: the luminance of R, G, B (kRec709), or the first channel of an image with fewer than three,
/// limited to [0, 1], becomes a colour between the nearest two of `knots`: R, G, B each, at equal distances
/// from 0 to 1. The result has the channels R, G, B; NaN gets the first knot. |error| <= 2 u times the larger
/// knot, and what the luminance's 4 u make of the slope. Error for fewer than two knots, or numbers that are
/// not finite.
Node ColorMap(const Node& image, const std::vector<double>& knots);
/// The same by a map's name: inferno, viridis, magma, turbo, plasma, blue-red, spectrum, heat; in linear
/// light.
Node ColorMap(const Node& image, std::string_view name);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_LOOKUP_H_
