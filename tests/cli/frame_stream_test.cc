// --stream: frames of pipes, as bytes that the tests make themselves and as FFmpeg makes them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "cli/cli_test.h"
#include "io/video/pixel_format.h"
#include "io/video/y4m.h"
#include "support/sanitized.h"

namespace tessera::testing {
namespace {

class FrameStreamTest : public CliTest {
 protected:
  // `tool` stands for the program.
  CommandResult Shell(std::string line) {
    for (size_t at; (at = line.find("tool ")) != std::string::npos;)
      line.replace(at, 4, "'" TESSERA_PROGRAM "'");
    return RunCommand({"bash", "-c", line}, directory_.path());
  }
  void ShellWorks(const std::string& line) {
    const CommandResult result = Shell(line);
    EXPECT_EQ(result.exit_code, 0) << line << "\n" << result.err;
  }
  std::string Bytes(const std::string& name) const { return FileText(directory_.path() / name); }
  void Keep(const std::string& name, const std::string& bytes) const {
    std::ofstream(directory_.path() / name, std::ios::binary) << bytes;
  }

  // Codes of the whole range, another picture for every frame.
  static std::string RandomFrame(const io::PixelFormat& f, int width, int height, uint32_t seed) {
    std::string frame(io::FrameBytes(f, width, height), 0);
    uint32_t state = 77 + 1000 * seed;
    const size_t sample = PixelBytes(f.type);
    for (size_t i = 0; i < frame.size() / sample; ++i) {
      state ^= state << 13, state ^= state >> 17, state ^= state << 5;
      if (f.type == PixelType::kFloat) {
        const float value = static_cast<float>(state >> 8) / 4194304.F - 1;
        std::memcpy(frame.data() + i * sample, &value, sample);
      } else {
        const uint32_t code = f.type == PixelType::kHalf ? 0x2000 + state % 0x2000
                                                         : (state >> 7) % static_cast<uint32_t>(f.Top() + 1);
        std::memcpy(frame.data() + i * sample, &code, sample);
      }
    }
    return frame;
  }
  static std::string RawFrames(const io::PixelFormat& f, int width, int height, int count) {
    std::string frames;
    for (int k = 0; k < count; ++k) frames += RandomFrame(f, width, height, static_cast<uint32_t>(k));
    return frames;
  }
  static std::string Y4m(const std::string& header, int width, int height, int count) {
    const std::string line =
        "YUV4MPEG2 W" + std::to_string(width) + " H" + std::to_string(height) + " " + header;
    const io::Y4mHeader h = io::ParseY4mHeader("test", line);
    std::string stream = line + "\n";
    for (int k = 0; k < count; ++k)
      stream += "FRAME\n" + RandomFrame(*h.pixels, width, height, static_cast<uint32_t>(k));
    return stream;
  }
  static std::string Behind(const std::string& stream) { return stream.substr(stream.find('\n') + 1); }
};

TEST_F(FrameStreamTest, RawFramesComeBack) {
  for (const io::PixelFormat& f : io::PixelFormats()) {
    std::string frames = RawFrames(f, 13, 7, 3);
    Keep("in.raw", frames);
    ShellWorks("tool --stream:alpha=premultiplied:input=" + f.name + ":size=13x7 - -o - < in.raw > out.raw");
    EXPECT_TRUE(Bytes("out.raw") == frames) << f.name;
  }
}

// The codes of all, those beyond the limited range and the colours that R'G'B' has not among them.
TEST_F(FrameStreamTest, FramesOfY4mComeBack) {
  for (const std::string& word : io::Y4mColorWords()) {
    const std::string in = Y4m("F24:1 Ip A1:1 C" + word, 14, 6, 4);
    Keep("in.y4m", in);
    ShellWorks("tool --stream - -o - < in.y4m > out.y4m");
    EXPECT_TRUE(Behind(Bytes("out.y4m")) == Behind(in)) << word;
    if (word != "420mpeg2" && word != "422p10") continue;
    for (const char* const how :
         {"matrix=bt2020", "range=full", "range=limited", "siting=centre", "siting=topleft"}) {
      ShellWorks(std::string("tool --stream:") + how + " - -o - < in.y4m > out.y4m");
      EXPECT_TRUE(Behind(Bytes("out.y4m")) == Behind(in)) << word << " " << how;
    }
  }
}

TEST_F(FrameStreamTest, HeaderIsTheInputs) {
  Keep("in.y4m", Y4m("F30000:1001 Ip A16:15 C422p10 XCOLORRANGE=FULL Xmine", 6, 4, 1));
  const auto header = [&](const std::string& line) {
    ShellWorks(line);
    return Bytes("out.y4m").substr(0, Bytes("out.y4m").find('\n'));
  };
  EXPECT_EQ(header("tool --stream - -o - < in.y4m > out.y4m"),
            "YUV4MPEG2 W6 H4 F30000:1001 Ip A16:15 C422p10 XYSCSS=422P10 XCOLORRANGE=FULL");
  EXPECT_EQ(header("tool --stream:output=C420mpeg2:rate=24 - --resize 4x2 -o - < in.y4m > out.y4m"),
            "YUV4MPEG2 W4 H2 F24:1 Ip A16:15 C420mpeg2 XYSCSS=420MPEG2 XCOLORRANGE=FULL");
  EXPECT_EQ(header("tool --stream:output=Cmono - --ch R -o - < in.y4m > out.y4m"),
            "YUV4MPEG2 W6 H4 F30000:1001 Ip A16:15 Cmono XCOLORRANGE=FULL");
}

TEST_F(FrameStreamTest, RawFramesBecomeY4m) {
  const io::PixelFormat& f = *io::FindPixelFormat("yuv422p10le");
  const std::string frame = RawFrames(f, 6, 4, 1);
  Keep("in.raw", frame);
  ShellWorks("tool --stream:input=yuv422p10le:size=6x4:output=y4m:rate=24000/1001 - -o - < in.raw > out.y4m");
  EXPECT_TRUE(Bytes("out.y4m") ==
              "YUV4MPEG2 W6 H4 F24000:1001 Ip A0:0 C422p10 XYSCSS=422P10 XCOLORRANGE=LIMITED\nFRAME\n" +
                  frame);
}

double Clamped(double v) { return std::clamp(v, 0.0, 1.0); }

// BT.601 and BT.709 as they are written down, by their own numbers.
TEST_F(FrameStreamTest, ColorsAreTheFormulas) {
  const int width = 40, height = 30;
  for (const auto& [matrix, kr, kb] : {std::tuple{"bt601", 0.299, 0.114}, {"bt709", 0.2126, 0.0722}}) {
    for (const bool full : {false, true}) {
      const std::string in =
          Y4m(std::string("C444 XCOLORRANGE=") + (full ? "FULL" : "LIMITED"), width, height, 1);
      Keep("in.y4m", in);
      ShellWorks("tool --stream:output=rgb24:matrix=" + std::string(matrix) + " - -o - < in.y4m > out.rgb");
      const std::string rgb = Bytes("out.rgb"), yuv = Behind(in).substr(6);
      const size_t pixels = width * height;
      ASSERT_EQ(rgb.size(), 3 * pixels);
      int wrong = 0;
      for (size_t i = 0; i < pixels; ++i) {
        const auto code = [&](size_t plane) { return double(static_cast<uint8_t>(yuv[plane * pixels + i])); };
        const double y = full ? code(0) / 255 : (code(0) - 16) / 219;
        const double cb = (code(1) - 128) / (full ? 255 : 224), cr = (code(2) - 128) / (full ? 255 : 224);
        const double r = y + 2 * (1 - kr) * cr, b = y + 2 * (1 - kb) * cb;
        const double g = (y - kr * r - kb * b) / (1 - kr - kb);
        const double wanted[] = {r, g, b};
        for (size_t c = 0; c < 3; ++c) {
          // A tie may fall either way.
          const double exact = 255 * Clamped(wanted[c]);
          wrong += std::abs(exact - double(static_cast<uint8_t>(rgb[3 * i + c]))) > 0.5001;
        }
      }
      EXPECT_EQ(wrong, 0) << matrix << full;
    }
  }
}

// Without a word the size says which matrix: white, red of 709 and of 601.
TEST_F(FrameStreamTest, MatrixGoesByTheSize) {
  Works("--pattern constant:color=1,0,0 1280x2 3 -o wide.exr");
  Works("--pattern constant:color=1,0,0 720x2 3 -o narrow.exr");
  for (const auto& [name, y, cb, cr, width] :
       {std::tuple{"wide", 63, 102, 240, 1280}, {"narrow", 81, 90, 240, 720}}) {
    ShellWorks(std::string("tool --stream ") + name + ".exr -o - > out.y4m");
    const std::string planes = Behind(Bytes("out.y4m")).substr(6);
    const size_t pixels = static_cast<size_t>(width) * 2;
    ASSERT_EQ(planes.size(), 3 * pixels);
    EXPECT_EQ(static_cast<uint8_t>(planes[0]), y);
    EXPECT_EQ(static_cast<uint8_t>(planes[pixels]), cb);
    EXPECT_EQ(static_cast<uint8_t>(planes[2 * pixels]), cr);
  }
}

// The same as files, whatever goes on at once.
TEST_F(FrameStreamTest, PixelsAreThoseOfFiles) {
  const int count = 9;
  std::string frames;
  for (int k = 1; k <= count; ++k) {
    const std::string name = "in.000" + std::to_string(k) + ".png";
    MakePicture(name, 31, 19, 3, OIIO::TypeUInt8, k);
    const OIIO::ImageBuf image(Path(name));
    std::string frame(31 * 19 * 3, 0);
    ASSERT_TRUE(image.get_pixels(OIIO::ROI(), OIIO::TypeUInt8, frame.data()));
    frames += frame;
  }
  Keep("in.raw", frames);
  Works("in.#.png --saturate 1.3 --blur 5x5 -o out.#.png");
  std::string wanted;
  for (int k = 1; k <= count; ++k) {
    std::string frame(31 * 19 * 3, 0);
    OIIO::ImageBuf(Path("out.000" + std::to_string(k) + ".png"))
        .get_pixels(OIIO::ROI(), OIIO::TypeUInt8, frame.data());
    wanted += frame;
  }
  for (const char* const how : {"--threads 1", "--threads 2", "--threads 4 --parallel-frames auto"}) {
    ShellWorks(std::string("tool ") + how +
               " --stream:input=rgb24:size=31x19 - --saturate 1.3 --blur 5x5 -o - < in.raw > out.raw");
    EXPECT_TRUE(Bytes("out.raw") == wanted) << how;
  }
  ShellWorks("tool --stream:output=rgb24 in.#.png --saturate 1.3 --blur 5x5 -o - > out.raw");
  EXPECT_TRUE(Bytes("out.raw") == wanted);
  ShellWorks("tool --stream:input=rgb24:size=31x19 - --saturate 1.3 --blur 5x5 -o again.%02d.png < in.raw");
  for (int k = 1; k <= count; ++k) {
    const std::string n = std::to_string(k);
    EXPECT_EQ(Oiiotool("again.0" + n + ".png out.000" + n + ".png --fail 0 --diff").exit_code, 0);
  }
}

TEST_F(FrameStreamTest, FramesHaveNumbersAndMayBeReadTwice) {
  const io::PixelFormat& f = *io::FindPixelFormat("grayf32le");
  Keep("in.raw", RawFrames(f, 4, 3, 3));
  ShellWorks(
      "tool --stream:input=grayf32le:size=4x3 - - --sub --addc {FRAME_NUMBER} -o - < in.raw > out.raw");
  const std::string out = Bytes("out.raw");
  ASSERT_EQ(out.size(), 3 * 12 * sizeof(float));
  for (size_t i = 0; i < 36; ++i) {
    float value = 0;
    std::memcpy(&value, out.data() + i * sizeof value, sizeof value);
    EXPECT_EQ(value, static_cast<float>(i / 12 + 1));
  }
}

TEST_F(FrameStreamTest, AlphaIsStraightInFrames) {
  Keep("in.raw", std::string("\x80\x40\x20\x80\xff\x00\x00\x00", 8));
  ShellWorks("tool --stream:input=rgba:size=2x1:output=rgbaf32le - -o - < in.raw > out.raw");
  ShellWorks(
      "tool --stream:input=rgba:size=2x1:output=rgbaf32le:alpha=premultiplied - -o - < in.raw > pre.raw");
  std::array<float, 8> v{}, p{};
  ASSERT_EQ(Bytes("out.raw").size(), sizeof v);
  std::memcpy(v.data(), Bytes("out.raw").data(), sizeof v);
  std::memcpy(p.data(), Bytes("pre.raw").data(), sizeof p);
  EXPECT_NEAR(v[0], 128 / 255.0, 1e-6);
  EXPECT_EQ(v[4], 0);  // what has no alpha has no colour
  EXPECT_EQ(p[4], 1);
  ShellWorks("tool --stream:input=rgba:size=2x1 - --ch R,G,B -o - < in.raw > out.raw");
  EXPECT_EQ(Bytes("out.raw")[7], '\xff');  // three channels are opaque
}

// What a line holds does not grow with the stream.
TEST_F(FrameStreamTest, MemoryIsConstant) {
  if (kAddressSanitized) GTEST_SKIP() << "what is freed is kept for a while";
  const CommandResult result = Shell(
      "(echo 'YUV4MPEG2 W640 H480 C420jpeg'; for i in {1..120}; do echo FRAME; head -c 460800 /dev/zero; done) |"
      "tool --stream - --saturate 1.2 --blur 5x5 -o - --runstats | wc -c");
  const long header = std::stol(result.out) - 120 * (460800 + 6);
  EXPECT_GT(header, 60) << result.out;
  EXPECT_LT(header, 100) << result.out;
  std::vector<double> peaks;
  for (size_t at = 0; (at = result.err.find("peak memory ", at)) != std::string::npos; ++at)
    peaks.push_back(std::stod(result.err.substr(at + 12)));
  ASSERT_EQ(peaks.size(), 120U) << result.err.substr(0, 1000);
  EXPECT_LT(peaks[119], peaks[9] + 8);
}

TEST_F(FrameStreamTest, WhatIsWrongWithAStreamIsTold) {
  const std::string stream = Y4m("C420jpeg", 8, 6, 3);
  const auto refusal = [&](const std::string& bytes, const std::string& line) {
    Keep("in.y4m", bytes);
    const CommandResult result = Shell("tool " + line + " < in.y4m > out.y4m");
    EXPECT_EQ(result.exit_code, 1) << line << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    return result.err;
  };
  const auto holds = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const std::string kPass = "--stream - -o -";
  holds(refusal(stream.substr(0, stream.size() - 5), kPass), "after 67 of the 72 bytes of frame 3");
  EXPECT_EQ(Behind(Bytes("out.y4m")).size(), 2 * (72U + 6));  // those before it are there
  holds(refusal("", kPass), "found nothing");
  holds(refusal("YUV4MPEG2 W8 H6\n", kPass), "found no frame");
  holds(refusal("YUV4MPEG2 W8 H6\nFRAME\n", kPass), "behind the header of frame 1");
  holds(refusal("RIFF1234", kPass), "expected one that begins with YUV4MPEG2");
  holds(refusal(std::string(9000, 'x'), kPass), "no end of the header");
  holds(refusal("YUV4MPEG2 W8 H6 C411\nFRAME\n", kPass), "found the colour space C411");
  holds(refusal("YUV4MPEG2 W8 H6 It C420mpeg2\nFRAME\n", kPass), "interlaced");
  holds(refusal(stream + Y4m("C420jpeg", 16, 6, 1), kPass), "another header");
  holds(refusal(stream + "trash\n", kPass), "found no FRAME where frame 4");
  holds(refusal(stream, "--stream - --resize {7+FRAME_NUMBER}x6 -o -"),
        "found a result of 9 x 6 pixels as frame 2");
  holds(refusal(stream, "--stream - --ch R,G -o -"), "expected three, R, G and B");
  holds(refusal(stream, "--stream:output=gray - -o -"), "found the channels R, G, B, expected one");
  holds(refusal(stream, "--stream - -d uint8 -o -"), "expected it in the stream's format");
  holds(refusal(stream, "--limit frames=2 --stream - -o -"), "over the limit frames=2");
  holds(refusal("YUV4MPEG2 W60000 H60000\n", "--limit pixels=1000 --stream - -o -"), "limit");
  holds(refusal("12345", "--stream:input=rgb24:size=8x6 - -o -"), "after 5 of the 144 bytes of frame 1");
}

TEST_F(FrameStreamTest, WhatIsWrongWithALineIsTold) {
  MakePicture("a.png", 8, 6, 3, OIIO::TypeUInt8);
  for (const auto& [line, part] : {std::pair{"--stream a.png -o b.png", "neither - nor -o -"},
                                   {"--stream - -o - --flip -o -", "written twice"},
                                   {"--stream:input=nv12:size=8x6 - -o -", "found input=nv12, expected y4m"},
                                   {"--stream:input=rgb24 - -o -", "found size=, expected WxH"},
                                   {"--stream:input=rgb24:size=8 - -o -", "found size=8, expected WxH"},
                                   {"--stream:size=8x6 - -o -", "beside input=FORMAT"},
                                   {"--stream:output=C411 - -o -", "found output=C411"},
                                   {"--stream:rate=fast - -o -", "found rate=fast"},
                                   {"--stream:rate=24/0 - -o -", "found rate=24/0"},
                                   {"--stream:matrix=bt601x - -o -", "matrix"},
                                   {"--stream --frames 1-3 - -o -", "--frames beside -"},
                                   {"--stream --resume - -o -", "--resume"},
                                   {"--stream --safe - -o -", "--safe"},
                                   {"--stream --verify - -o -", "--verify beside -o -"},
                                   {"--stream --info - -o -", "--info"}}) {
    const CommandResult result = Shell(std::string("tool ") + line + " < /dev/null");
    EXPECT_EQ(result.exit_code, 2) << line << result.err;
    EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
  }
  EXPECT_NE(Shell("echo '--stream - -o -' | tool --batch").out.find("in a job"), std::string::npos);
}

// Who reads goes after a frame.
TEST_F(FrameStreamTest, AReaderThatHasGoneIsTold) {
  Keep("in.y4m", Y4m("C444", 640, 480, 4));
  const CommandResult result =
      Shell("tool --stream - -o - < in.y4m 2> err | head -c 100 > /dev/null; echo ${PIPESTATUS[0]}");
  EXPECT_EQ(result.out, "1\n");
  EXPECT_NE(Bytes("err").find("nobody reads it any more"), std::string::npos) << Bytes("err");
}

TEST_F(FrameStreamTest, WhatIsPrintedGoesElsewhere) {
  const std::string in = Y4m("C444", 8, 6, 2);
  Keep("in.y4m", in);
  const CommandResult result = Shell("tool --stream - --printstats -o - < in.y4m > out.y4m");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.err.find("Stats Min"), std::string::npos) << result.err;
  EXPECT_TRUE(Behind(Bytes("out.y4m")) == Behind(in));
  const CommandResult bar = Shell("tool --stream --progress - -o - < in.y4m 2>&1 > out.y4m");
  EXPECT_NE(bar.out.find("100% 2 frames in"), std::string::npos) << bar.out;
  const CommandResult plan = Shell("tool --stream --explain - --flip -o - < in.y4m 2>&1 > out.y4m");
  EXPECT_NE(plan.out.find("-:\n"), std::string::npos) << plan.out;
  EXPECT_EQ(Bytes("out.y4m"), "");
}

// The pipe that it is for, with the hashes that FFmpeg itself takes of its frames.
TEST_F(FrameStreamTest, BetweenTwoFfmpegs) {
  if (std::system("ffmpeg -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "no ffmpeg";
  const std::string quiet = "ffmpeg -loglevel error -y ",
                    source = "-f lavfi -i testsrc2=size=320x180:rate=25:duration=0.4 ";
  for (const char* const format :
       {"yuv420p", "yuv422p", "yuv444p", "yuv420p10le", "yuv444p12le", "gray", "gray16le"}) {
    const std::string y4m = std::string("-pix_fmt ") + format + " -strict -1 -f yuv4mpegpipe ";
    ShellWorks("set -o pipefail; " + quiet + source + y4m + "- | tee in.y4m | tool --stream - -o - | " +
               quiet + "-i - -f framemd5 out.md5 && " + quiet + "-i in.y4m -f framemd5 in.md5");
    EXPECT_EQ(Bytes("out.md5"), Bytes("in.md5")) << format;
    EXPECT_GT(Bytes("out.md5").size(), 600U);
  }
  // Its own conversion to R'G'B' rounds in between.
  ShellWorks(quiet + source + "-pix_fmt yuv444p -f yuv4mpegpipe in.y4m && " + quiet +
             "-i in.y4m -sws_flags accurate_rnd+full_chroma_int -pix_fmt rgb24 -f rawvideo theirs.raw");
  ShellWorks("tool --stream:output=rgb24 - -o - < in.y4m > ours.raw");
  const std::string ours = Bytes("ours.raw"), theirs = Bytes("theirs.raw");
  ASSERT_EQ(ours.size(), theirs.size());
  int largest = 0;
  for (size_t i = 0; i < ours.size(); ++i)
    largest = std::max(largest,
                       std::abs(int(static_cast<uint8_t>(ours[i])) - int(static_cast<uint8_t>(theirs[i]))));
  EXPECT_LE(largest, 1);
}

}  // namespace
}  // namespace tessera::testing
