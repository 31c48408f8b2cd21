/// OpenGL's pixel-transfer pipeline as one function: scale and bias, maps, colour tables, convolution, colour
/// matrix. @file
#ifndef TESSERA_OPS_TRANSFER_H_
#define TESSERA_OPS_TRANSFER_H_

#include <optional>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"
#include "tessera/table.h"

TESSERA_API_BEGIN
namespace tessera {

/// Which tables a colour table holds, in this order, and the channels they replace; the others keep their
/// bits.
enum class ColorTableFormat : uint8_t {
  kRgba,            ///< R G B A
  kRgb,             ///< R G B
  kLuminance,       ///< one, for R, G and B
  kLuminanceAlpha,  ///< one for R, G and B, one for A
  kAlpha,           ///< A
  kIntensity,       ///< one, for all four
};
/// A colour table of the pipeline and the channels that it replaces.
struct ColorTable {
  std::vector<Table> tables;                         ///< empty: the stage is left out
  ColorTableFormat format = ColorTableFormat::kRgb;  ///< which channels
  bool interpolate = false;                          ///< linear instead of OpenGL's nearest entry
};

/// Where samples are limited to [0,1]. Tables and maps always limit the sample that they look up, nothing
/// else.
enum class TransferClamp : uint8_t {
  kNone,    ///< nowhere: floats
  kFinal,   ///< after the last stage
  kStages,  ///< after every stage that is there: a fixed-point framebuffer between passes
};

/// The stages in their order (numbers as in doc/maths/transfer.md; those left at their defaults cost
/// nothing):
///  2 scale, bias          6 scale_convolved, bias_convolved     9 scale2, bias2
///  3 maps                 7 table_convolved                    10 table2
///  4 table1               8 matrix                             12 lookup (pixel texture)
///  5 kernel                                                    13 clamp, bits
/// Scales and biases: one value for every channel, alpha included, one per channel, or OpenGL's four for R,
/// G, B and alpha of an image that has others (which keep their bits) or lacks some. Maps: one table for all
/// of R, G, B, A or one each, nearest entry. The matrix acts on columns: (R,G,B,A)' = M (R,G,B,A); 9 numbers
/// leave alpha alone. bits = 1 to 24 rounds to codes / (2^bits - 1) after every stage that is there, as a
/// framebuffer of that depth does. Everything is one graph of the library's own nodes: scales, matrices and
/// limits fold into one matrix. NaN reads entry 0 of a table; CountLostSamples says how often. |error|: each
/// stage's own bound. Errors: other counts of numbers and tables, tables of other than one dimension and
/// channel, numbers that are not finite.
struct TransferParams {
  std::vector<double> scale = {};              ///< stage 2: factors
  std::vector<double> bias = {};               ///< stage 2: added after the factors
  std::vector<Table> maps = {};                ///< stage 3
  ColorTable table1 = {};                      ///< stage 4
  std::optional<Kernel> kernel = {};           ///< stage 5
  ConvolveParams convolve = {};                ///< how stage 5 is computed
  std::vector<double> scale_convolved = {};    ///< stage 6: factors
  std::vector<double> bias_convolved = {};     ///< stage 6: added after the factors
  ColorTable table_convolved = {};             ///< stage 7
  std::vector<double> matrix = {};             ///< stage 8: 9 or 16 numbers, row-major
  std::vector<double> scale2 = {};             ///< stage 9: factors
  std::vector<double> bias2 = {};              ///< stage 9: added after the factors
  ColorTable table2 = {};                      ///< stage 10
  Table lookup = {};                           ///< stage 12
  LookupParams lookup_params = {};             ///< how stage 12 reads its table
  TransferClamp clamp = TransferClamp::kNone;  ///< stage 13: where samples are limited
  int bits = 0;                                ///< 0: floats throughout
};
/// The pipeline that TransferParams describes, as nodes that are there already.
Node Transfer(const Node& image, const TransferParams& params);

/// Pixels that look up a stage's tables with NaN in some channel, and so read entry 0 of it; for the pixel
/// texture those that have no place in it.
struct LostSamples {
  std::string stage;     ///< "map", "table1", "tablec", "table2" or "lookup"
  LostCoordinates lost;  ///< how many, and where first
};
/// Counts them for every stage that looks up, in the pipeline's order: each time one evaluation of what comes
/// before it, streamed; the same numbers for any threads.
std::vector<LostSamples> CountLostSamples(const Node& image, const TransferParams& params,
                                          const RenderOptions& options = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_TRANSFER_H_
