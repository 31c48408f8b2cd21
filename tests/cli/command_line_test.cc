// Wrong lines and bad inputs: the message, the exit code, and that nothing is left behind.
#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

struct BadLine {
  const char* line;
  int exit_code;
  std::vector<std::string> says;  // pieces of the message
};

class CommandLineTest : public CliTest {
 protected:
  void SetUp() override {
    MakePicture("a.png", 32, 24, 3, OIIO::TypeUInt8);
    MakePicture("small.png", 16, 24, 3, OIIO::TypeUInt8);
    std::ofstream(Path("empty.png")).close();
    std::ofstream(Path("text.exr")) << "this is no picture\n";
    std::ofstream(Path("kept.png")) << "what was there";
    std::filesystem::create_directory(Path("folder.png"));
    const std::string whole = FileText(Path("a.png"));
    std::ofstream(Path("cut.png"), std::ios::binary) << whole.substr(0, whole.size() / 2);
  }

  void Check(const BadLine& bad) {
    SCOPED_TRACE(std::string("tessera ") + bad.line);
    const auto before = directory_.Names();
    const CommandResult result = Tessera(bad.line);
    EXPECT_EQ(result.exit_code, bad.exit_code) << result.err;
    EXPECT_TRUE(result.err.starts_with("tessera: error: ")) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    for (const std::string& piece : bad.says) {
      EXPECT_NE(result.err.find(piece), std::string::npos) << "missing \"" << piece << "\" in\n"
                                                           << result.err;
    }
    EXPECT_EQ(directory_.Names(), before);
    EXPECT_EQ(FileText(Path("kept.png")), "what was there");
  }
};

TEST_F(CommandLineTest, WrongWordsAreNamedWithTheNearestKnownOne) {
  for (const BadLine& bad : std::vector<BadLine>{
           {"a.png --saturat 2 -o out.png", 2, {"--saturat", "did you mean --saturate?"}},
           {"a.png --zzzzzzzz -o out.png", 2, {"--zzzzzzzz", "unknown command"}},
           {"a.png --hue:preserv=none 30 -o out.png", 2, {"--hue", "preserv", "did you mean preserve?"}},
           {"a.png --hue:preserve=lumi 30 -o out.png", 2, {"preserve", "luminance"}},
           {"a.png --hue 30:preserve=none -o out.png",
            2,
            {"modifiers follow the name: --hue:preserve=none 30"}},
           {"a.png --resize 50%:filter=box -o out.png", 2, {"--resize:filter=box 50%"}},
           {"a.png --swap:now=1 -o out.png", 2, {"--swap", "now", "none"}},
           {"--pattern cheker 8x8 3 -o out.png", 2, {"--pattern", "did you mean checker?"}},
           {"--pattern checker:widht=3 8x8 3 -o out.png", 2, {"checker", "did you mean width?"}},
           {"a.png -d uint9 -o out.png", 2, {"-d", "uint9", "uint8"}},
           {"a.png --simd AVX7 -o out.png", 2, {"--simd", "AVX7"}},
           {"--help saturat", 2, {"did you mean saturate?"}},
           {"--list-commands:format=xml", 2, {"xml", "json"}},
       }) {
    Check(bad);
  }
}

TEST_F(CommandLineTest, CommandsAreNoArgumentsAndTypesHaveOtherNames) {
  struct Case {
    std::string line, message;
  };
  for (const Case& c :
       {Case{"a.exr --ociodisplay -o x.png", "--ociodisplay: found the command -o, expected DISPLAY"},
        Case{"a.exr --saturate --hue 30 -o x.png", "--saturate: found the command --hue"},
        Case{"a.exr -o --stats", "-o: found the command --stats, expected FILE"},
        Case{"a.exr -d float16 -o x.exr",
             "-d: found \"float16\", expected uint8, uint16, half or "
             "float; did you mean half?"},
        Case{"a.exr -d float32 -o x.exr", "did you mean float?"},
        Case{"a.exr -d ushort -o x.exr", "did you mean uint16?"}}) {
    const CommandResult result = Tessera(c.line);
    EXPECT_EQ(result.exit_code, 2) << c.line;
    EXPECT_NE(result.err.find(c.message), std::string::npos) << c.line << ": " << result.err;
  }
  EXPECT_EQ(Tessera("--pattern checker 8x6 3 --addc -0.5 --attrib Comment -o -o y.exr").exit_code, 0);
}

