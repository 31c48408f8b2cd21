// Our codecs beside OpenImageIO's: same pixels, same metadata, in both directions; the same refusals. PNG,
// and what holds for all.
#include "io/codec/codec.h"

#include <sys/resource.h>

#include <csignal>
#include <cstdlib>

#include "codec_files.h"
#include "io/codec/deflate.h"
#include "io/codec/png_chunks.h"

namespace tessera {
namespace {

using namespace testing_io;
using ::testing::HasSubstr;

TEST_F(CodecTest, PngIsTheSameBothWays) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16}) {
    for (int channels = 1; channels <= 4; ++channels) {
      for (const auto& [width, height] : {std::pair{1, 1}, {1, 37}, {53, 1}, {67, 45}}) {
        SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height) + "x" + std::to_string(channels) +
                     " " + PixelTypeName(type));
        ExpectSame(Picture(width, height, channels, type), ".png");
      }
    }
  }
}

TEST_F(CodecTest, PngOfSeveralSegmentsIsTheSameBothWaysAndForAnyThreads) {
  const Image image = Picture(1500, 1400, 3, PixelType::kUint8);
  ExpectSame(image, ".png");
  std::string bytes;
  for (const int threads : {1, 2, 5}) {
    for (const int rows : {0, 3, 512}) {
      WriteOptions options;
      options.render.threads = threads;
      options.render.tile_height = rows;
      Write(FromImage(image), Path("a.png"), options);
      if (bytes.empty()) bytes = Contents(Path("a.png"));
      EXPECT_EQ(Contents(Path("a.png")), bytes) << threads << " threads, bands of " << rows;
    }
  }
}

TEST_F(CodecTest, PngKeepsMetadata) {
  Image image = Picture(40, 30, 4, PixelType::kUint8);
  ExpectSame(image, ".png",
             {Text("ImageDescription", "a picture"), Text("Artist", "somebody"),
              Text("DateTime", "2020:02:03 04:05:06"),
              Text("Very long name " + std::string(50, 'x'), std::string(9000, 'y')),
              Number("png:compressionLevel", 9)});
  ExpectSame(Picture(40, 30, 4, PixelType::kUint16), ".png", {Number("oiio:UnassociatedAlpha", 1)});
}

TEST_F(CodecTest, PngOffTheOriginIsTheSameBothWays) {
  ImageSpec spec(60, 40, 3, PixelType::kUint8);
  spec.data_window = {10, 12, 50, 33};
  spec.display_window = {0, 0, 60, 40};
  ExpectSame(Pattern(spec), ".png");
}

TEST_F(CodecTest, WhatPngLeavesToOpenImageIOIsSaid) {
  const Node node = FromImage(Picture(20, 20, 4, PixelType::kUint8));
  const auto reason = [&](const std::vector<Attribute>& attributes) {
    WriteOptions options;
    options.attributes = attributes;
    return HowWritten(node, Path("a.png"), options);
  };
  EXPECT_THAT(reason({Text("compression", "huffman")}),
              HasSubstr("OpenImageIO (the compression huffman is zlib's)"));
  EXPECT_THAT(reason({Number("png:filter", 8)}), HasSubstr("OpenImageIO (png:filter is libpng's)"));
  EXPECT_THAT(reason({Text("oiio:ColorSpace", "Gamma2.2")}),
              HasSubstr("OpenImageIO (alpha of a file with a gamma"));
  EXPECT_THAT(SourceOf(Read(Path("a.png"))).Decoder(),
              HasSubstr("OpenImageIO (alpha of a file with a gamma"));
}

// A picture of 4 x 1 pixels; `middle` stands between its header and its pixels.
std::string HandMadePng(int depth, int color, bool interlaced, const std::string& middle,
                        const std::string& row) {
  std::string file(std::begin(io::kPngSignature), std::end(io::kPngSignature));
  const auto put = [&](const std::string& name, const std::string& bytes) {
    uint8_t number[4];
    const std::string named = name + bytes;
    io::SetBigEndian32(number, static_cast<uint32_t>(bytes.size()));
    file.append(number, number + 4).append(named);
    io::SetBigEndian32(number, io::Crc32(0, {reinterpret_cast<const uint8_t*>(named.data()), named.size()}));
    file.append(number, number + 4);
  };
  put("IHDR", std::string("\0\0\0\4\0\0\0\1", 8) + static_cast<char>(depth) + static_cast<char>(color) +
                  std::string(2, '\0') + static_cast<char>(interlaced));
  if (!middle.empty()) put(middle.substr(0, 4), middle.substr(4));
  base::Bytes stream;
  io::Deflater(6).Zlib({reinterpret_cast<const uint8_t*>(row.data()), row.size()}, stream);
  put("IDAT", std::string(stream.begin(), stream.end()));
  put("IEND", "");
  return file;
}

