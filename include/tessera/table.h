/// Tables of samples in one to four dimensions (pixel textures, colour tables), their builders and mip
/// chains. @file
#ifndef TESSERA_TABLE_H_
#define TESSERA_TABLE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/wrap.h"

TESSERA_API_BEGIN
namespace tessera {

/// Where an entry lies on its axis of N entries, in coordinates [0,1]. Mixing the two is a half-texel shift.
enum class TableAlign : uint8_t {
  kCentres,  ///< entry i at (i + 1/2) / N: textures, images
  kEnds,     ///< entry i at i / (N - 1): colour tables, functions tabulated on [0,1]
};

/// How entries are combined. Methods of one table differ in speed and in the error against the function
/// sampled.
enum class TableFilter : uint8_t {
  kNearest,      ///< kCentres: floor(s N); kEnds: floor(s (N-1) + 1/2)
  kLinear,       ///< 2^D entries, axis after axis
  kTetrahedral,  ///< D + 1 entries of the simplex around the coordinate: 3-D tetrahedra, 4-D pentatopes;
                 ///< neutral axis exact. For one dimension the same as kLinear
  kCubic,        ///< 4^D entries
  kMipmap,       ///< linear within, and between two of, the levels of a mip chain; see Lookup
  kTrilinear,    ///< the mean of up to `anisotropy` such along what a pixel covers; see Lookup
  kEwa,          ///< a Gaussian under the ellipse that a pixel covers; see Lookup
};
/// Mitchell and Netravali's family of cubics.
enum class CubicKernel : uint8_t {
  kCatmullRom,  ///< B = 0, C = 1/2: passes through the entries
  kMitchell,    ///< B = C = 1/3: a little softer
  kBSpline,     ///< B = 1, C = 0: smooth and non-negative
};

/// Samples in one to four dimensions with one to four result channels: an immutable value, cheap to copy
/// (samples are shared). Axis 0 (s) varies fastest, then 1 (t), 2 (r), 3 (q); the channels of an entry are
/// adjacent. Entries may hold any value; NaN and infinity reach only results in which they have weight.
class Table {
 public:
  /// An empty table: dims() == 0.
  Table() = default;
  /// `samples` holds product(sizes) * channels values; they are rounded to `storage` (integers: saturated,
  /// NaN to 0). Throws Error: 1 to 4 axes of at least one entry, 1 to 4 channels, fewer than 2^31 entries,
  /// matching count.
  Table(std::vector<int> sizes, int channels, std::span<const float> samples, TableAlign align,
        PixelType storage = PixelType::kFloat);

  /// Number of axes; 0 for an empty table.
  int dims() const { return static_cast<int>(sizes_.size()); }
  /// Entries along an axis.
  int size(int axis) const { return sizes_[static_cast<size_t>(axis)]; }
  /// Entries along every axis.
  const std::vector<int>& sizes() const { return sizes_; }
  /// Product of the sizes.
  int64_t entries() const;
  /// Channels of an entry.
  int channels() const { return channels_; }
  /// Type of the samples.
  PixelType storage() const { return storage_; }
  /// Where entries lie on their axes.
  TableAlign align() const { return align_; }
  /// Whether there are no entries.
  bool empty() const { return sizes_.empty(); }
  /// Bytes of the samples.
  size_t bytes() const;
  /// The sample of entry `index` (in memory order) as float, exactly what the lookups read.
  float At(int64_t index, int channel) const;
  /// Every sample as float, in memory order.
  std::vector<float> Samples() const;
  /// The same samples rounded to another storage, or read with the other alignment.
  Table WithStorage(PixelType storage) const;
  /// The same samples read with the other alignment.
  Table WithAlign(TableAlign align) const;

 private:
  std::vector<int> sizes_;
  int channels_ = 0;
  PixelType storage_ = PixelType::kFloat;
  TableAlign align_ = TableAlign::kCentres;
  std::shared_ptr<const std::byte> samples_;
};

/// How a table is read. Axis a takes its coordinate from channel axes[a] of the coordinate image.
struct LookupParams {
  TableFilter filter = TableFilter::kLinear;     ///< how entries are combined
  CubicKernel cubic = CubicKernel::kCatmullRom;  ///< of kCubic
  int anisotropy = 16;  ///< of kTrilinear, kEwa: a footprint's longest length, in widths of it; 1 to 64

