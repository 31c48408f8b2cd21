// --region and --join: pieces have the whole picture's pixels; --contactsheet; -o:all=N.
#include "cli/pieces.h"

#include <random>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class PiecesTest : public CliTest {
 protected:
  // The same windows and samples, bit for bit, in the files' own type.
  void ExpectSame(const std::string& a, const std::string& b) {
    const OIIO::ImageBuf x = Load(a), y = Load(b);
    EXPECT_EQ(x.roi(), y.roi()) << a << " " << b;
    EXPECT_EQ(x.roi_full(), y.roi_full());
    EXPECT_EQ(x.spec().channelnames, y.spec().channelnames);
    EXPECT_EQ(x.file_format_name() == y.file_format_name() && x.nativespec().format != y.nativespec().format,
              false);
    if (x.roi() != y.roi()) return;
    const size_t count = x.spec().image_pixels() * static_cast<size_t>(x.nchannels());
    std::vector<float> p(count), q(count);
    x.get_pixels(x.roi(), OIIO::TypeFloat, p.data());
    y.get_pixels(y.roi(), OIIO::TypeFloat, q.data());
    EXPECT_EQ(std::memcmp(p.data(), q.data(), count * sizeof(float)), 0) << a << " " << b;
  }
};

TEST_F(PiecesTest, PutTogetherAreTheWholePicture) {
  MakePicture("in.exr", 331, 257, 4, OIIO::TypeHalf);
  Works("in.exr --ch R,G --addc -0.5 -o field.exr");
  Works("in.exr --origin -20+11 --fullsize 300x300-10-5 -o moved.exr");
  const std::vector<std::string> regions = {"-50,-50,170,120", "120,-50,500,120", "-50,70,333,111",
                                            "283,70,300,111",  "-50,181,100,200", "50,181,500,200"};
  for (const std::string line :
       {"in.exr --saturate 1.3 --blur:sigma=7", "in.exr --median 5x5 --sobel",
        "in.exr --resize 511x300 --hue 20", "in.exr --warp 0.9,0.2,0,-0.1,1.1,0,5,3,1",
        "field.exr --lic:length=12", "in.exr --contrast 1.4 --unsharp", "moved.exr --blur 9x9",
        "in.exr --autolevels", "in.exr --blur:sigma=3:method=recursive"}) {
    SCOPED_TRACE(line);
    for (const std::string type : {"half", "float"}) {
      Works(line + " -d " + type + " -o whole.exr");
      std::string pieces;
      for (size_t k = 0; k < regions.size(); ++k) {
        const std::string piece = " piece" + std::to_string(k) + ".exr";
        Works("--region " + regions[k] + " " + line + " -d " + type + " --tile 32 32 -o" + piece);
        pieces += piece;
      }
      Works(pieces + " --join -o joined.exr");
      ExpectSame("whole.exr", "joined.exr");
    }
  }
}

TEST_F(PiecesTest, OrderAndOverlapDoNotMatter) {
  MakePicture("in.exr", 97, 64, 3, OIIO::TypeHalf);
  Works("in.exr --hue 30 -o whole.exr");
  Works("--region 40,0,57,64 in.exr --hue 30 -o right.exr");
  Works("--region 0,0,50,64 in.exr --hue 30 -o left.exr");
  Works("right.exr left.exr --join -o joined.exr");
  ExpectSame("whole.exr", "joined.exr");
}

TEST_F(PiecesTest, WhatDoesNotMakeAPictureIsRefused) {
  MakePicture("in.exr", 40, 30, 3, OIIO::TypeHalf);
  Works("--region 0,0,20,30 in.exr -o left.exr");
  Works("--region 25,0,15,30 in.exr -o right.exr");
  Works("--region 20,0,20,30 in.exr -d float -o float.exr");
  Works("--region 20,0,20,30 in.exr --ch R,G -o two.exr");
  for (const auto& [line, code, reason] : std::vector<std::tuple<std::string, int, std::string>>{
           {"left.exr right.exr --join -o x.exr", 1, "found no piece that holds 5x30+20+0"},
           {"left.exr float.exr --join -o x.exr", 1, "found the type float, expected half"},
           {"left.exr two.exr --join -o x.exr", 1, "other channels"},
           {"--region 0,0,20,30 in.exr -o x.png", 1, "such as exr"},
           {"--region 40,0,20,30 in.exr -o x.exr", 1, "found no pixel in --region 20x30+40+0"},
           {"--region 0,0,0,30 in.exr -o x.exr", 2, "expected X,Y,W,H"},
           {"--region 0,0,20 in.exr -o x.exr", 2, "expected X,Y,W,H"},
           {"--region 0,0,20,30,1 in.exr -o x.exr", 2, "expected X,Y,W,H"},
           {"--region 0,0,20.5,30 in.exr -o x.exr", 2, "expected X,Y,W,H"},
           {"--region 2147483000,0,2147483000,30 in.exr -o x.exr", 2, "expected X,Y,W,H"}}) {
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, code) << line;
    EXPECT_NE(result.err.find(reason), std::string::npos) << line << "\n" << result.err;
    EXPECT_FALSE(directory_.Names().contains("x.exr"));
  }
  Works("left.exr right.exr --join:gaps=1 -o gap.exr");
  EXPECT_EQ(Sample("gap.exr", 22, 10, 1), 0.0F);
  EXPECT_EQ(Sample("gap.exr", 30, 10, 1), Sample("in.exr", 30, 10, 1));
}

