// Rows into files: bits, types, windows, tiles and metadata come back; a file appears whole or not at all.
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "files.h"

namespace tessera {
namespace {

using namespace testing_io;
using OIIO::TypeDesc;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

Attribute Int(const std::string& name, int value) {
  Attribute a{name, "int", std::vector<std::byte>(4), {}};
  std::memcpy(a.bytes.data(), &value, 4);
  return a;
}
Attribute Text(const std::string& name, const std::string& value) { return {name, "string", {}, {value}}; }

ImageSpec Spec(int width, int height, int channels, PixelType type) {
  ImageSpec spec(width, height, channels, type);
  if (channels == 4) spec.alpha = 3;
  return spec;
}

struct Format {
  const char* file;
  PixelType type;
  int channels;
  int tile = 0;
};
void PrintTo(const Format& f, std::ostream* out) {
  *out << f.file << " " << PixelTypeName(f.type) << " " << f.channels << " tile " << f.tile;
}
class WriteFormat : public FileTest, public ::testing::WithParamInterface<Format> {};

TEST_P(WriteFormat, RoundTripKeepsEveryBit) {
  const Format f = GetParam();
  const Image image = Pattern(Spec(67, 45, f.channels, f.type));
  for (const int band : {0, 1, 7, 32}) {
    WriteOptions options;
    options.render.tile_height = band;
    if (f.tile > 0) options.attributes = {Int("tile_width", f.tile), Int("tile_height", f.tile)};
    Write(FromImage(image), Path(f.file), options);
    EXPECT_THAT(Names(), ElementsAre(f.file));
    const Node node = Read(Path(f.file));
    ASSERT_EQ(node.spec().type, f.type);
    ASSERT_EQ(node.spec().data_window, image.spec().data_window);
    EXPECT_EQ(SourceOf(node).RowGranularity() % std::max(f.tile, 1), 0);
    ConstImageView view;
    const auto keep = ReadRows(node, 0, f.channels, 45, &view);
    EXPECT_EQ(Wrong(view), 0) << "bands of " << band;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, WriteFormat,
    ::testing::Values(Format{"a.exr", PixelType::kHalf, 4}, Format{"a.exr", PixelType::kFloat, 4},
                      Format{"a.exr", PixelType::kFloat, 7}, Format{"a.exr", PixelType::kHalf, 3, 16},
                      Format{"a.exr", PixelType::kFloat, 4, 32}, Format{"a.tif", PixelType::kUint8, 3},
                      Format{"a.tif", PixelType::kUint16, 3}, Format{"a.tif", PixelType::kFloat, 4},
                      Format{"a.tif", PixelType::kUint16, 3, 16}, Format{"a.png", PixelType::kUint8, 3},
                      Format{"a.png", PixelType::kUint16, 3}, Format{"a.png", PixelType::kUint8, 1},
                      Format{"a.tga", PixelType::kUint8, 3}, Format{"a.bmp", PixelType::kUint8, 3},
                      Format{"a.sgi", PixelType::kUint16, 3}, Format{"a.dpx", PixelType::kUint16, 3},
                      Format{"a.ppm", PixelType::kUint8, 3}));

class WriteTest : public FileTest {
 protected:
  Node Picture(PixelType type = PixelType::kFloat, int channels = 3) {
    return FromImage(Pattern(Spec(67, 45, channels, type)));
  }
  // A picture whose compressed file is far larger than any buffer on the way: bits without a pattern.
  Node Noise() {
    const Image image(Spec(600, 500, 3, PixelType::kUint8));
    uint32_t state = 1;
    for (int y = 0; y < 500; ++y) {
      for (int x = 0; x < 600; ++x) {
        for (int c = 0; c < 3; ++c)
          image.at<uint8_t>(x, y, c) = static_cast<uint8_t>((state = state * 1664525u + 1013904223u) >> 24);
      }
    }
    return FromImage(image);
  }
};

TEST_F(WriteTest, OffsetWindowsSurviveInExr) {
  ImageSpec spec(30, 20, 3, PixelType::kHalf);
  spec.data_window = {-7, 5, 23, 25};
  spec.display_window = {-10, -10, 100, 90};
  Write(FromImage(Pattern(spec)), Path("a.exr"));
  const Node node = Read(Path("a.exr"));
  EXPECT_EQ(node.spec().data_window, spec.data_window);
  EXPECT_EQ(node.spec().display_window, spec.display_window);
  ConstImageView view;
  const auto keep = ReadRows(node, 0, 3, 20, &view);
  EXPECT_EQ(Wrong(view), 0);
}

TEST_F(WriteTest, FormatsWithoutDisplayWindowGetItsPixels) {
  ImageSpec spec(30, 20, 3, PixelType::kUint8);
  spec.data_window = {-7, 5, 23, 25};    // sticks out on the left
  spec.display_window = {0, 0, 40, 48};  // bands of padding above, right and below
  for (const char* name : {"a.png", "a.tif", "a.bmp"}) {
    Write(FromImage(Pattern(spec)), Path(name));
    const Node node = Read(Path(name));
    EXPECT_EQ(node.spec().data_window, spec.display_window) << name;
    ConstImageView view;
    const auto keep = ReadRows(node, 0, 3, 48, &view);
    EXPECT_EQ(Wrong(view.Sub({0, 5, 23, 25})), 0) << name;
    int64_t lit = 0;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 40; ++x) {
        if (y < 5 || y >= 25 || x >= 23) lit += *view.At(x, y, 0) != std::byte{0};
      }
    }
    EXPECT_EQ(lit, 0) << name;
  }
}

TEST_F(WriteTest, MetadataComesBackByteForByte) {
  OIIO::ImageSpec spec(8, 8, 3, TypeDesc::HALF);
  spec.attribute("Artist", "someone");
  spec.attribute("worldToCamera", TypeDesc(TypeDesc::FLOAT, TypeDesc::MATRIX44),
                 std::vector<float>(16, 0.1f).data());
  spec.attribute("smpte:TimeCode", OIIO::TypeTimeCode, std::vector<uint32_t>{0x01020304u, 7u}.data());
  spec.attribute("smpte:KeyCode", OIIO::TypeKeyCode, std::vector<int>{1, 2, 3, 4, 5, 4, 64}.data());
  spec.attribute("captureRate", OIIO::TypeRational, std::vector<int>{24000, 1001}.data());
  spec.attribute("box", OIIO::TypeBox2i, std::vector<int>{1, 2, 3, 4}.data());
  const OIIO::ustring words[] = {OIIO::ustring("one"), OIIO::ustring(""), OIIO::ustring("three\nlines")};
  spec.attribute("words", TypeDesc(TypeDesc::STRING, TypeDesc::SCALAR, TypeDesc::NOSEMANTICS, 3), words);
  spec.attribute("exact", 0.1f);
  spec.attribute("compression", "piz");
  WritePattern(Path("a.exr"), {spec});
  Write(Read(Path("a.exr")), Path("b.exr"));

  const auto first = OIIO::ImageInput::open(Path("a.exr")), second = OIIO::ImageInput::open(Path("b.exr"));
  int compared = 0;
  for (const OIIO::ParamValue& p : first->spec().extra_attribs) {
    const auto* other = second->spec().find_attribute(p.name().string(), p.type());
    ASSERT_TRUE(other) << p.name() << " " << p.type();
    EXPECT_EQ(std::memcmp(p.data(), other->data(), p.datasize()), 0) << p.name();  // strings: unique pointers
    ++compared;
  }
  EXPECT_GE(compared, 9);
}

TEST_F(WriteTest, TypeNamesOfMetadataCanBeReadBack) {
  for (const TypeDesc& type :
       {OIIO::TypeTimeCode, OIIO::TypeKeyCode, OIIO::TypeRational, OIIO::TypeBox2i, OIIO::TypeBox3,
        OIIO::TypeMatrix33, OIIO::TypeMatrix44, OIIO::TypeColor, TypeDesc(TypeDesc::INT, TypeDesc::VEC3),
        TypeDesc(TypeDesc::DOUBLE, TypeDesc::MATRIX44),
        TypeDesc(TypeDesc::INT, TypeDesc::VEC2, TypeDesc::NOXFORM, 3), TypeDesc("uint8[100]")}) {
    EXPECT_EQ(io::ParseType(type.c_str()), type) << type;
  }
}

TEST_F(WriteTest, AttributesAreAddedReplacedAndRemoved) {
  ImageSpec spec(8, 8, 3, PixelType::kHalf);
  spec.metadata = std::make_shared<std::vector<Attribute>>(
      std::vector<Attribute>{Text("Artist", "first"), Text("gone", "x"), Text("compression", "zips")});
  WriteOptions options;
  options.attributes = {Text("Artist", "second"), {"gone", "", {}, {}}, Text("Software", "tessera")};
  Write(FromImage(Pattern(spec)), Path("a.exr"), options);
  const auto input = OIIO::ImageInput::open(Path("a.exr"));
  EXPECT_EQ(input->spec().get_string_attribute("Artist"), "second");
  EXPECT_EQ(input->spec().get_string_attribute("compression"), "zips");
  EXPECT_FALSE(input->spec().find_attribute("gone"));
  EXPECT_EQ(input->spec().get_string_attribute("Software"), "tessera");

  options.attributes = {{"broken", "float[3]", std::vector<std::byte>(4), {}}};
  EXPECT_EQ(ErrorOf([&] { Write(FromImage(Pattern(spec)), Path("b.exr"), options); }),
            "attribute broken: found 4 bytes, expected 12 for type float[3]");
}

TEST_F(WriteTest, ALevelOfAMipMapIsWrittenAsAPlainImage) {
  OIIO::ImageSpec spec(64, 64, 3, TypeDesc::HALF);
  spec.tile_width = spec.tile_height = 16;
  spec.attribute("textureformat", "Plain Texture");
  spec.attribute("openexr:levelmode", 1);
  auto output = OIIO::ImageOutput::create(Path("a.exr"));
  std::vector<std::byte> pixels(spec.image_bytes());
  Fill(ImageView(pixels.data(), {0, 0, 64, 64}, 3, PixelType::kHalf));
  ASSERT_TRUE(output->open(Path("a.exr"), spec)) << output->geterror();
  ASSERT_TRUE(output->write_image(spec.format, pixels.data()));
  for (int size = 32; size >= 1; size /= 2) {
    OIIO::ImageSpec level = spec;
    level.width = level.height = level.full_width = level.full_height = size;
    ASSERT_TRUE(output->open(Path("a.exr"), level, OIIO::ImageOutput::AppendMIPLevel)) << output->geterror();
    ASSERT_TRUE(output->write_image(spec.format, pixels.data())) << output->geterror();
  }
  ASSERT_TRUE(output->close());
  output.reset();  // levels are appended until here
  Write(Read(Path("a.exr")), Path("b.exr"));
  ConstImageView view;
  const auto keep = ReadRows(Read(Path("b.exr")), 0, 3, 64, &view);
  EXPECT_EQ(Wrong(view), 0);
}

TEST_F(WriteTest, TheTypeIsTheOneAskedForOrTheNearestOfTheFormat) {
  const auto written = [&](const char* name, std::optional<PixelType> type) {
    WriteOptions options;
    options.type = type;
    PendingOutput output(Picture(PixelType::kFloat), Path(name), options);
    output.Commit();
    EXPECT_EQ(Read(Path(name)).spec().type, output.type());
    return output.type();
  };
  EXPECT_EQ(written("a.exr", std::nullopt), PixelType::kFloat);
  EXPECT_EQ(written("a.exr", PixelType::kHalf), PixelType::kHalf);
  EXPECT_EQ(written("a.tif", PixelType::kUint16), PixelType::kUint16);
  EXPECT_EQ(written("a.tif", PixelType::kHalf), PixelType::kFloat);
  EXPECT_EQ(written("a.png", std::nullopt), PixelType::kUint8);
  EXPECT_EQ(written("a.png", PixelType::kUint16), PixelType::kUint16);
  EXPECT_EQ(written("a.jpg", std::nullopt), PixelType::kUint8);
}

TEST_F(WriteTest, IntegersAreRoundedOnce) {
  const Image image(Spec(1024, 1, 1, PixelType::kFloat));
  for (int x = 0; x < 1024; ++x) image.at<float>(x, 0) = static_cast<float>(x) / 1023;
  WriteOptions options;
  options.type = PixelType::kUint8;
  Write(FromImage(image), Path("a.png"), options);
  ConstImageView view;
  const auto keep = ReadRows(Read(Path("a.png")), 0, 1, 1, &view);
  for (int x = 0; x < 1024; ++x) {
    EXPECT_EQ(static_cast<int>(*view.At(x, 0)), static_cast<int>(std::lrint(image.at<float>(x, 0) * 255.0)))
        << x;
  }
}

TEST_F(WriteTest, AlphaIsLeftOutWhereTheFormatHasNone) {
  Write(Picture(PixelType::kUint8, 4), Path("a.ppm"));
  const Node node = Read(Path("a.ppm"));
  ASSERT_EQ(node.spec().channel_count(), 3);
  ConstImageView view;
  const auto keep = ReadRows(node, 0, 3, 45, &view);
  EXPECT_EQ(Wrong(view), 0);
  Write(Picture(PixelType::kUint8, 4), Path("a.jpg"));
  EXPECT_EQ(Read(Path("a.jpg")).spec().channel_count(), 3);
}

// Writers of formats whose alpha comes last would divide by it wherever it is.
TEST_F(WriteTest, AlphaThatIsNotLastIsAChannelLikeOthers) {
  ImageSpec spec(9, 5, 3, PixelType::kUint8);
  spec.alpha = 1;
  const Image image = Pattern(spec);
  for (const char* file : {"a.tga", "a.png"}) {
    SCOPED_TRACE(file);
    Write(FromImage(image), Path(file));
    const Image read = Render(Read(Path(file)), PixelType::kUint8);
    for (int x = 0; x < 9; ++x) {
      for (int c = 0; c < 3; ++c)
        EXPECT_EQ(read.at<uint8_t>(x, 2, c), image.at<uint8_t>(x, 2, c)) << x << " " << c;
    }
  }
}

TEST_F(WriteTest, OutputMayBeTheInput) {
  Write(Picture(PixelType::kHalf), Path("a.exr"));
  const Node node = Read(Path("a.exr"));
  Write(node, Path("a.exr"));
  EXPECT_THAT(Names(), ElementsAre("a.exr"));
  ConstImageView view;
  const auto keep = ReadRows(Read(Path("a.exr")), 0, 3, 45, &view);
  EXPECT_EQ(Wrong(view), 0);
}

TEST_F(WriteTest, TheFileAppearsWithCommitAndNotWithout) {
  SetContents(Path("a.png"), "old");
  {
    PendingOutput output(Picture(PixelType::kUint8), Path("a.png"), {});
    EXPECT_EQ(Contents(Path("a.png")), "old");
    EXPECT_EQ(Names().size(), 2u);
  }
  EXPECT_THAT(Names(), ElementsAre("a.png"));
  EXPECT_EQ(Contents(Path("a.png")), "old");
  PendingOutput output(Picture(PixelType::kUint8), Path("a.png"), {});
  PendingOutput moved(std::move(output));
  moved.Commit();
  EXPECT_THAT(Names(), ElementsAre("a.png"));
  EXPECT_EQ(Read(Path("a.png")).spec().width(), 67);
}

TEST_F(WriteTest, UnfinishedOutputsCanBeRemovedAtOnce) {
  PendingOutput one(Picture(), Path("a.exr"), {}), two(Picture(), Path("b.exr"), {});
  EXPECT_EQ(Names().size(), 2u);
  RemoveUnfinishedOutputs();
  EXPECT_THAT(Names(), IsEmpty());
  EXPECT_THAT(ErrorOf([&] { one.Commit(); }), StartsWith(Path("a.exr") + ": cannot be written: "));
}

TEST_F(WriteTest, PermissionsAndLinksOfTheReplacedFileStay) {
  SetContents(Path("real.png"), "old");
  ASSERT_EQ(::chmod(Path("real.png").c_str(), 0640), 0);
  std::filesystem::create_symlink("real.png", Path("link.png"));
  Write(Picture(PixelType::kUint8), Path("link.png"));
  EXPECT_TRUE(std::filesystem::is_symlink(Path("link.png")));
  EXPECT_EQ(Read(Path("real.png")).spec().width(), 67);
  struct stat status;
  ASSERT_EQ(::stat(Path("real.png").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0640u);
}

TEST_F(WriteTest, LongNamesFit) {
  const std::string name = std::string(250, 'n') + ".exr";
  Write(Picture(), Path(name));
  EXPECT_THAT(Names(), ElementsAre(name));
}

TEST_F(WriteTest, WhatCannotBeWrittenIsSaidAndLeavesNothing) {
  std::filesystem::create_directory(Path("directory.exr"));
  const Node rgb = Picture(), five = Picture(PixelType::kFloat, 5), two = Picture(PixelType::kUint8, 2);
  const auto reason = [&](const Node& node, const std::string& file) {
    const std::string text = ErrorOf([&] { Write(node, file); });
    EXPECT_THAT(text, StartsWith(file + ": "));
    EXPECT_THAT(text, ::testing::Not(HasSubstr(".tessera-")));
    return text;
  };
  EXPECT_THAT(reason(rgb, Path("a.xyz")),
              AllOf(HasSubstr("found the extension \".xyz\""), HasSubstr("openexr")));
  EXPECT_THAT(reason(rgb, Path("a")), HasSubstr("found no file extension"));
  EXPECT_THAT(reason(rgb, Path("missing/a.exr")), HasSubstr("no directory " + Path("missing")));
  EXPECT_THAT(reason(rgb, Path("directory.exr")), HasSubstr("found a directory"));
  EXPECT_THAT(reason(rgb, "/proc/a.exr"), HasSubstr("cannot be written: "));
  EXPECT_THAT(reason(five, Path("a.png")),
              AllOf(HasSubstr("found 5 channels (R,G,B,A,"), HasSubstr("expected 1 to 4")));
  EXPECT_THAT(reason(five, Path("a.jpg")),
              AllOf(HasSubstr("found 5 channels"), HasSubstr("expected 1 or 3")));
  ImageSpec unnamed(8, 8, 4, PixelType::kUint8);
  unnamed.alpha = -1;
  EXPECT_THAT(reason(FromImage(Image(unnamed)), Path("a.jpg")), HasSubstr("found 4 channels"));
  EXPECT_THAT(Names(), ElementsAre("directory.exr"));
}

TEST_F(WriteTest, AFailingEvaluationLeavesTheOldFile) {
  SetContents(Path("a.exr"), "old");
  WriteOptions options;
  options.render.progress = [](double) { return false; };
  EXPECT_THROW(Write(Picture(), Path("a.exr"), options), Cancelled);
  EXPECT_THAT(Names(), ElementsAre("a.exr"));
  EXPECT_EQ(Contents(Path("a.exr")), "old");
}

// A file size limit stands for a full disk: writes beyond it fail with an errno, as they do there. Every
// limit up to the file's size is tried, so that header, pixels, tables at the end and the bytes flushed on
// closing all fail.
TEST_F(WriteTest, AFullDiskIsNoticedWhereverItHappens) {
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before;
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  for (const char* name : {"a.exr", "a.tif", "a.png", "a.jpg", "a.tga", "a.bmp", "a.dpx", "a.ppm", "a.hdr",
                           "a.sgi", "a.rla", "a.webp"}) {
    WriteOptions options;
    if (std::string(name) == "a.exr") options.type = PixelType::kHalf;
    const Node picture = Noise();
    Write(picture, Path(name), options);
    const auto size = std::filesystem::file_size(Path(name));
    const std::string whole = Contents(Path(name));
    for (const uintmax_t limit :
         {uintmax_t{0}, uintmax_t{100}, size / 4, size / 2, size - 5000, size - 100, size - 1}) {
      rlimit small = before;
      small.rlim_cur = limit;
      ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
      std::string message;
      try {
        Write(picture, Path(name), options);
      } catch (const Error& e) {
        message = e.what();
      }
      ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
      EXPECT_THAT(message, StartsWith(Path(name) + ": cannot be written"))
          << "limit " << limit << " of " << size;
      EXPECT_THAT(Names(), UnorderedElementsAre(name));
      EXPECT_TRUE(Contents(Path(name)) == whole) << name;
    }
    std::filesystem::remove(Path(name));
  }
  std::signal(SIGXFSZ, handler);
}

TEST_F(WriteTest, OutputsAppearTogetherOrNotAtAll) {
  const Node image = FromImage(Pattern(ImageSpec(20, 10, 3, PixelType::kHalf)));
  const auto old = [&](bool there) {
    for (const char* name : {"a.exr", "c.exr"}) {
      EXPECT_EQ(std::filesystem::exists(Path(name)), there) << name;
      if (there) {
        EXPECT_EQ(Contents(Path(name)), "old") << name;
      }
    }
  };
  for (const bool there : {false, true}) {
    for (const bool late : {false, true}) {
      if (there) SetContents(Path("a.exr"), "old"), SetContents(Path("c.exr"), "old");
      const WriteOptions options{.sync = !late};
      PendingOutput a(image, Path("a.exr"), options), b(image, Path("b.exr"), options),
          c(image, Path("c.exr"), options);
      if (late) {  // found when the others have their names
        for (const std::string& name : Names()) {
          if (name.starts_with(".b.")) std::filesystem::rename(Path(name), Path("away"));
        }
      } else {
        std::filesystem::create_directories(Path("b.exr/inside"));
      }
      EXPECT_THAT(ErrorOf([&] { PendingOutput::CommitTogether({&c, &a, &b}); }), HasSubstr("b.exr"));
      old(there);
      std::filesystem::remove_all(Path("b.exr"));
      PendingOutput::CommitTogether({&c, &a});
      for (const char* name : {"a.exr", "c.exr"}) EXPECT_EQ(Read(Path(name)).spec().width(), 20);
      for (const char* name : {"a.exr", "c.exr", "away"}) std::filesystem::remove(Path(name));
    }
  }
  EXPECT_TRUE(Names().empty());
}

TEST_F(WriteTest, TheLastOfTwoOutputsOfANameStays) {
  const Node small = FromImage(Pattern(ImageSpec(20, 10, 3, PixelType::kHalf)));
  const Node large = FromImage(Pattern(ImageSpec(30, 10, 3, PixelType::kHalf)));
  PendingOutput first(small, Path("a.exr"), {}), second(large, Path("a.exr"), {});
  PendingOutput::CommitTogether({&first, &second});
  EXPECT_EQ(Read(Path("a.exr")).spec().width(), 30);
  EXPECT_EQ(Names().size(), 1u);
}

// OpenImageIO leaves the name of the image as it finds it in memory.
TEST_F(WriteTest, NothingOfMemoryIsInAnSgi) {
  for (const std::string& name : {std::string(), std::string("a name"), std::string(200, 'n')}) {
    WriteOptions options;
    if (!name.empty()) options.attributes = {{"ImageDescription", "string", {}, {name}}};
    Write(FromImage(Image(ImageSpec(9, 7, 3, PixelType::kUint8))), Path("a.sgi"), options);
    const std::string bytes = Contents(Path("a.sgi")), kept = name.substr(0, 79);
    ASSERT_GT(bytes.size(), 512u);
    EXPECT_EQ(bytes.substr(24, 80), kept + std::string(80 - kept.size(), '\0'));
    EXPECT_EQ(bytes.substr(108, 404), std::string(404, '\0'));
  }
}

// Some writers end the program where they do not expect so many.
TEST_F(WriteTest, AnyNumberOfChannelsIsWrittenOrRefused) {
  for (const char* name :
       {"a.exr", "a.tif", "a.png", "a.jpg", "a.hdr", "a.gif", "a.bmp", "a.webp", "a.jp2", "a.heic", "a.sgi",
        "a.ppm", "a.tga", "a.rla", "a.iff", "a.fits", "a.ico", "a.zfile", "a.dpx"}) {
    for (const int channels : {1, 2, 3, 4, 5, 6, 9, 70}) {
      for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kFloat}) {
        try {
          Write(FromImage(Image(ImageSpec(8, 8, channels, type))), Path(name));
        } catch (const Error& e) {
          EXPECT_EQ(e.subject(), Path(name));
          EXPECT_TRUE(channels != 3 || name == std::string("a.zfile")) << e.what();
        }
      }
    }
  }
}

TEST_F(WriteTest, TheTypeIsKnownBeforeAFileIsThere) {
  for (const char* const name :
       {"a.exr", "a.tif", "a.png", "a.tga", "a.dpx", "a.hdr", "a.sgi", "a.bmp", "a.ppm"}) {
    for (const PixelType type :
         {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
      const Node node = FromImage(Pattern(ImageSpec(8, 6, 3, type)));
      PendingOutput output(node, Path(name), {});
      const PixelType stored = output.type();
      EXPECT_EQ(StoredType(node, Path(name)), stored) << name << " " << PixelTypeName(type);
      output.Commit();
      EXPECT_EQ(Names(), std::vector<std::string>{name}) << "nothing of the trial is left";
      std::filesystem::remove(Path(name));
    }
  }
}

}  // namespace
}  // namespace tessera
