// Our codecs of EXR and TIFF beside OpenImageIO's: same pixels, same metadata, in both directions; the same
// refusals.
#include "codec_files.h"

namespace tessera {
namespace {

using namespace testing_io;
using ::testing::HasSubstr;

TEST_F(CodecTest, ExrIsTheSameBothWays) {
  for (const char* compression : {"none", "zip", "zips", "zip:9"}) {
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
      for (int channels = 1; channels <= 5; ++channels) {
        for (const auto& [width, height] : {std::pair{1, 1}, {1, 37}, {53, 1}, {67, 45}}) {
          SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height) + "x" + std::to_string(channels) +
                       " " + PixelTypeName(type) + " " + compression);
          Image image = Picture(width, height, channels, type);
          Vary(image);
          ExpectSame(image, ".exr", {Text("compression", compression), kDate});
        }
      }
    }
  }
}

TEST_F(CodecTest, ExrsOfEveryCompressionAreTheSameBothWays) {
  for (const char* compression : {"rle", "piz", "pxr24", "b44", "b44a", "dwaa", "dwaa:200", "dwab"}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {300, 301}, {67, 45}}) {
      for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        SCOPED_TRACE(std::to_string(width) + " " + PixelTypeName(type) + " " + compression);
        Image image = Picture(width, height, 4, type);
        Vary(image);
        ExpectSame(image, ".exr", {Text("compression", compression), kDate});
        EXPECT_EQ(Contents(Path("ours.exr")), Contents(Path("theirs.exr"))) << "OpenEXR packs both";
      }
    }
  }
}

TEST_F(CodecTest, ExrWindowsNamesAndMetadataAreTheSameBothWays) {
  ImageSpec spec(60, 40, 3, PixelType::kHalf);
  spec.data_window = {-10, -12, 50, 33};
  spec.display_window = {5, 6, 65, 46};
  spec.channels = {"beauty.R", std::string(200, 'n'), "a"};
  ExpectSame(Pattern(spec), ".exr",
             {kDate, Text("Long name of an attribute, of more than thirty-one bytes", std::string(3000, 'v')),
              Text("compression", "zips"), Number("some number", 7)});
}

TEST_F(CodecTest, ExrIsTheSameForAnyThreads) {
  Image image = Picture(300, 1000, 3, PixelType::kHalf);
  Vary(image);
  for (const char* compression : {"zip", "zips", "none", "rle", "piz", "dwab"}) {
    std::string bytes;
    for (const int threads : {1, 2, 5}) {
      for (const int rows : {0, 3, 512}) {
        WriteOptions options;
        options.render.threads = threads;
        options.render.tile_height = rows;
        options.attributes = {kDate, Text("compression", compression)};
        Write(FromImage(image), Path("a.exr"), options);
        if (bytes.empty()) bytes = Contents(Path("a.exr"));
        EXPECT_EQ(Contents(Path("a.exr")), bytes) << threads << " threads, bands of " << rows;
      }
    }
  }
}

TEST_F(CodecTest, PartsOfAnExrAreReadTheSame) {
  std::vector<OIIO::ImageSpec> parts;
  for (int i = 0; i < 3; ++i) {
    parts.emplace_back(50 + i, 40, 3, i == 1 ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::HALF);
    parts.back().full_width = 60;
    parts.back().attribute("name", "part" + std::to_string(i));
    parts.back().attribute("compression", i == 2 ? "piz" : "zip");
  }
  WritePattern(Path("a.exr"), parts);
  for (int i = 0; i < 3; ++i) ExpectReadTheSame(Path("a.exr"), i);
}

// Of types that Write does not have.
void WriteFloats(const std::string& file, const OIIO::ImageSpec& spec) {
  const auto output = OIIO::ImageOutput::create(file);
  std::vector<float> pixels(spec.image_pixels() * static_cast<size_t>(spec.nchannels));
  for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<float>(i * 7 % 1013) / 1013;
  ASSERT_TRUE(output->open(file, spec) && output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) &&
              output->close())
      << output->geterror();
}