TEST_F(CommandLineTest, WrongArgumentsAreRefusedBeforeAFileIsTouched) {
  // The missing input shows that nothing was opened: the argument is what is complained about.
  for (const BadLine& bad : std::vector<BadLine>{
           {"gone.png --ccmatrix 1,2,3,4,5,6,7,8 -o out.png", 2, {"ccmatrix", "8", "9"}},
           {"gone.png --saturate nan -o out.png", 2, {"saturate", "nan", "finite"}},
           {"gone.png --saturate 1,5x -o out.png", 2, {"saturate", "1,5x"}},
           {"gone.png --mulc 1,,2 -o out.png", 2, {"mulc", "position 2"}},
           {"gone.png --mulc inf -o out.png", 2, {"mulc", "inf"}},
           {"gone.png --quantize 99 -o out.png", 2, {"quantize", "99"}},
           {"gone.png --threads -1 -o out.png", 2, {"threads", "-1"}},
           {"gone.png --threads many -o out.png", 2, {"threads", "many"}},
           {"gone.png --max-memory 0 -o out.png", 2, {"max-memory", "0"}},
           {"gone.png --verify:samples=0 -o out.png", 2, {"samples", "0"}},
           {"gone.png --attrib:type=int N", 2, {"--attrib", "VALUE"}},
           {"gone.png -o", 2, {"-o", "FILE"}},
           {"gone.png --saturate", 2, {"--saturate", "end of the line"}},
           {"gone.png --hue:preserve=\"none 30 -o out.png", 2, {"quote"}},
       }) {
    Check(bad);
  }
}

TEST_F(CommandLineTest, TheStackMustComeOut) {
  for (const BadLine& bad : std::vector<BadLine>{
           {"", 2, {"no image", "--help"}},
           {"a.png", 2, {"no output", "-o"}},
           {"a.png --invert", 2, {"no output"}},
           {"a.png --add -o out.png", 2, {"--add", "needs 2 images", "holds 1"}},
           {"--invert -o out.png", 2, {"--invert", "needs 1 image", "holds 0"}},
           {"-o out.png", 2, {"-o", "needs 1 image"}},
           {"a.png --swap -o out.png", 2, {"--swap", "needs 2 images"}},
           {"a.png --pop --pop", 2, {"--pop", "holds 0"}},
           {"small.png a.png -o out.png", 2, {"small.png", "left over"}},
           {"a.png -o out.png -o out.png", 2, {"out.png", "written twice"}},
           {"a.png -o out.png out.png --add -o b.png", 2, {"out.png", "wrote"}},
           {"a.png -o out.png -d half", 2, {"-d", "-o", "after"}},
           {"a.png a.png --diff --fail 0.1", 2, {"--fail", "--diff", "after"}},
       }) {
    Check(bad);
  }
}

TEST_F(CommandLineTest, FrameRangesAreChecked) {
  for (const BadLine& bad : std::vector<BadLine>{
           {"--frames 5-1 a.png -o out.#.png", 2, {"5-1", "at least 5"}},
           {"--frames 1-10x0 a.png -o out.#.png", 2, {"1-10x0", "step"}},
           {"--frames 1-999999999 a.png -o out.#.png", 2, {"1-999999999", "1000000"}},
           {"--frames 1-99999999999999 a.png -o out.#.png", 2, {"99999999999999"}},
           {"--frames one a.png -o out.#.png", 2, {"one", "range"}},
           {"--frames 1- a.png -o out.#.png", 2, {"1-"}},
           {"--frames 1,,2 a.png -o out.#.png", 2, {"range"}},
           {"--frames 1-3 a.png -o out.png", 2, {"--frames", "# or %04d"}},
           {"in.1-3#.png -o out.1-4#.png", 2, {"4 frames", "expected 3"}},
           {"in.#.png -o out.#.png", 1, {"in.#.png", "no file matches"}},
           {"--framepadding 0 a.png -o out.#.png", 2, {"framepadding"}},
       }) {
    Check(bad);
  }
}