TEST(CoversTest, FindsEveryGap) {
  std::mt19937 random(7);
  const auto number = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most)); };
  int full = 0;
  for (int k = 0; k < 3000; ++k) {
    const Roi all{-3, 2, 5, 9};
    std::vector<Roi> windows;
    for (int n = number(9); n > 0; --n) {
      const int x = number(8) - 3, y = number(7) + 2;
      windows.push_back({x, y, std::min(5, x + 1 + number(8)), std::min(9, y + 1 + number(7))});
    }
    bool covered = true;
    for (int y = all.y0; y < all.y1; ++y) {
      for (int x = all.x0; x < all.x1; ++x) {
        covered = covered && std::any_of(windows.begin(), windows.end(), [&](const Roi& w) {
                    return w.Contains({x, y, x + 1, y + 1});
                  });
      }
    }
    Roi gap;
    EXPECT_EQ(cli::Covers(windows, all, gap), covered);
    full += covered;
    if (covered) continue;
    EXPECT_FALSE(gap.empty());
    for (const Roi& w : windows) EXPECT_TRUE(Intersection(w, gap).empty());
  }
  EXPECT_GT(full, 5);
}

TEST_F(PiecesTest, AllImagesOfTheStackAreWritten) {
  Works("--pattern constant:color=0.25 4x4 1 -o a.exr");
  Works("--pattern constant:color=0.5 8x4 1 -o b.exr");
  for (const std::string program : {"tessera", "oiiotool"}) {
    const std::string line = "a.exr b.exr -o:all=9 " + program + ".%03d.exr";
    if (program == "tessera") {
      Works(line);
    } else {
      EXPECT_EQ(Oiiotool(line).exit_code, 0);
    }
    EXPECT_EQ(Sample(program + ".009.exr", 1, 1, 0), 0.25F) << "the lowest first";
    EXPECT_EQ(Sample(program + ".010.exr", 7, 1, 0), 0.5F);
  }
  Works("a.exr b.exr -o:all=0 c.#.exr");
  EXPECT_TRUE(directory_.Names().contains("c.0001.exr"));
  const CommandResult result = Tessera("a.exr b.exr -o:all=0 c.exr");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("with # or %04d"), std::string::npos) << result.err;
}

TEST_F(PiecesTest, ContactSheetsHaveFieldsAndLabels) {
  Works("--pattern constant:color=0,0.5,1 64x64 3 -d half -o a.exr");
  Works("--pattern constant:color=0.25 64x32 3 -d half -o b.exr");
  Works("a.exr b.exr b.exr --contactsheet:fit=40x30:pad=4:size=12 2 -o sheet.exr");
  const OIIO::ImageBuf sheet = Load("sheet.exr");
  EXPECT_EQ(sheet.roi(), OIIO::ROI(0, 2 * 40 + 4, 0, 2 * (30 + 18) + 4, 0, 1, 0, 3));
  EXPECT_EQ(sheet.getchannel(20, 15, 0, 2), 1.0F);
  EXPECT_EQ(sheet.getchannel(64, 15, 0, 1), 0.25F);
  EXPECT_EQ(sheet.getchannel(20, 67, 0, 1), 0.25F) << "below the first is the third";
  EXPECT_EQ(sheet.getchannel(64, 67, 0, 1), 0.0F) << "below the second is nothing";
  float lit = 0;
  for (int y = 30; y < 48; ++y) {
    for (int x = 0; x < 40; ++x) lit += sheet.getchannel(x, y, 0, 0);
  }
  EXPECT_GT(lit, 10.0F) << "letters";
  Works("a.exr --caption hello --contactsheet:fit=40x30:label=none 3 -o plain.exr");
  EXPECT_EQ(Load("plain.exr").roi(), OIIO::ROI(0, 40, 0, 30, 0, 1, 0, 3));
  EXPECT_EQ(Tessera("a.exr --contactsheet:fit=40 3 -o x.exr").exit_code, 2);
  EXPECT_EQ(Tessera("a.exr --contactsheet 0 -o x.exr").exit_code, 2);
}

}  // namespace
}  // namespace tessera::testing
