// Shared commands give oiiotool's picture where it is hard: at borders, where alpha is 0, for infinities and
// NaN, for windows that differ.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// What may be where oiiotool's sample is NaN.
enum class Rule {
  kEqual,   // NaN as well
  kNumber,  // a number: zero weights count for nothing here, and in a minimum a number wins
};

class OiiotoolEdgesTest : public CliTest {
 protected:
  // RGBA floats: p and q tame, h and k with samples that are not; alpha 0 in k, every kind of alpha in h.
  void SetUp() override {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> unit(-0.2f, 1.3f);
    const float wild[] = {kInf, -kInf, 0, -0.0f, 1e-40f, 3e38f, -3e38f, 1e-20f, 1, -1, 2};
    const float alphas[] = {0, 1, 0.5f, 0, -0.25f, 0.75f, 2};
    for (const char* const name : {"p.exr", "q.exr", "h.exr", "k.exr", "n.exr"}) {
      OIIO::ImageSpec spec(61, 37, 4, OIIO::TypeFloat);
      OIIO::ImageBuf image(spec);
      size_t i = 0;
      for (int y = 0; y < 37; ++y) {
        for (int x = 0; x < 61; ++x, ++i) {
          float pixel[4] = {unit(random), unit(random), unit(random), 0.2f + 0.01f * static_cast<float>(x)};
          if (name[0] == 'h' || name[0] == 'n') {
            if (i % 3 == 0) pixel[i / 3 % 3] = name[0] == 'n' && i % 2 == 0 ? kNaN : wild[i / 9 % 11];
            pixel[3] = alphas[i / 2 % 7];
          }
          if (name[0] == 'k') pixel[3] = i % 5 < 2 ? 0 : pixel[3];
          image.setpixel(x, y, pixel, 4);
        }
      }
      ASSERT_TRUE(image.write(Path(name))) << image.geterror();
    }
  }

  // Each line's picture by both programs, all lines in one run of each.
  void Agree(const std::vector<std::string>& lines, Rule rule = Rule::kEqual, double limit = 2e-6) {
    std::string ours, theirs;
    for (size_t i = 0; i < lines.size(); ++i) {
      const std::string file = "_" + std::to_string(i) + ".exr ";
      ours += lines[i] + " -o ours" + file, theirs += lines[i] + " -o theirs" + file;
    }
    Works("-d float " + ours);
    const CommandResult result = Oiiotool("-d float " + theirs);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    for (size_t i = 0; i < lines.size(); ++i) {
      SCOPED_TRACE(lines[i]);
      Compare("_" + std::to_string(i) + ".exr", rule, limit);
    }
  }

  void Compare(const std::string& file, Rule rule, double limit) {
    const OIIO::ImageBuf ours = Load("ours" + file), theirs = Load("theirs" + file);
    ASSERT_EQ(ours.roi(), theirs.roi());
    EXPECT_EQ(ours.roi_full(), theirs.roi_full());
    int wrong = 0;
    const OIIO::ROI roi = ours.roi();
    for (int y = roi.ybegin; y < roi.yend; ++y) {
      for (int x = roi.xbegin; x < roi.xend; ++x) {
        for (int c = 0; c < ours.nchannels(); ++c) {
          const float a = ours.getchannel(x, y, 0, c), b = theirs.getchannel(x, y, 0, c);
          const double size = std::max({1.0, std::fabs(double{a}), std::fabs(double{b})});
          const bool same = a == b || std::fabs(double{a} - b) <= limit * size ||
                            (std::isnan(b) && (std::isnan(a) || rule == Rule::kNumber));
          if (!same && ++wrong <= 3)
            ADD_FAILURE() << x << "," << y << " channel " << c << ": " << a << ", oiiotool " << b;
        }
      }
    }
    EXPECT_EQ(wrong, 0);
  }

  // The commands on that image.
  static std::vector<std::string> On(const std::string& image, const std::vector<std::string>& commands) {
    std::vector<std::string> lines;
    for (const std::string& command : commands) lines.push_back(image + " " + command);
    return lines;
  }
};