TEST_F(CommandLineTest, TablesOfTextAndBordersOfOneNumber) {
  std::ofstream(Path("curve.txt")) << "\xEF\xBB\xBF# bright\n0 0 0\n0.75, 0.75, 0.75\r\n1 1 1\n";
  std::ofstream(Path("wide.txt")) << "0 0 0 0 0\n";
  Works("--pattern ramp 9x8 3 --dup --table curve.txt --swap --table 0,0.75,1 --diff");
  const CommandResult wide = Tessera("--pattern ramp 9x8 3 --table wide.txt -o kept.png");
  EXPECT_EQ(wide.exit_code, 1);
  EXPECT_NE(wide.err.find("wide.txt: line 1: found more than 4 numbers"), std::string::npos) << wide.err;
  std::ofstream(Path("uneven.txt")) << "0 0 0\n1 1\n";
  const CommandResult uneven = Tessera("--pattern ramp 9x8 3 --table uneven.txt -o kept.png");
  EXPECT_EQ(uneven.exit_code, 1);
  EXPECT_NE(uneven.err.find("uneven.txt: line 2: found 2 numbers, expected 3 as in the first line"),
            std::string::npos)
      << uneven.err;
  const std::string look_up =
      "--pattern constant:color=2,2 4x4 2 --pattern constant:color=1,1,1 4x4 3 --lookup:dims=2:wrap=border:border=";
  Works(look_up + "0.5 " + look_up + "0.5,0.5,0.5 --diff");
}

TEST_F(CommandLineTest, FilesOfNumbersAreListsOfThem) {
  std::ofstream(Path("lights.txt")) << "# x y z r g b size\n12 10 2 1 .8 .4 9\n30.3, 18.6, 5, .2, .5, 1, 6\n";
  std::ofstream(Path("smoke.txt")) << "0 1 .5 .2 0\n1 .2 .4 1 .5 # value, colour, opacity\n";
  std::ofstream(Path("steps.txt")) << "0 0\n.5 1\n1 .2\n";
  const std::string lights = "--pattern lightpoints:",
                    solid = "--volume:solid=sphere(0,0,0,.6):dims=24:size=24x20:";
  const std::string smoke = solid + "mode=over:transfer=", dmf = solid + "mode=hyper:soft=.3:dmf=table(";
  for (const auto& [listed, filed] :
       {std::pair(lights + "points=12,10,2,1,0.8,0.4,9,30.3,18.6,5,0.2,0.5,1,6 40x30 4",
                  lights + "file=lights.txt 40x30 4"),
        std::pair(smoke + "0,1,.5,.2,0,1,.2,.4,1,.5", smoke + "smoke.txt"),
        std::pair(dmf + "0,0,.5,1,1,.2)", dmf + "steps.txt)")}) {
    Works(listed + " " + filed + " --diff");
    Works(listed + " -o x.exr");
    EXPECT_GT(Sample("x.exr", 12, 10, 0), 0.05f) << listed;
    std::string gone = filed;
    gone.replace(gone.find(".txt"), 4, "");
    const CommandResult refused = Tessera(gone + " -o kept.png");
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("no such file, expected lines of"), std::string::npos) << refused.err;
  }
}