// Tiles, channels of several types, types that are none of ours.
TEST_F(CodecTest, ExrsThatOpenImageIOReadsOnEveryCoreAreTheSame) {
  OIIO::ImageSpec tiled(164, 131, 3, OIIO::TypeDesc::HALF), mixed = tiled,
                                                            whole(164, 131, 2, OIIO::TypeDesc::UINT);
  tiled.x = -20, tiled.y = -30;
  mixed.channelformats = {OIIO::TypeDesc::HALF, OIIO::TypeDesc::UINT, OIIO::TypeDesc::FLOAT};
  for (const char* compression : {"zip", "none", "piz", "rle", "dwaa"}) {
    SCOPED_TRACE(compression);
    for (OIIO::ImageSpec* spec : {&tiled, &mixed, &whole}) {
      spec->attribute("compression", compression);
      for (const auto& [width, height] : {std::pair{0, 0}, {32, 32}, {16, 48}, {200, 200}}) {
        spec->tile_width = width, spec->tile_height = height;
        WriteFloats(Path("a.exr"), *spec);
        ExpectReadTheSame(Path("a.exr"));
      }
    }
  }
  const Node node = Read(Path("a.exr"));
  EXPECT_EQ(SourceOf(node).Decoder(), "the codec openexr (OpenImageIO on every core)");
  EXPECT_THAT(HowWritten(node, Path("b.exr"), {}), HasSubstr("OpenImageIO (tiles)"));
}

// A file may be another when the workers open it.
TEST_F(CodecTest, AnExrThatChangesIsSaid) {
  OIIO::ImageSpec spec(164, 131, 3, OIIO::TypeDesc::HALF);
  spec.attribute("compression", "piz");
  WritePattern(Path("a.exr"), {spec});
  const Node node = Read(Path("a.exr"));
  const auto reader = SourceOf(node).Open(0, 3);
  spec.height = 130;
  WritePattern(Path("a.exr"), {spec});
  Image image(node.spec());
  EXPECT_THAT(ErrorOf([&] { reader->Read(image.view()); }),
              HasSubstr(Path("a.exr") + ": the file changed after its header was read"));
}

TEST_F(CodecTest, DamagedExrsAreRefusedAsBefore) {
  for (const char* compression : {"none", "zip", "zips", "piz", "rle", "pxr24", "b44", "dwaa"}) {
    SCOPED_TRACE(compression);
    Image image = Picture(61, 47, 3, PixelType::kHalf);
    Vary(image);
    WriteOptions options;
    options.attributes = {Text("compression", compression)};
    Write(FromImage(image), Path("good.exr"), options);
    const std::string name = compression;
    ExpectSameRefusals(Path("good.exr"), 100, name == "none" || name == "zip" || name == "zips");
  }
}

TEST_F(CodecTest, TiffIsTheSameBothWays) {
  for (const char* compression : {"none", "zip", "zip:9"}) {
    for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kFloat}) {
      for (int channels = 1; channels <= 5; ++channels) {
        for (const auto& [width, height] : {std::pair{1, 1}, {1, 37}, {53, 1}, {67, 95}}) {
          SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height) + "x" + std::to_string(channels) +
                       " " + PixelTypeName(type) + " " + compression);
          ExpectSame(Picture(width, height, channels, type), ".tif",
                     {Text("compression", compression), kDate});
        }
      }
    }
  }
}

TEST_F(CodecTest, TiffWindowsAndMetadataAreTheSameBothWays) {
  ImageSpec spec(60, 40, 3, PixelType::kUint16);
  spec.data_window = {10, 12, 50, 33};
  spec.display_window = {0, 0, 65, 46};
  ExpectSame(Pattern(spec), ".tif",
             {kDate, Text("ImageDescription", std::string(3000, 'v')), Text("oiio:ColorSpace", "sRGB"),
              Text("Exif:UserComment", "a comment"), Number("Orientation", 3)});
  for (const int rows : {1, 7, 1000})
    ExpectSame(Pattern(spec), ".tif", {kDate, Number("tiff:RowsPerStrip", rows)});
  spec.type = PixelType::kHalf;
  ExpectSame(Pattern(spec), ".tif", {kDate, Number("tiff:half", 1)});
}

