// The list that doc/oiiotool.md shows; tests/cli/oiiotool_table_test.cc holds both together.
#include "cli/left_out.h"

#include <algorithm>
#include <iterator>

namespace tessera::cli {
namespace {

struct LeftOut {
  const char* name;
  const char* use;
};

constexpr char kDeep[] = "deep pixels are not read: oiiotool --flatten makes an image of them that is";
constexpr char kTexture[] = "textures are not made: maketx or oiiotool makes them of what -o wrote";

constexpr char kConvert[] =
    "colours are converted where a line says so: --tocolorspace goes by what the file says of itself";

constexpr LeftOut kLeftOut[] = {
    {"autocc", kConvert},
    {"capture", "no camera is read: another program, ffmpeg say, brings its frames by --stream"},
    {"deepen", kDeep},
    {"deepholdout", kDeep},
    {"deepmerge", kDeep},
    {"flatten", kDeep},
    {"iconfig", "readers get no hints: what a format's reader can be told is oiiotool's"},
    {"no-error-exit",
     "a line ends at its first error and leaves nothing behind; --skip-bad-frames goes on with the "
     "next frame, --batch with the next line"},
    {"noautocc", kConvert},
    {"no-autopremult", "images are premultiplied here; --unpremult takes alpha out"},
    {"obump", kTexture},
    {"oenv", kTexture},
    {"oiioattrib", "the environment variable OPENIMAGEIO_OPTIONS sets OpenImageIO's own attributes"},
    {"otex", kTexture},
    {"selectmip", "levels of a MIP map but the first are not read; --mip makes them"},
    {"views", "a line names the file of every view; --frames and {} expressions make lines for many"},
};

}  // namespace

std::string WhyLeftOut(const std::string& name) {
  const auto it = std::find_if(std::begin(kLeftOut), std::end(kLeftOut),
                               [&](const LeftOut& l) { return name == l.name; });
  return it == std::end(kLeftOut) ? "" : it->use;
}

}  // namespace tessera::cli
