/// OpenGL's pixel-transfer pipeline as one function: scale and bias, maps, colour tables, convolution, colour
/// matrix. @file
#ifndef TESSERA_OPS_TRANSFER_H_
#define TESSERA_OPS_TRANSFER_H_

#include <optional>
#include <string>
#include <vector>

#include "tessera/node.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"
#include "tessera/table.h"

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
struct ColorTable {
  std::vector<Table> tables;  ///< empty: the stage is left out
  ColorTableFormat format = ColorTableFormat::kRgb;
  bool interpolate = false;  ///< linear instead of OpenGL's nearest entry
};

/// Where samples are limited to [0,1]. Tables and maps always limit the sample that they look up, nothing
/// else.
enum class TransferClamp : uint8_t {
  kNone,    ///< nowhere: floats
  kFinal,   ///< after the last stage
  kStages,  ///< after every stage that is there: a fixed-point framebuffer between passes
};

/// The stages in their order (numbers as in spec/pixel-transfer.md; those left at their defaults cost
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
  std::vector<double> scale = {}, bias = {};
  std::vector<Table> maps = {};
  ColorTable table1 = {};
  std::optional<Kernel> kernel = {};
  ConvolveParams convolve = {};
  std::vector<double> scale_convolved = {}, bias_convolved = {};
  ColorTable table_convolved = {};
  std::vector<double> matrix = {};
  std::vector<double> scale2 = {}, bias2 = {};
  ColorTable table2 = {};
  Table lookup = {};
  LookupParams lookup_params = {};
  TransferClamp clamp = TransferClamp::kNone;
  int bits = 0;
};
Node Transfer(const Node& image, const TransferParams& params);

/// Pixels that look up a stage's tables with NaN in some channel, and so read entry 0 of it; for the pixel
/// texture those that have no place in it.
struct LostSamples {
  std::string stage;  ///< "map", "table1", "tablec", "table2" or "lookup"
  LostCoordinates lost;
};
/// Counts them for every stage that looks up, in the pipeline's order: each time one evaluation of what comes
/// before it, streamed; the same numbers for any threads.
std::vector<LostSamples> CountLostSamples(const Node& image, const TransferParams& params,
                                          const RenderOptions& options = {});

}  // namespace tessera

#endif  // TESSERA_OPS_TRANSFER_H_
