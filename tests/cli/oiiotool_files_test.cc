// Verbs of metadata, files of several images, reports, expressions and drawing give what oiiotool gives: the
// same items, the same images, the same words on standard output.
#include <OpenImageIO/strutil.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class OiiotoolFilesTest : public CliTest {
 protected:
  void SetUp() override {
    MakePicture("a.exr", 61, 43, 3, OIIO::TypeHalf, 3);
    MakePicture("p.exr", 61, 43, 4, OIIO::TypeFloat, 4);
    MakePicture("b.tif", 61, 43, 3, OIIO::TypeUInt8, 5);
    const CommandResult made = Oiiotool(
        "a.exr --attrib oiio:subimagename first --attrib Artist Ada --keyword harbour --attrib:type=float Gain 0.5 "
        "p.exr --ch R,G,B --mulc 0.5 --attrib oiio:subimagename second --siappend -d half -o parts.exr");
    ASSERT_EQ(made.exit_code, 0) << made.err;
    ASSERT_EQ(Oiiotool("b.tif b.tif --flip --siappend b.tif --flop --siappend -o pages.tif").exit_code, 0);
  }

  // Both programs do the line; the names are of ours and of theirs.
  void Both(const std::string& line, const std::string& ending) {
    const CommandResult ours = Tessera(Quoted(line + " -o ours" + ending)),
                        theirs = Oiiotool(Quoted(line + " -o theirs" + ending));
    ASSERT_EQ(ours.exit_code, 0) << line << "\n" << ours.err;
    ASSERT_EQ(theirs.exit_code, 0) << line << "\n" << theirs.err;
  }

  // Words, of which those in quotes may hold blanks.
  static std::vector<std::string> Quoted(const std::string& line) {
    std::vector<std::string> words(1);
    bool quoted = false, inside = false;
    for (const char c : line) {
      if (c == '`') {
        quoted = !quoted, inside = true;
      } else if (c == ' ' && !quoted) {
        if (inside) words.emplace_back();
        inside = false;
      } else {
        words.back() += c, inside = true;
      }
    }
    if (!inside) words.pop_back();
    return words;
  }

  // What depends on the program and the time is left out.
  std::map<std::string, std::string> Items(const std::string& file, int part = 0) const {
    std::map<std::string, std::string> items;
    const auto input = OIIO::ImageInput::open(Path(file));
    if (input == nullptr || !input->seek_subimage(part, 0)) return items;
    for (const OIIO::ParamValue& p : input->spec().extra_attribs) {
      const std::string name = p.name().string();
      const bool own = name == "Software" || name == "Exif:ImageHistory" || name == "DateTime" ||
                       name == "openexr:chunkCount" || name == "oiio:ColorSpace" ||
                       name == "colorInteropID" || name == "chromaticities" || name == "openexr:lineOrder";
      const bool upright = name == "Orientation" && p.get_int() == 1;
      if (!own && !upright) items[name] = p.get_string();
    }
    items["tiles"] =
        std::to_string(input->spec().tile_width) + "x" + std::to_string(input->spec().tile_height);
    items["type"] = input->spec().format.c_str();
    return items;
  }

  void SamePixels(const std::string& a, const std::string& b, int part, double limit) const {
    OIIO::ImageCache* const cache = OIIO::ImageCache::create(/*shared=*/true);
    cache->invalidate_all(/*force=*/true);  // the same names hold other files with every line
    OIIO::ImageCache::destroy(cache);
    OIIO::ImageBuf x(Path(a), part, 0), y(Path(b), part, 0);
    ASSERT_TRUE(x.read(part, 0, true, OIIO::TypeFloat)) << x.geterror();
    ASSERT_TRUE(y.read(part, 0, true, OIIO::TypeFloat)) << y.geterror();
    ASSERT_EQ(x.roi(), y.roi());
    EXPECT_EQ(x.roi_full(), y.roi_full());
    double worst = 0;
    for (OIIO::ImageBuf::ConstIterator<float> i(x), j(y); !i.done(); ++i, ++j) {
      for (int c = 0; c < x.nchannels(); ++c) worst = std::max<double>(worst, std::fabs(i[c] - j[c]));
    }
    EXPECT_LE(worst, limit);
  }
  int Parts(const std::string& file) const {
    const auto input = OIIO::ImageInput::open(Path(file));
    int count = 0;
    while (input && input->seek_subimage(count, 0)) ++count;
    return count;
  }
};

