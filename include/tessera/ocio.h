/// OpenColorIO: configs, displays, looks and every LUT file it reads, as nodes of the same pipeline. @file
#ifndef TESSERA_OCIO_H_
#define TESSERA_OCIO_H_

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"
#include "tessera/table.h"

TESSERA_API_BEGIN
namespace tessera {

/// Every function here has OpenColorIO optimise a processor without loss and turns it into the library's own
/// nodes: matrices, ranges, CDLs, exponents and logarithms by formula (1 ULP, where OpenColorIO's fast forms
/// have 2^-14), 1-D and 3-D LUTs. What has no such node (inverse, half-domain and hue-preserving LUTs, fixed
/// functions, grading) runs in OpenColorIO's own CPU processor, as one more node of the fused pipeline;
/// --verify refuses those. The result is within 1e-5 of OpenColorIO's for results around 1 (relative for
/// larger ones). R, G, B are the first three channels; alpha takes part where a transform has it; other
/// channels keep their bits. The result carries the space that it is in (color_state.h); behind a LUT file
/// that is unknown, but for .cc, .ccc and .cdl. Errors name the file, colour space, look, display or view
/// that was not found, and the nearest known one. @file

/// What all of them have in common.
struct OcioParams {
  /// A config file; empty: the one that the variable OCIO names, else `built-in`: ACES and video spaces
  /// (kBuiltInConfig).
  std::string config = {};
  /// Context variables that replace those of the config and the environment.
  std::vector<std::pair<std::string, std::string>> context = {};
  bool unpremult = false;  ///< divide by alpha before, multiply after; where alpha is 0 neither (glows)
};
inline constexpr char kBuiltInConfig[] = "built-in";  ///< Name of the config that the library holds.

/// From one colour space (name, alias or role) to another. `from` empty or "current": the image's own, that
/// of its ColorState; the role scene_linear where that is unknown. Error where the config does not have it.
Node ColorConvert(const Node& image, const std::string& from, const std::string& to,
                  const OcioParams& params = {});

/// Whether the config knows the space by name, alias or role.
bool HasColorSpace(const std::string& name, const OcioParams& params = {});

/// To a display's view. Empty `from`: the image's own space as for ColorConvert. Empty `display` and `view`:
/// the config's defaults. `looks` replace the view's own. `inverse` goes from the display back to `from`,
/// where that is empty to scene_linear.
struct OcioDisplayParams {
  std::string from = {};   ///< colour space of the image
  std::string looks = {};  ///< instead of the view's own
  bool inverse = false;    ///< from the display back
};
/// To a display's view, as OcioDisplayParams says.
Node OcioDisplay(const Node& image, const std::string& display, const std::string& view,
                 const OcioDisplayParams& display_params = {}, const OcioParams& params = {});

/// Looks of the config ("a", "a, -b", "a | b"), from and to colour spaces; empty: the image's own. `inverse`
/// undoes the looks between the same spaces.
struct OcioLookParams {
  std::string from = {};  ///< colour space of the image
  std::string to = {};    ///< colour space of the result
  bool inverse = false;   ///< undoes the looks
};
/// Through looks of the config, as OcioLookParams says.
Node OcioLook(const Node& image, const std::string& looks, const OcioLookParams& look_params = {},
              const OcioParams& params = {});

/// A file of any format that OpenColorIO reads (.cube .spi1d .spi3d .spimtx .3dl .csp .clf .ctf .cc .ccc .cdl
/// .lut .look .itx .mga .m3d .cub .vf .icc ...), searched for along the config's search path. `filter` is the
/// interpolation of its 3-D and 1-D tables; tetrahedral is linear for the latter. Without one, tables have
/// that of their file (CLF and CTF say it), and tetrahedral where it says none.
struct LutParams {
  std::optional<TableFilter> filter = {};  ///< kNearest, kLinear, kTetrahedral, kCubic
  bool inverse = false;                    ///< undoes the file's transform
  std::string cccid = {};  ///< which correction of a .ccc, .cdl: its id or its index; empty: the first
};
/// Through a file found along the config's search path, as LutParams says.
Node OcioFileTransform(const Node& image, const std::string& file, const LutParams& lut_params = {},
                       const OcioParams& params = {});
/// The same without a config: `file` as it stands.
Node ApplyLut(const Node& image, const std::string& file, const LutParams& lut_params = {});

/// A transform of R, G, B as a shaper curve and a table of size^3 entries, read with tetrahedra: for
/// transforms too slow, or not allowed, where the image goes. The domain is the range of the image's finite
/// colours (one pass over it), or [low, high] where low < high; the shaper is the identity for a domain
/// within [0,1], else logarithmic beyond 2^-8 with a linear part below (and for negative values). Values
/// beyond the domain count as its ends. Alpha keeps its bits. The report compares with the transform itself
/// on `tiles` tiles of 64x64 pixels spread over the image; CIEDE2000 reads both results as sRGB, limited to
/// [0,1].
struct BakeParams {
  int size = 33;    ///< 2 to 129
  double low = 0;   ///< lower end of the domain
  double high = 0;  ///< its upper end; not above low: the image's own range
  int tiles = 64;   ///< compared for the report
};
/// How far a baked table is from its transform.
struct BakeReport {
  int64_t pixels = 0;        ///< compared
  double max_error = 0;      ///< largest absolute difference of R, G, B
  double rms_error = 0;      ///< root mean square of the differences
  double max_ciede2000 = 0;  ///< largest colour difference
  double low = 0;            ///< lower end of the domain
  double high = 0;           ///< its upper end
  bool shaped = false;       ///< by a logarithm

  /// In a sentence.
  std::string Summary() const;
};
/// The transform as shaper and table, as BakeParams says. Cost: size^3 transformed entries and one lookup a
/// pixel.
Node Bake(const Node& image, const std::function<Node(const Node&)>& transform, const BakeParams& params = {},
          BakeReport* report = nullptr);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OCIO_H_
