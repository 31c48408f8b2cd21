// The verbs of geometry give oiiotool's picture and windows: rearrangements bit for bit in every pixel type,
// what interpolates within 1e-5 (a rotation 1e-4: oiiotool has its positions in float).
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class OiiotoolGeometryTest : public CliTest {
 protected:
  // Pictures a (three channels) and p (four) in a type, and where `windows` is set in windows off the origin
  // with the display window at it.
  void Make(const std::string& extension, OIIO::TypeDesc type, bool windows) {
    extension_ = extension;
    ++made_;
    for (const std::string name : {"a", "p"}) {
      const std::string file = Name(name);
      MakePicture(windows ? "plain_" + file : file, 61, 43, name == "a" ? 3 : 4, type);
      if (!windows) continue;
      const std::string place =
          name == "a" ? " --origin +7+5 --fullsize 90x70+0+0 -o " : " --origin -6+9 --fullsize 50x60+0+0 -o ";
      const CommandResult moved = Oiiotool("plain_" + file + place + file);
      ASSERT_EQ(moved.exit_code, 0) << moved.err;
    }
  }
  std::string Name(const std::string& name) const { return name + std::to_string(made_) + "." + extension_; }

  void Agree(const std::string& line, double limit = 0) {
    const std::string with_files = Files(line);
    SCOPED_TRACE(with_files);
    const std::string n = std::to_string(++count_) + "." + extension_;
    Works(with_files + " -o ours" + n);
    const CommandResult theirs = Oiiotool(with_files + " -o theirs" + n);
    ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
    const OIIO::ImageBuf a = Load("ours" + n), b = Load("theirs" + n);
    ASSERT_EQ(a.roi(), b.roi());
    EXPECT_EQ(a.roi_full(), b.roi_full());
    EXPECT_EQ(a.orientation(), b.orientation());
    double worst = 0;
    for (OIIO::ImageBuf::ConstIterator<float> i(a), j(b, a.roi()); !i.done(); ++i, ++j) {
      for (int c = 0; c < a.nchannels(); ++c) worst = std::max<double>(worst, std::fabs(i[c] - j[c]));
    }
    EXPECT_LE(worst, limit);
  }

 private:
  // Words a and p become this type's files.
  std::string Files(const std::string& line) const {
    std::string all;
    for (const std::string& word : Words(line)) all += (word == "a" || word == "p" ? Name(word) : word) + " ";
    return all;
  }

  std::string extension_;
  int made_ = 0, count_ = 0;
};

const char* const kExact[] = {"a --flip",
                              "a --flop",
                              "p --rotate90",
                              "p --rotate180",
                              "a --rotate270",
                              "a --transpose",
                              "p --transpose",
                              "p --flip --rotate90 --flop",
                              "a --cshift +20-10",
                              "p --cshift -200+100",
                              "a --attrib Orientation 2 --reorient",
                              "a --attrib Orientation 3 --reorient",
                              "a --attrib Orientation 4 --reorient",
                              "a --attrib Orientation 5 --reorient",
                              "a --attrib Orientation 6 --reorient",
                              "a --attrib Orientation 7 --reorient",
                              "p --attrib Orientation 8 --reorient",
                              "a --resample:interp=0 30x21",
                              "a --resample:interp=0 50%",
                              "p --resample:interp=0 170x93"};

TEST_F(OiiotoolGeometryTest, RearrangementsKeepTheBitsOfEveryType) {
  const std::pair<const char*, OIIO::TypeDesc> kinds[] = {
      {"tif", OIIO::TypeUInt8}, {"tif", OIIO::TypeUInt16}, {"exr", OIIO::TypeHalf}, {"exr", OIIO::TypeFloat}};
  for (const auto& [extension, type] : kinds) {
    Make(extension, type, false);
    for (const char* const line : kExact) Agree(line);
  }
}