TEST_F(CommandLineTest, BadInputsAndOutputsLeaveNothing) {
  for (const BadLine& bad : std::vector<BadLine>{
           {"gone.png -o kept.png", 1, {"gone.png"}},
           {"folder.png -o kept.png", 1, {"folder.png", "directory"}},
           {"empty.png -o kept.png", 1, {"empty.png"}},
           {"text.exr -o kept.png", 1, {"text.exr"}},
           {"cut.png -o kept.png", 1, {"cut.png"}},
           {"a.png cut.png --add -o kept.png", 1, {"cut.png"}},
           {"-i:subimage=7 a.png -o kept.png", 1, {"a.png", "7"}},
           {"-i:subimage=beauty a.png -o kept.png", 1, {"a.png", "beauty"}},
           {"a.png small.png --interp 0.5 -o kept.png", 1, {"interp", "32", "16"}},
           {"a.png small.png --diff", 1, {"32 x 24", "16 x 24"}},
           {"a.png --ch R,Q -o kept.png", 1, {"ch", "Q", "R", "G", "B"}},
           {"a.png --dup --blend:constant=1 over -o kept.png", 2, {"--blend", "constant="}},
           {"a.png --dup --blend:src=src-color:constant=1 add -o kept.png", 2, {"--blend", "constant="}},
           {"a.png -o gone/out.png", 1, {"gone/out.png", "directory"}},
           {"a.png -o folder.png", 1, {"folder.png", "directory"}},
           {"a.png -o out.nosuch", 1, {"out.nosuch", "extension"}},
           {"a.png -o out", 1, {"out", "extension"}},
           {"a.png -d half -o kept.png", 1, {"kept.png", "half"}},
           {"--create 8x8 7 -o kept.png", 1, {"kept.png", "7"}},
           // The first output was complete, the second fails: neither appears.
           {"a.png -o first.png --invert -o gone/second.png", 1, {"gone/second.png"}},
           {"a.png -o first.png cut.png -o second.png", 1, {"cut.png"}},
       }) {
    Check(bad);
  }
}

TEST_F(CommandLineTest, ValuesThatNoImageMakesRightAreAWrongLine) {
  for (const BadLine& bad : std::vector<BadLine>{
           {"a.png --crop 10by10 -o kept.png", 2, {"crop", "10by10"}},
           {"a.png --attrib:type=int N x -o kept.png", 2, {"--attrib", "x", "int"}},
           {"--create 0x5 3 -o kept.png", 2, {"--create", "0x5"}},
           {"--create 64 3 -o kept.png", 2, {"--create", "64", "WxH"}},
           {"--pattern perlin:period=2.5 8x8 1 -o kept.png", 2, {"period", "2.5", "whole number"}},
           {"--create 2147483647x2147483647 3 -o kept.png", 2, {"2147483647x2147483647", "16777216"}},
           {"--pattern ramp axb 3 -o kept.png", 2, {"axb"}},
           {"--kernel foo 3x3 -o kept.exr", 2, {"error: --kernel: ", "foo"}},
           {"a.png --blur 0x0 -o kept.png", 2, {"--blur", "0x0"}},
           {"a.png --resize 3by4 -o kept.png", 2, {"--resize", "3by4"}},
           {"a.png --zoom 0,1 -o kept.png", 2, {"--zoom", "0"}},
           {"a.png --convolve:kernel=fox -o kept.png", 2, {"--convolve", "box"}},
           {"a.png --blur:bits=3 5x5 -o kept.png", 2, {"error: --blur: found 3 bits"}},
           {"a.png --unsharp:kernel=disk:width=7:method=separable -o kept.png",
            2,
            {"error: --unsharp: found method=separable"}},
           {"a.png --emboss:method=separable N -o kept.png", 2, {"error: --emboss: found method=separable"}},
           {"a.png --laplacian:bits=12:method=fft -o kept.png", 2, {"error: --laplacian: found bits=12"}},
           {"a.png --sobel:bits=3 -o kept.png", 2, {"error: --sobel: found 3 bits"}},
           {"a.png --zoom 0,0.5 -o kept.png", 2, {"the factors 0,0.5,"}},
           {"--pattern perlin:turbulence=1:sum=ridged 8x8 1 -o kept.png",
            2,
            {"--pattern perlin: found turbulence= with sum="}},
           {"a.png --warp 1,1,1,1,1,1,1,1,1 -o kept.png", 2, {"--warp", "inverse"}},
           {"a.png a.png --lookup:wrap=round -o kept.png", 2, {"--lookup:wrap", "round"}},
           {"--volume:solid=ball:mode=solid -o kept.png", 2, {"--volume", "sphere"}},
           // What another file could make right is no wrong line.
           {"a.png --table gone.txt -o kept.png", 1, {"gone.txt"}},
           {"a.png --lut gone.cube -o kept.png", 1, {"gone.cube"}},
           {"--volume:file=gone.vol -o kept.png", 1, {"gone.vol"}},
           {"a.png --colorconvert linear Q -o kept.png", 1, {"built-in", "Q"}},
           {"a.png --table:channels=R,Q 0,1 -o kept.png", 1, {"Q", "R,G,B"}},
           {"a.png --ch R --ccmatrix 1,0,0,0,1,0,0,0,1 -o kept.png", 1, {"ccmatrix", "three"}},
       }) {
    Check(bad);
  }
}