TEST_F(OiiotoolFilesTest, MetadataAreTheSame) {
  for (const char* const line :
       {"a.exr --attrib Take 7",
        "a.exr --attrib Gain 0.25",
        "a.exr --attrib Artist Ada",
        "a.exr --attrib:type=string Code 12",
        "a.exr --attrib:type=float Whole 3",
        "a.exr --attrib:type=float[3] Three 1,2.5,-3",
        "a.exr --attrib:type=timecode smpte:TimeCode 01:02:03:04",
        "a.exr --attrib:type=rational framesPerSecond 24000/1001",
        "a.exr --attrib:type=matrix worldToCamera 1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,1",
        "a.exr --attrib:type=int Seven 7",
        "a.exr --attrib Take 7 --attrib Take 8",
        "a.exr --attrib Take 7 --attrib Take ``",
        "a.exr --attrib:type=point Where 1,2,3",
        "a.exr --sattrib Code 12",
        "a.exr --sattrib Code 12 --sattrib Code ``",
        "a.exr --sattrib Code `a b`",
        "parts.exr --subimage 0 --eraseattrib Artist",
        "parts.exr --subimage 0 --eraseattrib art.*",
        "parts.exr --subimage 0 --eraseattrib Art",
        "parts.exr --subimage 0 --eraseattrib Artist|Gain",
        "a.exr --caption `a few words`",
        "a.exr --caption one --caption ``",
        "a.exr --keyword one",
        "a.exr --keyword one --keyword two",
        "a.exr --keyword one --keyword one",
        "parts.exr --subimage 0 --keyword dawn",
        "parts.exr --subimage 0 --clear-keywords",
        "a.exr --orientation 6",
        "a.exr --orientation 1",
        "a.exr --orientcw",
        "a.exr --orientccw",
        "a.exr --orient180",
        "a.exr --orientation 2 --orientcw",
        "a.exr --orientation 5 --orientccw",
        "a.exr --orientation 8 --orient180",
        "a.exr --orientation 6 --reorient",
        "parts.exr --subimage 0 p.exr --pastemeta",
        "parts.exr --subimage 1",
        "--metamerge a.exr --attrib One 1 p.exr --attrib Two 2 --ch R,G,B --add -d half"}) {
    SCOPED_TRACE(line);
    Both(line, ".exr");
    EXPECT_EQ(Items("ours.exr"), Items("theirs.exr"));
  }
}

TEST_F(OiiotoolFilesTest, FilesAreWrittenAlike) {
  for (const char* const line :
       {"a.exr --compression none", "a.exr --compression rle", "a.exr --compression zips",
        "a.exr --compression zip", "a.exr --compression piz", "a.exr --compression pxr24",
        "a.exr --compression b44", "a.exr --compression dwaa:45", "a.exr --compression dwab",
        "a.exr --tile 16 16", "a.exr --tile 32 8", "a.exr --tile 16 16 --scanline",
        "a.exr -d float --compression zips"}) {
    SCOPED_TRACE(line);
    Both(line, ".exr");
    EXPECT_EQ(Items("ours.exr"), Items("theirs.exr"));
    SamePixels("ours.exr", "theirs.exr", 0, 0);
  }
  for (const char* const line :
       {"b.tif --compression none", "b.tif --compression lzw", "b.tif --compression zip",
        "b.tif --compression packbits", "b.tif --tile 16 16", "b.tif --tile 64 32",
        "b.tif --planarconfig separate", "b.tif --planarconfig contig",
        "b.tif --planarconfig separate --tile 16 16", "b.tif --planarconfig default",
        "b.tif --attrib Artist Ada", "b.tif --caption `a b`", "b.tif -d uint16", "b.tif -d float",
        "b.tif --keyword one"}) {
    SCOPED_TRACE(line);
    Both(line, ".tif");
    EXPECT_EQ(Items("ours.tif"), Items("theirs.tif"));
    SamePixels("ours.tif", "theirs.tif", 0, 1e-7);  // a code as a float: theirs is not the nearest
  }
  for (const char* const line :
       {"b.tif --compression jpeg:50", "b.tif --compression jpeg:95", "b.tif --quality 30"}) {
    SCOPED_TRACE(line);
    Both(line, ".jpg");
    SamePixels("ours.jpg", "theirs.jpg", 0, 0);
  }
}