TEST_F(CodecTest, RarePngsAreLeftToOpenImageIO) {
  const struct {
    const char* reason;
    std::string file;
  } kRare[] = {
      {"a palette", HandMadePng(8, 3, false, "PLTEabcdef", std::string("\0\1\0\1\0", 5))},
      {"a transparent colour",
       HandMadePng(8, 0, false, std::string("tRNS\0\7", 6), std::string("\0\7\6\7\5", 5))},
      {"samples of 1 bits", HandMadePng(1, 0, false, "", std::string("\0\xA0", 2))},
  };
  for (const auto& rare : kRare) {
    SetContents(Path("a.png"), rare.file);
    const Node node = Read(Path("a.png"));
    EXPECT_EQ(SourceOf(node).Decoder(), std::string("OpenImageIO (") + rare.reason + ")");
    EXPECT_EQ(
        PixelsOf(node, 0, node.spec().channel_count(), 1),
        PixelsOf(Read(Path("a.png"), {.codec = Codec::kOpenImageIO}), 0, node.spec().channel_count(), 1));
  }
}

TEST_F(CodecTest, DamagedPngsAreRefusedAsBefore) {
  Write(FromImage(Picture(61, 47, 3, PixelType::kUint8)), Path("good.png"));
  ExpectSameRefusals(Path("good.png"), 400);
}

TEST_F(CodecTest, WhatIsGivenUpIsSaid) {
  Write(FromImage(Picture(400, 300, 3, PixelType::kUint8)), Path("a.png"));
  const Node node = Read(Path("a.png"));
  const auto decoder = [&](size_t budget) {
    RunStats stats;
    Render(node, PixelType::kUint8, {.memory_budget = budget}, &stats);
    return stats.files.at(0);
  };
  EXPECT_EQ(decoder(size_t{1} << 24), Path("a.png") + " decoded by the codec png");
  EXPECT_EQ(decoder(size_t{1} << 20),
            Path("a.png") + " decoded by OpenImageIO (its pixels take more memory than is allowed)");
}

// Programs of other libraries' making, where they are installed.
TEST_F(CodecTest, OthersReadWhatIsWritten) {
  const struct {
    const char *program, *arguments, *extension;
  } kReaders[] = {{"pngcheck", "-q", ".png"}, {"tiffinfo", "-d", ".tif"}, {"exrinfo", "-s", ".exr"}};
  for (const auto& reader : kReaders) {
    if (std::system((std::string("command -v ") + reader.program + " >/dev/null").c_str()) != 0) continue;
    for (const PixelType type :
         {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
      for (const int channels : {1, 3, 4}) {
        const std::string file = Path(std::string("a") + reader.extension);
        EXPECT_TRUE(IsOurs(HowWritten(FromImage(Picture(700, 801, channels, type)), file, {.type = type})) ||
                    reader.extension == std::string(".exr"));
        const std::string said = Path("said.txt");
        const std::string line =
            std::string(reader.program) + " " + reader.arguments + " " + file + " >/dev/null 2>" + said;
        EXPECT_EQ(std::system(line.c_str()), 0) << line;
        EXPECT_EQ(Contents(said), "") << reader.program;
      }
    }
  }
}

// The size of a file that this process may write ends before the picture does.
TEST_F(CodecTest, AFullDiskLeavesNothing) {
  const Node node = FromImage(Picture(700, 500, 3, PixelType::kUint16));
  for (const char* extension : {".png", ".exr", ".tif"}) {
    const std::string file = Path(std::string("a") + extension);
    Write(node, file);
    const std::string before = Contents(file);
    const auto old_action = std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
    for (const double share : {0.0, 0.3, 0.999}) {
      rlimit little = old;
      little.rlim_cur = static_cast<rlim_t>(share * static_cast<double>(before.size()));
      ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
      const std::string error = ErrorOf([&] { Write(node, file); });
      ::setrlimit(RLIMIT_FSIZE, &old);
      EXPECT_THAT(error, HasSubstr(file + ": cannot be written"));
      EXPECT_EQ(Names().size(), 1u);
      EXPECT_EQ(Contents(file), before);
    }
    std::signal(SIGXFSZ, old_action);
    std::filesystem::remove(file);
  }
}

}  // namespace
}  // namespace tessera
