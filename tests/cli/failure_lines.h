// The lines that failures are planted in, of every family of commands and most formats, and what they read.
#ifndef TESSERA_TESTS_CLI_FAILURE_LINES_H_
#define TESSERA_TESTS_CLI_FAILURE_LINES_H_

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "cli/cli_test.h"

namespace tessera {

// $: the directory of the outputs. Those with a star are in the short loop.
inline constexpr const char* kLines[] = {
    "* in/a.exr in/a.exr --accum .5,.5 -d half -o $/o.exr",
    "* in/b.png --hue 30 -o $/o.png",
    "* --codec oiio in/b.tif --blur:sigma=3 -o $/o.tif",
    "* in/b.tga --mulc .5 -o $/o.tga",
    "* in/b.ppm --resize 30x20 -o $/o.ppm",
    "* in/b.hdr --addc 1 -o $/o.hdr",
    "* in/b.dpx --addc .1 -o $/o.dpx",
    "* in/b.jpg --invert -o $/o.jpg",
    "* in/b.webp --sobel -o $/o.webp",
    "* --frames 1-2 in/f.#.exr --saturate 1.2 -o $/o.#.exr",
    "* in/a.exr --lut in/l.cube --dup --invert -o $/inverted.png --pop -o $/o.tif",
    "* in/a.exr --verify --powc 2.2 -o $/o.exr",
    "--codec oiio in/a.exr in/a.exr --sub -o $/o.exr",
    "--codec oiio in/b.png --luminance -o $/o.png",
    "--codec oiio in/b.jpg --mulc .5 -o $/o.bmp",
    "in/b.tif --clamp:min=.1:max=.9 -o $/o.tif",
    "in/b.bmp --ccmatrix 0,1,0,1,0,0,0,0,1 -o $/o.bmp",
    "in/b.gif --emboss N -o $/o.gif",
    "* in/b.sgi --median 3 -o $/o.sgi",
    "in/b.rla --unsharp -o $/o.rla",
    "in/b.jp2 --laplacian -o $/o.jp2",
    "in/b.heic --contrast 1.2 -o $/o.png",
    "in/a.exr --table in/t.txt -o $/o.exr",
    "in/a.exr --lut in/l.csp -o $/o.exr",
    "--colorconfig in/config.ocio in/a.exr --colorconvert lin log -o $/o.exr",
    "in/a.exr --ociodisplay:bake=5 sRGB \"\" -o $/o.png",
    "in/rgba.exr in/rgba.exr --over -o $/o.tif",
    "in/rgba.exr in/b.png --blend soft-light -o $/o.png",
    "in/a.exr in/b.png --interp 1.5 -o $/o.webp",
    "--pattern perlin 32x32 3 in/b.png --lookup:dims=2 -o $/o.exr",
    "in/a.exr --ch R,G --addc -.5 --lic:length=5 -o $/o.exr",
    "in/a.exr in/a.exr --fog:density=.5:color=.6,.7,.8 -o $/o.exr",
    "in/a.exr in/b.png --envmap:map=latlong -o $/o.png",
    "--pattern clouds 32x24 3 --mip -o $/o.exr",
    "--volume:solid=body:size=16x16 -o $/o.exr",
    "--volume:file=in/b.ppm:slices=4:mode=mip:size=16x16 -o $/o.png",
    "in/a.exr --warp 1,0.1,0,0,1,0,0,0,1 -o $/o.exr",
    "in/a.exr --convolve:kernel=laplacian:method=fft -o $/o.exr",
    "in/a.exr --printstats --runstats -o $/o.exr",
    "in/a.exr in/a.exr --diff --swap -o $/o.png",
    "* in/a.exr --exposure .5 --whitebalance 3200 --grade:gain=1.3 --cdl:saturation=.5 -d half -o $/o.exr",
    "* in/b.png --lens .08,.005 --aberration 1.5 -1 --vignette .5 --grain .06 -o $/o.png",
    "in/b.png --levels .1 .9 --vibrance .5 --curves 0,0,.5,.6,1,1 --despill:screen=green -o $/o.jpg",
    "in/rgba.exr --key:screen=blue -o $/o.tif",
    "* in/a.exr in/rgba.exr --siappend -d half -o $/o.exr",
    "-a in/parts.exr --mulc .5 -o $/o.tif",
    "in/b.png --text:x=2:y=20:size=12 Harbour --fft --ifft --ch 0 -o $/o.exr",
    "in/b.png in/b.tif in/b.jpg --mosaic 3x1 -o $/o.tif",
    "in/b.png --normalmap in/b.png --paste +9+7 -o $/o.png",
    "--set k 2 --for i 0,{k} in/b.png --addc {i/8} -o $/o{i}.tif --pop --endfor",
    "in/a.exr --aov:channels=0 depth -o $/o.exr",
    "--explain:cost=1 in/b.png --blur 3x3 -o $/o.png",
};

class FailureLinesTest : public testing::CliTest {
 protected:
  static std::vector<std::string> LinesWith(const std::string& text) {
    std::vector<std::string> lines;
    for (const std::string line : kLines) {
      if (line.find(text) != std::string::npos) lines.push_back(line.substr(line.starts_with("* ") ? 2 : 0));
    }
    return lines;
  }
  static std::vector<std::string> LinesInShort() { return LinesWith("* "); }

  // In the folder in.
  void MakeInputs() {
    std::filesystem::create_directory(Path("in"));
    Works("--pattern ramp 48x40 3 -d half -o in/a.exr");
    Works("--pattern ramp 48x40 4 --premult -d half -o in/rgba.exr");
    Works("--pattern perlin 48x40 3 -d uint8 -o in/b.png");
    for (const char* const format :
         {"tif", "jpg", "tga", "hdr", "dpx", "ppm", "webp", "bmp", "gif", "sgi", "rla", "jp2", "heic"})
      Works(std::string("in/b.png -o in/b.") + format);
    Works("in/a.exr in/rgba.exr --siappend -d half -o in/parts.exr");
    Works("--frames 1-2 in/a.exr --mulc {FRAME_NUMBER/2} -o in/f.#.exr");
    std::ofstream(Path("in/l.cube")) << "\xEF\xBB\xBFLUT_1D_SIZE 2\n0 0 0\n1 .5 1\n";
    std::ofstream(Path("in/l.csp"))
        << "CSPLUTV100\n1D\n\n2\n0 1\n0 1\n2\n0 1\n0 1\n2\n0 1\n0 1\n\n2\n0 0 0\n1 .5 1\n";
    std::ofstream(Path("in/t.txt")) << "0\n.2\n1\n";
    std::ofstream(Path("in/config.ocio"))
        << "ocio_profile_version: 2\nsearch_path: .\nroles: {default: lin, scene_linear: lin}\n"
           "displays:\n  d:\n    - !<View> {name: v, colorspace: lin}\ncolorspaces:\n"
           "  - !<ColorSpace> {name: lin}\n"
           "  - !<ColorSpace> {name: log, from_scene_reference: !<FileTransform> {src: l.csp}}\n";
  }
};

}  // namespace tessera

#endif  // TESSERA_TESTS_CLI_FAILURE_LINES_H_