TEST_F(OiiotoolFilesTest, AllImagesOfAFileArrive) {
  for (const auto& [line, ending] : std::vector<std::pair<std::string, std::string>>{
           {"parts.exr", ".exr"},
           {"parts.exr", ".tif"},
           {"pages.tif", ".tif"},
           {"parts.exr --mulc 0.5", ".exr"},
           {"-a parts.exr --mulc 0.5", ".exr"},
           {"-a pages.tif --flip", ".tif"},
           {"-a pages.tif b.tif --absdiff", ".tif"},
           {"-a parts.exr parts.exr --add", ".exr"},
           {"-a parts.exr --attrib Take 7", ".exr"},
           {"-a parts.exr --crop 20x20+5+5", ".exr"},
           {"parts.exr --subimage 1", ".exr"},
           {"parts.exr --subimage second", ".exr"},
           {"pages.tif --subimage 2", ".tif"},
           {"pages.tif --subimage:delete=1 1", ".tif"},
           {"pages.tif --sisplit --siappendall", ".tif"},
           {"pages.tif --sisplit --pop --siappend", ".tif"},
           {"pages.tif b.tif --siappend", ".tif"},
           {"b.tif b.tif --flip b.tif --flop --siappend:n=3", ".tif"},
           {"b.tif pages.tif --siappendall", ".tif"},
           {"-i:ch=R,B parts.exr", ".exr"},
           {"-i:ch=G a.exr", ".exr"},
           {"-a parts.exr --ch R", ".exr"},
           {"parts.exr --unmip", ".exr"},
           {"pages.tif --subimage 0 --subimage 0", ".tif"}}) {
    SCOPED_TRACE(line + " " + ending);
    Both(line, ending);
    const int parts = Parts("theirs" + ending);
    ASSERT_EQ(Parts("ours" + ending), parts);
    for (int k = 0; k < parts; ++k) {
      SamePixels("ours" + ending, "theirs" + ending, k, 1e-6);
      EXPECT_EQ(Items("ours" + ending, k)["oiio:subimagename"],
                Items("theirs" + ending, k)["oiio:subimagename"]);
    }
  }
}

TEST_F(OiiotoolFilesTest, WhatIsLeftIsTold) {
  const std::string one = Tessera("parts.exr --mulc 0.5 -o x.exr").err,
                    png = Tessera("parts.exr -o x.png").err;
  EXPECT_NE(one.find("works on the first of 2 images"), std::string::npos) << one;
  EXPECT_NE(png.find("the first of 2 images is written"), std::string::npos) << png;
  EXPECT_EQ(Tessera("-q parts.exr --mulc 0.5 -o x.exr").err, "");
  EXPECT_EQ(Tessera("a.exr --mulc 0.5 -o x.exr").err, "");
  Works("parts.exr -o copy.exr");
  EXPECT_EQ(Works("-a parts.exr copy.exr --diff").find("FAILURE"), std::string::npos);
  Works("-a parts.exr --mulc 0.5 -o half.exr");
  EXPECT_EQ(Tessera("-a parts.exr half.exr --diff").exit_code, 1);
  EXPECT_EQ(Tessera("-a parts.exr a.exr --diff").exit_code, 1);
  EXPECT_NE(Tessera("parts.exr copy.exr --diff").err.find("works on the first"), std::string::npos);
  const CommandResult none = Tessera("parts.exr --subimage third -o x.exr");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("0 (first), 1 (second)"), std::string::npos) << none.err;
  const std::string verified = Works("-a parts.exr --saturate 0.5 --verify -o x.exr");
  EXPECT_NE(verified.find("image 1: "), std::string::npos) << verified;
}