TEST_F(CodecTest, TiffIsTheSameForAnyThreads) {
  const Image image = Picture(300, 1000, 3, PixelType::kUint16);
  std::string bytes;
  for (const int threads : {1, 2, 5}) {
    for (const int rows : {0, 3, 512}) {
      WriteOptions options;
      options.render.threads = threads;
      options.render.tile_height = rows;
      options.attributes = {kDate};
      Write(FromImage(image), Path("a.tif"), options);
      if (bytes.empty()) bytes = Contents(Path("a.tif"));
      EXPECT_EQ(Contents(Path("a.tif")), bytes) << threads << " threads, bands of " << rows;
    }
  }
}

TEST_F(CodecTest, WhatTiffLeavesToOpenImageIOIsSaid) {
  const Node node = FromImage(Picture(20, 40, 4, PixelType::kUint8));
  const auto reason = [&](const Attribute& attribute) {
    WriteOptions options;
    options.attributes = {attribute};
    const std::string how = HowWritten(node, Path("a.tif"), options);
    return how.substr(how.find(" encoded by ") + 12) + ", " + SourceOf(Read(Path("a.tif"))).Decoder();
  };
  EXPECT_EQ(reason(Text("compression", "lzw")),
            "OpenImageIO (the compression lzw is libtiff's), the codec tiff (libtiff on every core)");
  EXPECT_EQ(reason(Text("planarconfig", "separate")),
            "OpenImageIO (planes of channels), OpenImageIO (planes of channels)");
  EXPECT_EQ(reason(Number("oiio:UnassociatedAlpha", 1)),
            "the codec tiff, OpenImageIO (alpha that is multiplied in)");
  EXPECT_EQ(reason(Number("tiff:bigtiff", 1)), "OpenImageIO (offsets of 64 bits), the codec tiff");
  EXPECT_EQ(reason(Number("oiio:BitsPerSample", 4)),
            "OpenImageIO (samples of another size), OpenImageIO (samples of 4 bits)");
}

// Written by OpenImageIO in strips and tiles of many shapes, and with the high byte first.
TEST_F(CodecTest, TiffsOfOthersAreReadTheSame) {
  for (const char* compression : {"lzw", "zip", "none"}) {
    for (const OIIO::TypeDesc type : {OIIO::TypeDesc::UINT8, OIIO::TypeDesc::UINT16, OIIO::TypeDesc::FLOAT}) {
      for (const auto& [width, height] :
           {std::pair{0, 1}, {0, 7}, {0, 500}, {32, 32}, {16, 48}, {208, 208}}) {
        for (const bool big : {false, true}) {
          SCOPED_TRACE(std::string(compression) + " " + type.c_str() + " " + std::to_string(width) + "x" +
                       std::to_string(height) + (big ? " the high byte first" : ""));
          OIIO::ImageSpec spec(165, 131, 3, type);
          spec.tile_width = width, spec.tile_height = width > 0 ? height : 0;
          if (width == 0) spec.attribute("tiff:RowsPerStrip", height);
          spec.attribute("compression", compression);
          if (big) spec.attribute("oiio:Endian", "big");
          WritePattern(Path("a.tif"), {spec});
          ExpectReadTheSame(Path("a.tif"));
        }
      }
    }
  }
}

TEST_F(CodecTest, DamagedTiffsAreRefusedAsBefore) {
  for (const char* compression : {"none", "zip", "lzw", "packbits"}) {
    for (const int tile : {0, 32}) {
      SCOPED_TRACE(compression + std::string(tile > 0 ? " in tiles" : ""));
      WriteOptions options;
      options.attributes = {Text("compression", compression), Number("tile_width", tile),
                            Number("tile_height", tile)};
      Write(FromImage(Picture(61, 95, 3, PixelType::kUint16)), Path("good.tif"), options);
      // What OpenImageIO makes of a tile that unpacks to another size differs from run to run.
      ExpectSameRefusals(Path("good.tif"), 100, tile == 0);
    }
  }
}

}  // namespace
}  // namespace tessera