TEST_F(OiiotoolGeometryTest, WindowsGoAlong) {
  for (const OIIO::TypeDesc type : {OIIO::TypeHalf, OIIO::TypeFloat}) {
    Make("exr", type, true);
    for (const char* const line : kExact) {
      // Beyond the data window oiiotool's nearest pixel depends on the display window's rounding alone.
      if (std::string(line).find("resample") == std::string::npos) Agree(line);
    }
    for (const char* const line : {"a --origin +3-4",
                                   "a --originoffset -10+20",
                                   "a --fullsize 100x90+5-3",
                                   "a --fullsize 100x90",
                                   "a --fullsize +1+2",
                                   "a --fullpixels",
                                   "p --fullpixels",
                                   "a --croptofull",
                                   "p --croptofull",
                                   "a --crop 20x10+9+8 --flip --croptofull",
                                   "a --mulc 0,0,0 --trim",
                                   "a --trim",
                                   "a --crop 300x200-40-30 --trim",
                                   "p --crop 10x20+9+12 --croptofull --trim",
                                   "a a --paste +5+9",
                                   "a --crop 20x10+9+8 a --paste +5+9",
                                   "a a --paste:mergeroi=1 +0+0",
                                   "a p --paste +11-4",
                                   "p a --paste -20+30",
                                   "a a --paste -",
                                   "a --crop 20x10+9+8 a --paste auto",
                                   "a a a a --mosaic 2x2",
                                   "a p a --mosaic:pad=3 1x3",
                                   "a a --mosaic:pad=7 2x1"}) {
      Agree(line);
    }
  }
}

TEST_F(OiiotoolGeometryTest, WhatInterpolatesAgrees) {
  Make("exr", OIIO::TypeFloat, false);
  for (const char* const line :
       {"a --resample 30x21", "a --resample 150x93", "a --resample 37%", "p --resample 0x100"})
    Agree(line, 1e-5);
  for (const char* const line :
       {"a --rotate 30", "a --rotate:filter=triangle -77.5", "a --rotate:center=10,7 12",
        "p --rotate:center=3.5,20 200", "a --rotate:recompute_roi=1 20", "a --rotate 90",
        "a --rotate:filter=mitchell 180"}) {
    Agree(line, 1e-4);
  }
  for (const char* const line : {"a --fit 30x30", "a --fit:pad=1 30x30", "a --fit:pad=1 40x20",
                                 "a --fit:fillmode=width 40x20", "a --fit:fillmode=height 40x20",
                                 "a --fit:fillmode=width:pad=1 30x40", "a --fit:filter=triangle:pad=1 25x43",
                                 "a --fit 61x43", "a --fit:pad=1 61x90", "a --fit:filter=mitchell 20x20"}) {
    Agree(line, 1e-5);
  }
  for (const char* const line : {"a --fit:exact=1:pad=1 30x30", "a --fit:exact=1:filter=triangle 40x20",
                                 "a --fit:exact=1:fillmode=height 40x20"}) {
    Agree(line, 1e-4);
  }
  Agree("a a a a --mosaic:fit=20x20:pad=2 2x2", 1e-5);
}

TEST_F(OiiotoolGeometryTest, FilesAreReadAsTheyWereHeld) {
  MakePicture("plain.tif", 31, 17, 3, OIIO::TypeUInt8);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string file = "held" + std::to_string(orientation) + ".tif";
    ASSERT_EQ(
        Oiiotool("plain.tif --attrib Orientation " + std::to_string(orientation) + " -o " + file).exit_code,
        0);
    const std::string up = "up_" + file;
    Works("--autoorient " + file + " -o " + up);
    ASSERT_EQ(Oiiotool("--autoorient " + file + " -o theirs_" + file).exit_code, 0);
    const CommandResult diff = Oiiotool("--fail 0 --warn 0 " + up + " theirs_" + file + " --diff");
    EXPECT_EQ(diff.exit_code, 0) << orientation << diff.out << diff.err;
    EXPECT_EQ(Load(up).orientation(), 1);
  }
}

TEST_F(OiiotoolGeometryTest, WordsThatAreNone) {
  MakePicture("a.tif", 9, 7, 3, OIIO::TypeUInt8);
  for (const char* const line :
       {"a.tif --cshift 20 -o x.tif", "a.tif --origin 3,4 -o x.tif", "a.tif --fullsize 5 -o x.tif",
        "a.tif a.tif --paste 3 -o x.tif", "a.tif --mosaic 2 -o x.tif", "a.tif --fit 0x5 -o x.tif",
        "a.tif --resample x -o x.tif", "a.tif --mosaic 2x2 -o x.tif"}) {
    const CommandResult result = Tessera(std::string(line));
    EXPECT_EQ(result.exit_code, 2) << line << "\n" << result.err;
    EXPECT_NE(result.err.find("tessera: error:"), std::string::npos) << line << "\n" << result.err;
  }
}

}  // namespace
}  // namespace tessera::testing