TEST_F(OiiotoolFilesTest, TheSameIsPrinted) {
  for (const char* const line :
       {"--info a.exr",
        "--info b.tif",
        "--info parts.exr",
        "--info -a parts.exr",
        "--info -a pages.tif",
        "--info -v --metamatch compression|Pixel a.exr",
        "--info -v -a --metamatch compression|Pixel parts.exr",
        "--hash b.tif",
        "--hash p.exr",
        "--info --hash a.exr",
        "--info a.exr b.tif",
        "b.tif --colorcount 0,0,0:0.5,0.5,0.5:1,1,1",
        "b.tif --colorcount:eps=.31,.31,.31 0.5,0.5,0.5;1,0,0",
        "p.exr --rangecheck 0,0,0 1,1,1",
        "a.exr --rangecheck 0.2 0.7",
        "a.exr --colorcount 0.5",
        "a.exr --echo {TOP.width}x{TOP.height}",
        "a.exr --echo `{TOP.nchannels} {TOP.alpha_channel}`",
        "a.exr --echo {TOP.filename}|{TOP.file_extension}|{TOP.file_noextension}",
        "a.exr --echo {TOP.geom}",
        "parts.exr --echo {TOP.Artist}",
        "parts.exr --echo {TOP['Artist']}",
        "parts.exr --echo [{TOP[nothing]}]",
        "a.exr --echo `{1+2} {7/2} {7//2} {7%4} {2*3+4*5} {(1+2)*3} {1/3} {-3} {2-3-4}`",
        "a.exr --echo `{1<2} {2<1} {3>=3} {3!=3} {1==1} {5<=>3} {1&&0} {1||0} {!1} {!0}`",
        "a.exr --echo `{eq('a','a')} {eq('a','b')} {neq('a','b')} {not(0)}`",
        "a.exr p.exr --echo {TOP.nchannels}{IMG[0].nchannels}{IMG[1].nchannels}",
        "a.exr --echo {IMG[p.exr].nchannels}",
        "a.exr --echo `{TOP.width+TOP.height*2}`",
        "a.exr --crop 20x10+3+4 --echo `{TOP.x} {TOP.y} {TOP.width} {TOP.full_width}`",
        "a.exr --set i 3 --set j {i+4} --echo {i}-{j}-{var(i)}",
        "a.exr --for i 5 --echo {i} --endfor",
        "a.exr --for i 2,5 --echo {i} --endfor",
        "a.exr --for i 1,10,3 --echo {i} --endfor",
        "a.exr --if 1 --echo yes --else --echo no --endif",
        "a.exr --if 0 --echo yes --else --echo no --endif",
        "a.exr --if `{TOP.width > 50}` --echo wide --endif --if `{TOP.width > 500}` --echo wider --endif",
        "a.exr --set i 4 --while {i} --echo {i} --set i {i-1} --endwhile",
        "a.exr --for i 2 --for j 2 --echo {i}{j} --endfor --endfor",
        "a.exr --if 0 --if 1 --echo inner --endif --else --echo outer --endif",
        "a.exr --if off --echo 1 --else --echo 2 --endif",
        "--echo one --echo:newline=2 two --echo:newline=0 three",
        "a.exr --echo `tab\\there`",
        "a.exr --evaloff --echo {TOP.width} --evalon --echo {TOP.width}",
        "a.exr --label x p.exr --echo {IMG[x].nchannels}",
        "a.exr --echo {TOP.MINCOLOR}|{TOP.MAXCOLOR}|{TOP.AVGCOLOR}",
        "b.tif p.exr --echo {IMG[1].AVGCOLOR}|{IMG[0].MAXCOLOR}",
        "a.exr --mulc 0.5 --echo {TOP.STATS}",
        "a.exr --echo {getattribute(version)}|{getattribute('tiff:half')}",
        "a.exr --frames 3-5 --echo {FRAME_NUMBER} -o x.#.exr",
        "a.exr --frames 3-5 --framepadding 6 --echo {FRAME_NUMBER_PAD} -o x.#.exr",
        "a.exr --frames 3-5 --if `{FRAME_NUMBER > 3}` --echo {FRAME_NUMBER*2} --endif -o x.#.exr"}) {
    SCOPED_TRACE(line);
    const CommandResult ours = Tessera(Quoted(line)), theirs = Oiiotool(Quoted(line));
    ASSERT_EQ(theirs.exit_code, 0) << theirs.err;
    EXPECT_EQ(ours.exit_code, 0) << ours.err;
    std::string expected = theirs.out;
    for (size_t at; (at = expected.find("Reading ")) != std::string::npos;)  // -v of theirs
      expected.erase(at, expected.find('\n', at) + 1 - at);
    EXPECT_EQ(ours.out, expected);
  }
  for (const char* const line :
       {"--dumpdata s.tif", "--dumpdata:C=table s.tif", "--dumpdata s.exr", "--dumpdata:empty=0 s.tif"}) {
    Works("--pattern checker:width=1:height=1 3x2 3 -d uint8 -o s.tif");
    Works("--pattern checker:width=1:height=1 3x2 3 -d half -o s.exr");
    SCOPED_TRACE(line);
    std::string theirs = Oiiotool(Quoted(line)).out;
    if (theirs.starts_with("// ")) theirs.erase(0, 3);
    EXPECT_EQ(Works(line), theirs);
  }
}