TEST_F(OiiotoolEdgesTest, Borders) {
  ASSERT_EQ(Oiiotool("--kernel gaussian 5x5 -o kernel.exr").exit_code, 0);
  // oiiotool sums in float.
  Agree(On("p.exr", {"--blur 5x5", "--blur 9x3", "--unsharp", "--laplacian", "--median 3x3", "--erode 3x3",
                     "--dilate 5x3", "--resize 40x20", "--resize 150x50", "--crop 30x15+7+9 --blur 7x7",
                     "--crop 30x20+9+5 --resize 40x20", "kernel.exr --convolve"}),
        Rule::kEqual, 1e-5);
}

// Black around the picture: oiiotool's filters take what is beyond it from the display window's edge, ours
// from the nearest pixel, which is black.
TEST_F(OiiotoolEdgesTest, CropBeyondTheWindow) {
  for (const char* const filter : {"--blur 7x7", "--unsharp:width=7", "--blur:kernel=box 5x3"}) {
    SCOPED_TRACE(filter);
    const std::string line = std::string("-d float p.exr --crop 80x60-10-10 ") + filter;
    Works(line + " -o ours.exr");
    ASSERT_EQ(Oiiotool(line + " -o theirs.exr").exit_code, 0);
    const OIIO::ImageBuf ours = Load("ours.exr"), theirs = Load("theirs.exr");
    ASSERT_EQ(ours.roi(), theirs.roi());
    EXPECT_EQ(ours.getchannel(-10, -10, 0, 0), 0);
    EXPECT_NE(theirs.getchannel(-10, -10, 0, 0), 0);
    for (int y = -7; y < 47; ++y) {
      for (int x = -7; x < 67; ++x) {
        for (int c = 0; c < 4; ++c)
          ASSERT_NEAR(ours.getchannel(x, y, 0, c), theirs.getchannel(x, y, 0, c), 1e-5) << x << "," << y;
      }
    }
  }
}

// A pixel on the box's edge counts for both its neighbours, so that a mirrored picture gives the mirrored
// result; where none lies there, the result is oiiotool's.
TEST_F(OiiotoolEdgesTest, BoxTies) {
  ASSERT_EQ(Oiiotool("p.exr --rotate180 -d float -o turned.exr").exit_code, 0);
  Works("-d float p.exr --resize:filter=box 30x18 -o a.exr turned.exr --resize:filter=box 30x18 -o b.exr");
  const OIIO::ImageBuf a = Load("a.exr"), b = Load("b.exr"), p = Load("p.exr");
  for (int y = 0; y < 18; ++y) {
    for (int x = 0; x < 30; ++x)
      ASSERT_NEAR(a.getchannel(x, y, 0, 1), b.getchannel(29 - x, 17 - y, 0, 1), 1e-6) << x << "," << y;
  }
  // Column 30 of 61 and row 18 of 37 lie on the edge between the two results in the middle.
  for (const int place : {0, 1}) {
    double sum = 0;
    for (int y = 16; y < 19; ++y) {
      for (int x = 28; x < 31; ++x) sum += p.getchannel(x + 2 * place, y + 2 * place, 0, 1);
    }
    EXPECT_NEAR(a.getchannel(14 + place, 8 + place, 0, 1), sum / 9, 1e-6);
  }
  Agree(On("p.exr", {"--resize:filter=box 41x23", "--resize:filter=box 122x74"}), Rule::kEqual, 1e-5);
}

TEST_F(OiiotoolEdgesTest, NoAlpha) {
  Agree(
      On("k.exr", {"--premult", "--repremult", "--unpremult --ch R,G,B", "--unpremult --mulc 0.8 --repremult",
                   "--unpremult --mulc 0.8,0.9,0.7,1 --premult", "q.exr --over", "k.exr --over",
                   "--ccmatrix:unpremult=1 0.6,0.3,0.1,0.2,0.7,0.1,0.05,0.15,0.8"}));
  Agree({"q.exr k.exr --over"});
}