  /// One per axis; of a shorter list the last serves the rest. Of kBlack, kClamp, kGlClamp, kRepeat and
  /// kMirror; empty means kClamp.
  std::vector<Wrap> wrap = {};
  /// One value per result channel, missing ones 0: the border colour of kBlack and kGlClamp, and the result
  /// where the coordinates are NaN (where infinite, with kRepeat and kMirror) or lie behind the projector.
  std::vector<double> border = {};
  /// Channels of the coordinate image: one per axis, and with `projective` one more for q. Empty means 0, 1,
  /// 2, ...
  std::vector<int> axes = {};
  /// Coordinates are divided by q first; where q <= 0, is NaN or smaller than 2^-126 the result is the border
  /// colour.
  bool projective = false;
  /// Results are NaN, instead of the border colour, where a coordinate is NaN.
  bool propagate_nan = false;
  /// Channel of the coordinate image that says where to look up. Where it is 0 or NaN the pixel is
  /// background: its result is the coordinate image's own bits, channel for channel (0 where it has none).
  /// -1: everywhere.
  int mask = -1;
};

/// One lookup in double precision: `coords` holds dims() coordinates, `result` receives channels() values.
/// The judge of tables and lookups; slow. kMipmap, kTrilinear and kEwa read level 0. `params.axes`,
/// `projective` and `mask` are ignored.
void SampleTable(const Table& table, const LookupParams& params, const double* coords, double* result);

/// --- Builders. All throw Error on sizes that a Table refuses. --- @file

/// The pixels of an image as a table: entry (x, y) is the pixel at that place of the data window. 1-D: the
/// window is one row. 2-D: as it is. 3-D: `slices` = {N} slices stacked along y, the first on top. 4-D: {N,
/// M}, N varying faster. Keeps the image's pixel type as storage. Error unless the height divides, with 1 to
/// 4 channels.
struct TableLayout {
  int dims = 0;                             ///< 0: from the number of slices; without any 2, or 1 for one row
  std::vector<int> slices = {};             ///< {N} or {N, M}; empty: none
  TableAlign align = TableAlign::kCentres;  ///< where entries lie
};
/// A table of an image's pixels, as TableLayout says.
Table TableFromImage(const ConstImageView& image, const TableLayout& layout = {});
/// Images of equal size and channels as the slices of a 3-D table.
Table TableFromSlices(std::span<const Image> slices, TableAlign align = TableAlign::kCentres);

/// A table of f over [0,1]^D, and how far lookups in it are from f: measured in double at `probes` points of
/// a low-discrepancy sequence over the domain (all axes), and at the middles of the cells along each axis'
/// ends.
struct FunctionTable {
  Table table;                       ///< the samples
  double max_error = 0;              ///< largest absolute error over all channels
  double rms_error = 0;              ///< root mean square over all channels
  std::array<double, 4> worst = {};  ///< coordinates of the largest error
};
/// What TableFromFunction samples, and where it looks for the error.
struct FunctionTableParams {
  std::vector<int> sizes;                 ///< entries per axis; as many axes as f has variables
  int channels = 1;                       ///< of a result
  TableAlign align = TableAlign::kEnds;   ///< where entries lie
  PixelType storage = PixelType::kFloat;  ///< of the entries
  LookupParams lookup = {};               ///< the method whose error is reported
  int probes = 20000;                     ///< places at which the error is measured
};
/// f(coordinates, result): coordinates in [0,1], sizes.size() of them; result: `channels` values to fill.
/// Called from this thread only.
using TableFunction = std::function<void(const double* coords, double* result)>;
/// F sampled, and how far lookups are from it, as FunctionTable says. Cost: entries + probes calls of f.
FunctionTable TableFromFunction(const TableFunction& f, const FunctionTableParams& params);

/// The inverse of a 1-D table of one channel whose entries increase (or decrease) strictly, as a kEnds table
/// of `size` entries over [0,1]: entry j is the coordinate at which the linear lookup gives j / (size - 1); 0
/// or 1 beyond the range of the entries. Error naming the first entry that breaks the order.
Table InverseTable(const Table& table, int size);

/// Levels of half the edge (rounded down, at least 1) of a 1-D to 3-D table, level 0 first, down to one
/// entry.
enum class MipFilter : uint8_t {
  kBox,       ///< the mean of the entries that a coarser one covers, in proportion (odd sizes too)
  kLinear,    ///< tent over two cells
  kMitchell,  ///< cubic B = C = 1/3 over four cells
  kLanczos3,  ///< sinc windowed to three cells: sharpest, may leave the range of the entries
};
/// Filtered axis after axis in double from level 0 with the filter widened (a box of centred entries from the
/// level above, which is the same); levels of kEnds tables keep to their ends. Entries beyond an axis follow
/// `wrap` (one per axis, as in LookupParams; kBlack and kGlClamp count as `border`, one per channel). Float
/// storage.
std::vector<Table> MipChain(const Table& table, MipFilter filter = MipFilter::kBox,
                            const std::vector<Wrap>& wrap = {}, const std::vector<double>& border = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_TABLE_H_