// Theirs says float for the half of its buffers, and also names the format that the file had.
TEST_F(OiiotoolFilesTest, MetadataInExpressions) {
  const auto lines = [&](const std::string& text) {
    std::vector<std::string> all;
    OIIO::Strutil::split(text, all, "\n");
    return all;
  };
  const std::string brief = Works("a.exr --echo {TOP.METABRIEF}");
  EXPECT_THAT(Oiiotool("a.exr --echo {TOP.METABRIEF}").out, ::testing::StartsWith(brief.substr(0, 24)));
  EXPECT_FALSE(brief.ends_with(" \n"));
  const std::vector<std::string> ours = lines(Works("a.exr --echo {TOP.META}")),
                                 theirs = lines(Oiiotool("a.exr --echo {TOP.META}").out);
  ASSERT_EQ(ours.size(), theirs.size());
  for (size_t i = 1; i < ours.size(); ++i) EXPECT_EQ(ours[i], theirs[i]);
  const CommandResult unknown = Tessera("a.exr --echo {getattribute(nothing)}");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, ::testing::HasSubstr("no such attribute"));
}

TEST_F(OiiotoolFilesTest, OutputsAreAsOldAsTheirMetadataSay) {
  const std::vector<std::string> line =
      Quoted("a.exr --attrib DateTime `2020:02:03 04:05:06` --adjust-time -o ours.exr");
  EXPECT_EQ(Tessera(line).exit_code, 0);
  std::vector<std::string> other = line;
  other.back() = "theirs.exr";
  EXPECT_EQ(Oiiotool(other).exit_code, 0);
  EXPECT_EQ(std::filesystem::last_write_time(Path("ours.exr")),
            std::filesystem::last_write_time(Path("theirs.exr")));
  const CommandResult never = Tessera("a.exr --attrib DateTime never --adjust-time -o never.exr");
  EXPECT_EQ(never.exit_code, 1);
  EXPECT_THAT(never.err, ::testing::HasSubstr("found the DateTime \"never\""));
  EXPECT_FALSE(std::filesystem::exists(Path("never.exr")));
}

TEST_F(OiiotoolFilesTest, TilesOfOneOutput) {
  Works("a.exr -o:tile=32x16 tiles.exr -o lines.exr");
  EXPECT_EQ(Load("tiles.exr").nativespec().tile_width, 32);
  EXPECT_EQ(Load("tiles.exr").nativespec().tile_height, 16);
  EXPECT_EQ(Load("lines.exr").nativespec().tile_width, 0);
  for (const char* const wrong : {"16", "0x16", "16x16x1", "16x-1"}) {
    const CommandResult refused = Tessera("a.exr -o:tile=" + std::string(wrong) + " x.exr");
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_THAT(refused.err, ::testing::HasSubstr("expected WxH")) << wrong;
  }
}

TEST_F(OiiotoolFilesTest, ExpressionsMakeTheSamePictures) {
  for (const char* const line :
       {"a.exr --crop {TOP.width//2}x{TOP.height}+3+2", "a.exr --for i 3 --mulc {0.5+i*0.25} --endfor",
        "a.exr --while `{TOP.width > 20}` --resample 50% --endwhile",
        "a.exr --if `{TOP.nchannels == 3}` --ch R,G --else --ch A --endif",
        "a.exr --cshift +{TOP.width//3}+0", "a.exr p.exr --ch R,G,B --label q --pop q --add",
        "p.exr a.exr --if 0 --swap --endif --ch R,G,B --pop --ch R,G,B"}) {
    SCOPED_TRACE(line);
    Both(std::string(line) + " -d float", ".exr");
    SamePixels("ours.exr", "theirs.exr", 0, 1e-6);
  }
}