TEST_F(OiiotoolEdgesTest, InfinitiesAndNaN) {
  for (const char* const image : {"h.exr", "n.exr"}) {
    Agree(On(image, {"--addc 0.1,0.2,0.3,0", "--mulc 0.5,2,0,1", "--clamp:min=0.25:max=0.75", "--invert",
                     "--abs", "--powc 2", "--powc 0.5", "--premult", "--unpremult --ch R,G,B",
                     "--saturate 0.4", "--ch B,R,A,G", "k.exr --add", "k.exr --sub", "k.exr --mul",
                     "k.exr --absdiff", "k.exr k.exr --mad"}));
    Agree(On(image, {"k.exr --min", "k.exr --max", "--minc 0.4", "--maxc 0.4", "k.exr --over",
                     "--ccmatrix 0.6,0.3,0.1,0.2,0.7,0.1,0.05,0.15,0.8", "--ccmatrix 2,0,0,0,3,0,0,0,4"}),
          Rule::kNumber);
  }
  Agree({"k.exr h.exr --over"}, Rule::kNumber);
}

TEST_F(OiiotoolEdgesTest, PixelVerbs) {
  for (const char* const image : {"h.exr", "n.exr"}) {
    Agree(On(image, {"k.exr --div", "--divc 0.5,2,0,1", "--contrast:black=0.1:white=0.75",
                     "--contrast:black=0.5:white=0.5", "--fixnan black", "--fill:left=0:right=1 30x20+3+5",
                     "--noise:type=salt:value=1", "--noise:seed=2"}));
    // A maximum or minimum prefers numbers; range compression's luminance of NaN is not above 0.
    Agree(On(image, {"--maxchan", "--minchan", "--chsum", "--colormap heat"}), Rule::kNumber);
  }
  // Lost samples that have no lost neighbours. (oiiotool takes --fixnan none for box3, with a warning.)
  Agree({"p.exr --fill:color=1e38 1x1+7+9 --fill:color=1e38 1x1+0+0 --powc 2 --fixnan box3"});
  Agree(On("h.exr", {"--clamp:min=-2:max=9 --rangecompress", "--clamp:min=-2:max=9 --rangecompress:luma=1"}),
        Rule::kNumber);
  // Half the picture has no alpha.
  Agree(On("k.exr", {"--premult --fillholes", "--premult --cut 30x15+7+9 --fillholes"}), Rule::kEqual, 1e-5);
}

TEST_F(OiiotoolEdgesTest, WindowsThatDiffer) {
  std::vector<std::string> lines;
  for (const std::string window : {" --crop 30x20+3+5 ", " --crop 30x20-10-5 ", " --crop 200x30-20+5 "}) {
    for (const char* const command : {"--add", "--sub", "--mul", "--absdiff", "--min", "--max", "--over"}) {
      lines.push_back("p.exr q.exr" + window + command);
      lines.push_back("p.exr" + window + "q.exr " + command);
    }
    lines.push_back("p.exr" + window + "q.exr k.exr --mad");
    lines.push_back("p.exr q.exr" + window + "k.exr --mad");
    lines.push_back("p.exr q.exr k.exr" + window + "--mad");
    lines.push_back("p.exr q.exr" + window + "--chappend");
    lines.push_back("p.exr" + window + "q.exr --chappend");
  }
  // Files of another size: display windows that differ.
  Works("p.exr --cut 30x20+3+5 -d float -o s.exr");
  for (const char* const command : {"--add", "--absdiff", "--min", "--over", "--chappend"}) {
    lines.push_back(std::string("p.exr s.exr ") + command);
    lines.push_back(std::string("s.exr p.exr ") + command);
  }
  lines.push_back("s.exr p.exr q.exr --mad");
  lines.push_back("p.exr q.exr s.exr --mad");
  Agree(lines);
}

}  // namespace
}  // namespace tessera::testing