TEST_F(CommandLineTest, AllImagesAreMadeBeforeAnythingIsComputed) {
  for (const char* const wrong : {"--blur 0x0", "--ch Q", "--zoom 1e6,1e6"}) {
    const CommandResult result =
        Tessera("a.png --printstats --runstats -o first.png " + std::string(wrong) + " -o second.png");
    EXPECT_NE(result.exit_code, 0);
    EXPECT_EQ(result.out, "") << "computed before " << wrong << " was looked at";
  }
}

TEST_F(CommandLineTest, SizesThatNobodyCanWriteAreNamed) {
  for (const BadLine& bad : std::vector<BadLine>{
           {"a.png --zoom 1e6,1e6 --invert -o kept.exr",
            1,
            {"--zoom 1e6,1e6", "32000000 x 24000000", "2^40"}},
           {"a.png --zoom 1e6,1e6 --printstats", 1, {"--zoom 1e6,1e6", "32000000 x 24000000"}},
           {"a.png --zoom 1e5,1e5 a.png --diff", 1, {"--diff", "3200000 x 2400000"}},
           {"--pattern ramp 70000x3 3 -d uint8 -o kept.gif", 1, {"kept.gif", "70000 x 3", "65535"}},
           {"--pattern ramp 3x70000 3 -d uint8 -o kept.jpg", 1, {"kept.jpg", "3 x 70000", "65500"}},
           {"--pattern ramp 20000x3 3 -d uint8 -o kept.webp", 1, {"kept.webp", "20000 x 3", "16383"}},
           {"a.png --resize 2000000x1 -o kept.png", 1, {"kept.png", "2000000 x 1", "1000000"}},
       }) {
    Check(bad);
  }
  // What is cut down is computed where it is needed only.
  Works("a.png --zoom 1e6,1e6 --crop 8x8+16000000+12000000 -d float -o part.exr");
  EXPECT_EQ(Sample("part.exr", 16000000, 12000000, 0), Sample("a.png", 16, 12, 0));
}

TEST_F(CommandLineTest, DashesAreEqualAndModifiersMayBeQuoted) {
  Works("a.png -invert -o one.png");
  Works("a.png --invert --o two.png");
  EXPECT_EQ(Oiiotool("--fail 0 one.png two.png --diff").exit_code, 0);
  Works("--pattern \"checker\":width='4':color1='0.5,0,0' 8x8 3 -d float -o c.tif");
  EXPECT_EQ(Sample("c.tif", 0, 0, 0), 0.5f);
  EXPECT_EQ(Sample("c.tif", 4, 0, 1), 1.0f);
}

TEST_F(CommandLineTest, NumbersDoNotDependOnTheLocale) {
  setenv("LC_ALL", "de_DE.UTF-8", 1);
  Works("--pattern constant:color=0.25 4x4 1 --mulc 0.5 -d float -o c.tif");
  unsetenv("LC_ALL");
  EXPECT_EQ(Sample("c.tif", 0, 0, 0), 0.125f);
}

TEST_F(CommandLineTest, StandardOutputThatCannotBeWrittenIsAnError) {
  const CommandResult result = RunCommand(
      {"sh", "-c", std::string("'") + TESSERA_PROGRAM + "' --list-commands > /dev/full"}, directory_.path());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("standard output"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace tessera::testing