TEST_F(OiiotoolFilesTest, DrawingAndTransformsAreOpenImageIOs) {
  for (const char* const line :
       {"p.exr --box:color=1,0,0,1 5,6,30,20", "a.exr --box:color=0,1,0:fill=1 5,6,30,20",
        "p.exr --box:color=1,0,0,.5:fill=1 0,0,99,20", "a.exr --line:color=1,1,0 2,3,50,30",
        "p.exr --line:color=1,1,0,.7 2,3,50,30,10,40,2,3", "a.exr --point:color=0,1,1 5,5,6,7",
        "p.exr --point 9,9", "a.exr --text:font=DejaVuSans:x=10:y=30:size=20:color=1,0,1 Tessera",
        "p.exr --text:font=DejaVuSans:shadow=2 hello",
        "a.exr --text:font=DejaVuSans:xalign=center:yalign=top:x=30:y=5 up", "a.exr --ch R --fft",
        "a.exr --ch R --fft --ifft", "a.exr --ch R,G --polar", "a.exr --ch R,G --unpolar",
        "p.exr --ch R,G --polar --unpolar", "a.exr --pixelaspect 2",
        "a.exr --attrib PixelAspectRatio 2.0 --pixelaspect 1", "a.exr --pixelaspect:filter=triangle 0.5"}) {
    SCOPED_TRACE(line);
    Both(std::string(line) + " -d float", ".exr");
    SamePixels("ours.exr", "theirs.exr", 0, 2e-5);
  }
  Both("b.tif --box:color=1,0,0:fill=1 5,6,30,20", ".tif");
  SamePixels("ours.tif", "theirs.tif", 0, 0);
  EXPECT_EQ(Items("ours.tif"), Items("theirs.tif"));
  EXPECT_EQ(Works("a.exr a.exr --pdiff"), Oiiotool(Words("a.exr a.exr --pdiff")).out);
  EXPECT_EQ(Tessera("a.exr a.exr --mulc 3 --pdiff").exit_code, 1);
}

TEST_F(OiiotoolFilesTest, FilesThatAreThereAreLeft) {
  Works("a.exr -o kept.exr");
  const std::string told = Tessera("--no-clobber a.exr --mulc 0 -o kept.exr").err;
  EXPECT_NE(told.find("--no-clobber"), std::string::npos) << told;
  EXPECT_NE(Sample("kept.exr", 5, 5, 0), 0);
  Works("-u a.exr --mulc 0 -o kept.exr");
  EXPECT_NE(Sample("kept.exr", 5, 5, 0), 0);
  Works("--missingfile black a.exr gone.exr --add -o same.exr");
  SamePixels("same.exr", "a.exr", 0, 0);
  EXPECT_EQ(Tessera("a.exr gone.exr --add -o same.exr").exit_code, 1);
  Works("--missingfile checker a.exr gone.exr -o checker.exr --pop --pop");
  ASSERT_EQ(Oiiotool("--missingfile checker a.exr gone.exr -o theirs.exr").exit_code, 1);
  EXPECT_EQ(Tessera(Quoted("a.exr --attrib DateTime `2001:02:03 04:05:06` --sansattrib -o x.exr")).exit_code,
            0);
  const std::string history = Load("x.exr").spec().get_string_attribute("Exif:ImageHistory");
  EXPECT_EQ(history.find("2001"), std::string::npos) << history;
}

TEST_F(OiiotoolFilesTest, WrongBlocksAndExpressionsAreTold) {
  for (const auto& [line, told] : std::vector<std::pair<std::string, std::string>>{
           {"a.exr --if 1 -o x.exr", "--endif"},
           {"a.exr --endif -o x.exr", "no --if before"},
           {"a.exr --else -o x.exr", "no --if before"},
           {"a.exr --for i 3 --endwhile -o x.exr", "no --while before"},
           {"a.exr --for i x --endfor -o x.exr", "BEGIN,END"},
           {"a.exr --addc {TOP.nothing} -o x.exr", "nothing"},
           {"a.exr --addc {1+} -o x.exr", "expected a number"},
           {"a.exr --addc {IMG[3].width} -o x.exr", "the stack holds 1"},
           {"a.exr --if 1 --add --endif -o x.exr", "needs 2 images"},
           {"--threads {1+1} a.exr -o x.exr", "options hold"},
           {"a.exr --otex x.exr", "maketx"},
           {"a.exr --deepen -o x.exr", "deep pixels"},
           {"a.exr --views left,right -o x.exr", "every view"}}) {
    SCOPED_TRACE(line);
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(told), std::string::npos) << result.err;
    EXPECT_FALSE(std::ifstream(Path("x.exr")).good());
  }
}

}  // namespace
}  // namespace tessera::testing
