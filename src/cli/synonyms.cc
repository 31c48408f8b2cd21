// The table of words that others use: a line for each set of words, with the commands that they mean.
#include "cli/synonyms.h"

#include <algorithm>
#include <sstream>

namespace tessera::cli {
namespace {

std::vector<std::string> Split(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

}  // namespace

const std::vector<std::pair<std::string, std::string>>& Synonyms() {
  static const std::vector<std::pair<std::string, std::string>> kTable = {
      // Colour and tone.
      {"grade grading colorgrade",
       "grade cdl curves levels exposure whitebalance saturate hue contrast ociolook ccmatrix"},
      {"gain multiply", "mulc mul grade"},
      {"lift offset pedestal", "grade addc"},
      {"gamma power exponent", "powc grade levels curve"},
      {"exposure stops ev brighten darken", "exposure mulc brightness"},
      {"white wb temperature kelvin tint cct warmer cooler adaptation", "whitebalance"},
      {"slope sop asc decision ccc", "cdl"},
      {"autolevel normalize normalise stretch autocontrast contrast-stretch equalise",
       "autolevels levels contrast"},
      {"midtone input output blackpoint whitepoint", "levels grade"},
      {"tonecurve spline points", "curves"},
      {"keyer keylight chroma chromakey greenscreen bluescreen screen", "key despill"},
      {"desaturate grey gray grayscale greyscale monochrome bw modulate", "saturate luminance vibrance"},
      {"hueshift hsv hsl", "hue saturate"},
      {"negative negate complement", "invert"},
      {"tonemap tonemapping filmic aces odt rrt display view", "ociodisplay"},
      {"linearize linearise linear srgb rec709 log logc slog pq hlg eotf oetf",
       "curve tocolorspace colorconvert"},
      {"look cube 3dl clf csp vectorfield lut3d", "lut ociolook ociofiletransform"},
      {"icc profile", "iccread iccwrite"},
      {"matrix recomb colormatrix 3x3 4x4", "ccmatrix"},
      {"posterize posterise bitdepth", "quantize dither"},
      {"falsecolor falsecolour falsecolours heatmap viridis inferno turbo jet", "colormap"},
      {"video movie mp4 mov mkv y4m yuv ffmpeg pipe rawvideo ycbcr", "stream"},
      {"histogram", "equalize printstats"},
      {"clip saturated limit", "clamp"},
      {"nan inf infinite", "fixnan"},
      {"associated unassociated straight premultiply unpremultiply premultiplied",
       "premult unpremult repremult"},
      // Windows and geometry.
      {"scale downscale upscale shrink enlarge reformat lanczos bicubic bilinear supersample",
       "resize fit zoom resample"},
      {"thumbnail thumb preview proxy", "thumbnail i fit resize"},
      {"mipmap pyramid miplevel", "mip"},
      {"mirror", "flip flop transpose"},
      {"turn rot90", "rotate rotate90 rotate180 rotate270 reorient"},
      {"exif upright", "reorient autoorient orientation"},
      {"affine homography perspective cornerpin transform2d projective", "warp"},
      {"stmap uvmap remap idistort displace displacement mapim", "st_warp distort"},
      {"barrel pincushion distortion undistort lensdistortion fisheye brown", "lens"},
      {"chromatic lateral ca fringe", "aberration"},
      {"falloff cos4 flatfield corners shading", "vignette"},
      {"trimborder autocrop bbox bounding", "trim autotrim"},
      {"region extract roi window extract_area", "crop cut"},
      {"embed pad border canvas extent letterbox", "fit croptofull fullsize crop"},
      {"roll wrap tile offset", "cshift tileable"},
      {"seamless seam repeat texture", "tileable"},
      {"contact sheet montage arrayjoin grid proof", "contactsheet mosaic"},
      {"insert composite2d", "paste"},
      // Neighbourhoods.
      {"gaussian gauss box boxblur smooth soften defocus bokeh", "blur"},
      {"convolution conv convolute correlation kernel", "convolve kernel"},
      {"sharpen sharpening unsharpmask usm", "unsharp highpass"},
      {"gradient edge edges derivative prewitt canny", "sobel edges laplacian"},
      {"relief", "emboss bump heighttoao curvature"},
      {"ao ambient occlusion cavity horizon", "heighttoao curvature"},
      {"convexity concavity edgewear cavitymap", "curvature heighttoao"},
      {"denoise despeckle rank", "median nlmeans bilateral"},
      {"noise reduction grain nlm nonlocal buades fastnlmeans", "nlmeans bilateral"},
      {"edge preserving surface blur", "bilateral median"},
      {"banding bands debanding gradfun steps", "deband quantize"},
      {"morphology grow maximum", "dilate"},
      {"shrinkmask minimum", "erode"},
      {"inpaint pushpull", "fillholes"},
      {"depthoffield zdefocus lens", "dof"},
      {"shutter timeblur framehold", "motionblur average accum"},
      {"fourier frequency spectrum fwfft", "fft ifft"},
      // Noise and patterns.
      {"worley voronoi cellular steven crackle facets", "cell"},
      {"gradientnoise fbm fractal octaves brownian", "perlin simplex fractalnoise"},
      {"random film filmgrain", "grain noise white"},
      {"procedural texture", "pattern solid marble wood clouds"},
      {"gabor lewis", "sparse"},
      {"uv st coordinates", "ramp"},
      {"flowfield streamlines vector", "lic"},
      {"bayer blue threshold stipple", "thresholds dissolve quantize"},
      {"constant solidcolor black background color", "create constant fill"},
      {"text label annotate caption", "text"},
      // Compositing.
      {"merge composite comp layer porter duff", "over blend zcomposite"},
      {"multiply screen overlay softlight hardlight dodge burn difference exclusion", "blend"},
      {"matte mask alpha key", "alphatest stencil ch reveal over"},
      {"crossfade mix lerp transition", "interp dissolve"},
      {"deepmerge depthmerge zmerge", "zcomposite zover depthtest"},
      {"toon cartoon silhouette contour ink", "edges outline halo"},
      // Channels.
      {"shuffle swizzle channel bandjoin split copy reorder rgba bgr", "ch chappend chnames"},
      {"rename", "chnames"},
      // Renders.
      {"mist haze atmosphere", "fog layerfog depth"},
      {"position world worldposition p", "position aov"},
      {"relight lighting light lambert", "diffuselight spotlight phong"},
      {"shadowmap penumbra soft", "shadow softshadow"},
      {"ibl reflection hdri panorama equirectangular latlong skybox spherical", "envmap envconvert"},
      {"glTexEnv texture environment decal combine", "texenv"},
      {"stereo parallax viewpoint novelview depthwarp dibr stereoscopic", "reproject"},
      {"fisheye projection lightprobe dome octahedral cylindrical stereographic littleplanet nona v360",
       "envconvert"},
      {"heightmap height normal", "normalmap bump"},
      {"raymarch volumetric voxel vdb ct mri sdf isosurface mesh hypertexture", "volume"},
      {"layers passes cryptomatte renderpass beauty", "aov"},
      // Files and reports.
      {"convert format save export write", "o d"},
      {"load import open", "i"},
      {"bits depth float half uint8 8bit 16bit datatype", "d"},
      {"resolution size dimensions identify exiftool vipsheader iinfo", "info printinfo"},
      {"compare idiff psnr mse difference", "diff pdiff absdiff"},
      {"min max mean stddev statistics", "printstats"},
      {"checksum md5 sha1", "hash"},
      {"exr zip piz dwaa deflate lzw", "compression"},
      {"exif iptc xmp tag metadata", "attrib info"},
      {"multipart multilayer page pages subimages", "subimage a sisplit siappend"},
      {"sequence animation frame farm range", "frames part resume"},
      {"slurm cluster array scheduler distribute gridengine pbs lsf kubernetes share", "part"},
      {"restart continue checkpoint manifest incremental requeue", "resume"},
      {"pieces tiles crop bucket roi stitch", "region join"},
      {"server service daemon worker", "batch safe limit"},
      {"gpu simd avx avx512 neon", "simd"},
      {"cpu cores parallel", "threads parallel-frames"},
      {"profile timing benchmark speed slow", "runstats"},
      {"accuracy error precision check", "verify"},
      {"plan debug", "explain"},
      {"loop repeat", "for while"},
      {"variable expression", "set"},
  };
  return kTable;
}

std::vector<std::string> SynonymsOf(const std::string& name) {
  std::vector<std::string> words;
  for (const auto& [called, names] : Synonyms()) {
    const std::vector<std::string> meant = Split(names);
    if (std::find(meant.begin(), meant.end(), name) == meant.end()) continue;
    const std::vector<std::string> more = Split(called);
    words.insert(words.end(), more.begin(), more.end());
  }
  return words;
}

}  // namespace tessera::cli
