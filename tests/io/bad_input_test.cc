// Files that are no images, or lie about being one: each gets its Error, in bounded time and memory.
#include <OpenImageIO/deepdata.h>

#include <fstream>

#include "base/input_file.h"
#include "files.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

using namespace testing_io;
using OIIO::TypeDesc;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class BadInputTest : public FileTest {
 protected:
  std::string Reason(const std::string& name) {
    const std::string text = ErrorOf([&] { Read(Path(name)); });
    EXPECT_THAT(text, StartsWith(Path(name) + ": "));
    return text;
  }
  // Reads the header and every row; returns the error, empty for none.
  std::string ReadAll(const std::string& file) {
    try {
      const Node node = Read(file);
      ConstImageView view;
      if (node.spec().data_window.pixels() < 1 << 20)
        ReadRows(node, 0, node.spec().channel_count(), 16, &view);
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), StartsWith(file + ": "));
      return e.what();
    }
    return "";
  }
};

// Forwards and backwards, within what the stream holds and beyond it.
TEST_F(BadInputTest, StreamsAreReadFromAnyPlace) {
  std::string bytes(300000, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 2654435761u >> 13);
  SetContents(Path("a"), bytes);
  base::InputFile stream(Path("a"), "a file");
  size_t at = 0;
  for (size_t k = 0; k < 3000; ++k) {
    at = (k % 3 == 0 ? at + 5 + k % 60 : k * 7919 + at / 2) % (bytes.size() - 64);
    stream.seekg(static_cast<std::streamoff>(at));
    std::string read(1 + k % 64, '\0');
    ASSERT_TRUE(stream.read(read.data(), static_cast<std::streamsize>(read.size())));
    ASSERT_EQ(read, bytes.substr(at, read.size())) << at;
    ASSERT_EQ(static_cast<size_t>(stream.tellg()), at + read.size());
    at += read.size();
  }
  stream.seekg(300000);
  EXPECT_EQ(stream.get(), std::char_traits<char>::eof());
}

TEST_F(BadInputTest, NotAnImage) {
  EXPECT_THAT(Reason("missing.exr"), HasSubstr("no such file"));
  std::filesystem::create_directory(Path("directory.exr"));
  EXPECT_THAT(Reason("directory.exr"), HasSubstr("found a directory, expected an image file"));
  SetContents(Path("empty.exr"), "");
  EXPECT_THAT(Reason("empty.exr"), HasSubstr("0 bytes"));
  SetContents(Path("text.exr"), "This is a letter and not a picture.\n");
  EXPECT_THAT(Reason("text.exr"), HasSubstr("cannot be read as an image"));
  EXPECT_THAT(ErrorOf([] { Read("/dev/null"); }), HasSubstr("device"));
  EXPECT_THAT(ErrorOf([&] { Subimages(Path("missing.exr")); }), HasSubstr("no such file"));
}

TEST_F(BadInputTest, TruncatedFilesAreNoticedBeforeOrWhileReading) {
  for (const char* name : {"a.exr", "a.tif", "a.png", "a.bmp", "a.dpx", "a.jpg"}) {
    const bool exr = std::string(name) == "a.exr";
    WritePattern(Path(name), {OIIO::ImageSpec(67, 45, 3, exr ? TypeDesc::HALF : TypeDesc::UINT8)});
    const std::string whole = Contents(Path(name));
    for (const size_t size : {size_t{4}, size_t{20}, whole.size() / 4, whole.size() / 2}) {
      SetContents(Path(name), whole.substr(0, size));
      EXPECT_NE(ReadAll(Path(name)), "") << name << " cut to " << size << " of " << whole.size();
    }
  }
}

// OpenImageIO inflates several of them at once and overlooks those that it cannot.
TEST_F(BadInputTest, DamagedStripsAndTilesAreNoticed) {
  for (const int tile : {0, 16}) {
    OIIO::ImageSpec spec(64, 64, 3, TypeDesc::UINT8);
    spec.attribute("compression", "zip");
    spec.attribute("tiff:RowsPerStrip", 16);
    spec.tile_width = spec.tile_height = tile;
    WritePattern(Path("a.tif"), {spec});
    const std::string whole = Contents(Path("a.tif"));
    // The first strip or tile begins with what deflate begins with.
    const size_t at = whole.find('\x78', 8);
    ASSERT_NE(at, std::string::npos);
    std::string damaged = whole;
    for (size_t i = at + 8; i < at + 40; ++i) damaged[i] = static_cast<char>(damaged[i] ^ 0x5a);
    SetContents(Path("a.tif"), damaged);
    for (const int rows : {16, 64}) {
      const Node node = Read(Path("a.tif"), {.codec = Codec::kOpenImageIO});
      ConstImageView view;
      EXPECT_THAT(ErrorOf([&] { ReadRows(node, 0, 3, rows, &view); }), HasSubstr("cannot be read"))
          << tile << " " << rows;
    }
  }
}

TEST_F(BadInputTest, FlippedBytesNeverDoHarm) {
  for (const char* name : {"a.exr", "a.tif", "a.png"}) {
    const bool exr = std::string(name) == "a.exr";
    WritePattern(Path(name), {OIIO::ImageSpec(33, 21, 3, exr ? TypeDesc::HALF : TypeDesc::UINT8)});
    const std::string whole = Contents(Path(name));
    int errors = 0;
    for (size_t i = 0; i < std::min<size_t>(whole.size(), 400); i += 3) {
      std::string spoilt = whole;
      spoilt[i] = static_cast<char>(spoilt[i] ^ 0xFF);
      SetContents(Path(name), spoilt);
      errors += !ReadAll(Path(name)).empty();
    }
    EXPECT_GT(errors, 0) << name;
  }
}

TEST_F(BadInputTest, ReadersAreThoseOfTheList) {
  const OIIO::ImageSpec spec(33, 21, 3, TypeDesc::UINT8);
  WritePattern(Path("a.iff"), {spec});
  EXPECT_THAT(Reason("a.iff"), HasSubstr("found the format iff"));
  EXPECT_EQ(Read(Path("a.iff"), {.formats = Formats::kAll}).spec().width(), 33);
  EXPECT_THAT(ErrorOf([&] { Subimages(Path("a.iff")); }), HasSubstr("found the format iff"));
  // Not by another name either, but a picture of the list may have any.
  SetContents(Path("a.exr"), Contents(Path("a.iff")));
  EXPECT_THAT(Reason("a.exr"), HasSubstr("cannot be read as an image"));
  SetContents(Path("none"), Contents(Path("a.iff")));
  EXPECT_THAT(Reason("none"), HasSubstr("neither its name nor its first bytes"));
  for (const char* name :
       {"b.png", "b.tif", "b.bmp", "b.sgi", "b.tga", "b.ppm", "b.rla", "b.dpx", "b.jpg", "b.gif"}) {
    WritePattern(Path(name), {spec});
    EXPECT_EQ(Read(Path(name)).spec().width(), 33) << name;
    if (std::string(name) == "b.tga" || std::string(name) == "b.ppm" || std::string(name) == "b.rla")
      continue;
    for (const char* other : {"c.jpg", "c", "c.unknown"}) {
      SetContents(Path(other), Contents(Path(name)));
      EXPECT_EQ(Read(Path(other)).spec().width(), 33) << name << " as " << other;
    }
  }
}

TEST_F(BadInputTest, ShortFilesDoNotDeclareLargePictures) {
  for (const char* packing : {"none", "zip", "lzw", "packbits"}) {
    OIIO::ImageSpec spec(64, 8, 3, TypeDesc::UINT8);
    spec.attribute("compression", packing);
    WritePattern(Path("a.tif"), {spec});
    std::string bytes = Contents(Path("a.tif"));
    size_t at = bytes.find(std::string("\x00\x01\x03\x00\x01\x00\x00\x00\x40\x00", 10));
    if (at == std::string::npos) at = bytes.find(std::string("\x00\x01\x04\x00\x01\x00\x00\x00\x40\x00", 10));
    ASSERT_NE(at, std::string::npos);
    EXPECT_EQ(Read(Path("a.tif")).spec().width(), 64);
    bytes[at + 2] = 4;
    bytes.replace(at + 8, 4, std::string("\x00\x00\x40\x00", 4));  // 2^22
    SetContents(Path("a.tif"), bytes);
    EXPECT_THAT(Reason("a.tif"), HasSubstr("expected a plausible size")) << packing;
  }
  // What packs as well as its format can is a picture all the same.
  for (const char* name : {"flat.png", "flat.tif", "flat.exr", "flat.bmp", "flat.webp", "flat.jpg"}) {
    const Node flat = FromImage(Image(ImageSpec(4096, 2048, 3, PixelType::kUint8)));
    Write(flat, Path(name));
    EXPECT_EQ(ReadAll(Path(name)), "") << name << " of " << std::filesystem::file_size(Path(name));
  }
}

// OpenImageIO notes every strip that is not there, and ends the program when these notes grow too long.
TEST_F(BadInputTest, MillionsOfRowsThatAreNotThere) {
  OIIO::ImageSpec spec(6, 8, 3, TypeDesc::UINT8);
  spec.attribute("compression", "zip");
  WritePattern(Path("a.tif"), {spec});
  std::string bytes = Contents(Path("a.tif"));
  const size_t at = bytes.find(std::string("\x01\x01\x03\x00\x01\x00\x00\x00\x08\x00", 10));
  ASSERT_NE(at, std::string::npos);
  bytes[at + 2] = 4, bytes[at + 10] = 0x62;  // 6,422,536, which takes a long integer
  SetContents(Path("short.tif"), bytes);
  bytes.resize(125000);
  SetContents(Path("a.tif"), bytes);
  EXPECT_THAT(ErrorOf([&] { ReadVolume(Path("short.tif")); }), HasSubstr("expected a plausible size"));
  EXPECT_THAT(ErrorOf([&] { ReadVolume(Path("a.tif")); }), StartsWith(Path("a.tif") + ": "));
}

// An EXR header with its data window replaced.
TEST_F(BadInputTest, AbsurdDimensions) {
  OIIO::ImageSpec spec(33, 21, 3, TypeDesc::HALF);
  spec.attribute("compression", "none");
  WritePattern(Path("a.exr"), {spec});
  const std::string whole = Contents(Path("a.exr"));
  const size_t at = whole.find("dataWindow") + 11 + 6 + 4;  // name, "box2i", size
  for (const auto& [x1, y1] :
       {std::pair{INT32_MAX, INT32_MAX}, {999999, 999999}, {-1, 20}, {32, -1}, {INT32_MIN, 5}}) {
    std::string spoilt = whole;
    std::memcpy(spoilt.data() + at + 8, &x1, 4);
    std::memcpy(spoilt.data() + at + 12, &y1, 4);
    SetContents(Path("a.exr"), spoilt);
    EXPECT_NE(ReadAll(Path("a.exr")), "") << x1 << " " << y1;
    EXPECT_NE(ErrorOf([&] { Read(Path("a.exr")); }), "");
  }
}

// Rows so near to 2^31 that OpenImageIO's blocks of them would overflow.
TEST_F(BadInputTest, FarWindows) {
  WritePattern(Path("a.png"), {OIIO::ImageSpec(13, 19, 1, TypeDesc::UINT8)});
  const std::string whole = Contents(Path("a.png"));
  const std::string chunk =
      std::string("\0\0\0\x09", 4) + std::string("oFFs\0\0\0\0\x7f\xff\0\0\0", 13) + "\x7f\xad\xc7\x21";
  SetContents(Path("a.png"), whole.substr(0, 33) + chunk + whole.substr(33));
  EXPECT_THAT(Reason("a.png"), HasSubstr("found a window of 13 x 19 that ends beyond 1073741824"));
}

// So would PNG's library.
TEST_F(BadInputTest, ChunksOfAPngAreWithinTheFile) {
  WritePattern(Path("a.png"), {OIIO::ImageSpec(13, 19, 1, TypeDesc::UINT8)});
  const std::string whole = Contents(Path("a.png"));
  for (const size_t at : {size_t{33}, whole.size() - 12}) {  // behind IHDR, before IEND
    SetContents(Path("a.png"), whole.substr(0, at) + "\x70\1\2\3zTXtName" + whole.substr(at));
    EXPECT_THAT(Reason("a.png"), HasSubstr("found a chunk \"zTXt\" of 1879114243 bytes declared"));
  }
}

// OpenEXR would take the memory first.
TEST_F(BadInputTest, AttributesOfAnExrAreWithinTheFile) {
  OIIO::ImageSpec spec(33, 21, 3, TypeDesc::HALF);
  spec.attribute("comments", "a comment");
  WritePattern(Path("a.exr"), {spec, spec});
  const std::string whole = Contents(Path("a.exr"));
  ASSERT_EQ(ReadAll(Path("a.exr")), "");
  for (const size_t from : {size_t{0}, whole.size() / 3}) {
    std::string spoilt = whole;
    const size_t at = from == 0 ? spoilt.find("comments") : spoilt.rfind("comments");
    const uint32_t size = 1800000000;
    std::memcpy(spoilt.data() + at + 9 + 7, &size, 4);  // name, "string"
    SetContents(Path("a.exr"), spoilt);
    EXPECT_THAT(Reason("a.exr"), HasSubstr("found an attribute \"comments\" of 1800000000 bytes declared"));
  }
  // A name without an end is the library's.
  SetContents(Path("a.exr"), whole.substr(0, 60));
  EXPECT_THAT(Reason("a.exr"), HasSubstr("cannot be read as an image"));
}

// OpenImageIO would read them from nowhere.
TEST_F(BadInputTest, SamplesOfAnSgiHaveOneByteOrTwo) {
  WritePattern(Path("a.sgi"), {OIIO::ImageSpec(33, 21, 3, TypeDesc::UINT8)});
  std::string spoilt = Contents(Path("a.sgi"));
  ASSERT_EQ(ReadAll(Path("a.sgi")), "");
  for (const char bytes : {0, 3, 4, 127}) {
    spoilt[3] = bytes;
    SetContents(Path("a.sgi"), spoilt);
    EXPECT_THAT(Reason("a.sgi"),
                HasSubstr("found samples of " + std::to_string(bytes) + " bytes, expected 1 or 2"));
  }
}

// The most addresses that this process ever had, in kB; 0 where the system does not say.
long MostAddresses() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word == "VmPeak:") return status >> word ? std::stol(word) : 0;
  }
  return 0;
}

// OpenEXR takes memory for several chunks of rows, and what unpacks them, as it opens a file: of rows of 4
// million pixels gigabytes, and where the system refuses one of them it never gives back the others.
TEST_F(BadInputTest, PixelsThatAnExrDeclaresFitTheFile) {
  for (const char* packing : {"none", "zip", "piz", "dwaa"}) {
    for (const int parts : {1, 2}) {
      SCOPED_TRACE(std::string(packing) + ", parts: " + std::to_string(parts));
      OIIO::ImageSpec spec(33, 21, 3, TypeDesc::HALF);
      spec.attribute("compression", packing);
      WritePattern(Path("a.exr"), std::vector<OIIO::ImageSpec>(static_cast<size_t>(parts), spec));
      std::string spoilt = Contents(Path("a.exr"));
      ASSERT_EQ(ReadAll(Path("a.exr")), "");
      const int x1 = (1 << 22) - 1;
      std::memcpy(spoilt.data() + spoilt.rfind("dataWindow") + 11 + 6 + 4 + 8, &x1, 4);
      SetContents(Path("a.exr"), spoilt);
      const long before = MostAddresses();
      EXPECT_THAT(Reason("a.exr"),
                  HasSubstr("found 4194304 x 21 pixels of 3 channels declared in a file of"));
      EXPECT_LT(MostAddresses() - before, 100000);
    }
  }
}

// OpenEXR reads a value of its type whatever size is declared, and goes on from there.
TEST_F(BadInputTest, AttributesOfAnExrHaveTheSizeOfTheirType) {
  OIIO::ImageSpec spec(33, 21, 3, TypeDesc::HALF);
  WritePattern(Path("a.exr"), {spec});
  const std::string whole = Contents(Path("a.exr"));
  const std::pair<const char*, const char*> attributes[] = {
      {"channels", "chlist"}, {"dataWindow", "box2i"}, {"screenWindowWidth", "float"}};
  for (const auto& [name, type] : attributes) {
    std::string spoilt = whole;
    const size_t at =
        spoilt.find(std::string(name) + '\0' + type + '\0') + std::strlen(name) + std::strlen(type) + 2;
    --spoilt[at];
    SetContents(Path("a.exr"), spoilt);
    EXPECT_THAT(Reason("a.exr"), HasSubstr(std::string("for its type ") + type));
  }
}

// OpenImageIO scales values of no bits, and rounds up to strips of nearly 2^31 rows, for ever.
TEST_F(BadInputTest, ReadersThatWouldNotEndAreNotAsked) {
  WritePattern(Path("a.rla"), {OIIO::ImageSpec(13, 9, 4, TypeDesc::UINT8)});
  const std::string rla = Contents(Path("a.rla"));
  ASSERT_EQ(ReadAll(Path("a.rla")), "");
  std::string spoilt = rla;
  spoilt[662] = spoilt[663] = 0;
  SetContents(Path("a.rla"), spoilt);
  EXPECT_THAT(Reason("a.rla"), HasSubstr("found channels of 0 bits"));
  spoilt = rla + rla;
  const auto next = static_cast<uint16_t>(rla.size());  // the second image follows itself
  for (const size_t at : {size_t{736}, rla.size() + 736}) {
    spoilt[at + 2] = static_cast<char>(next >> 8), spoilt[at + 3] = static_cast<char>(next);
  }
  SetContents(Path("a.rla"), spoilt);
  EXPECT_THAT(Reason("a.rla"), HasSubstr("expected it behind that"));

  OIIO::ImageSpec spec(13, 19, 3, TypeDesc::UINT16);
  spec.attribute("planarconfig", "separate");  // of which OpenImageIO reads the pixels
  WritePattern(Path("a.tif"), {spec});
  std::string tiff = Contents(Path("a.tif"));
  const size_t at = tiff.find(std::string("\x16\x01\x03\x00\x01\x00\x00\x00", 8));
  ASSERT_NE(at, std::string::npos);
  tiff[at + 2] = 4;
  for (const char* rows : {"\x01\x02\xfe\x7f", "\x01\x01\x01\x10"}) {
    tiff.replace(at + 8, 4, rows);
    SetContents(Path("a.tif"), tiff);
    EXPECT_THAT(ReadAll(Path("a.tif")), HasSubstr("rows a strip in an image of 19"));
    EXPECT_THAT(ErrorOf([&] { ReadVolume(Path("a.tif")); }), HasSubstr("rows a strip in an image of 19"));
  }
}

TEST_F(BadInputTest, UserDataOfADpxAreWithinTheFile) {
  WritePattern(Path("a.dpx"), {OIIO::ImageSpec(33, 21, 3, TypeDesc::UINT8)});
  const std::string whole = Contents(Path("a.dpx"));
  ASSERT_EQ(ReadAll(Path("a.dpx")), "");
  for (const bool swapped : {false, true}) {
    std::string spoilt = whole;
    const bool backward = spoilt[0] == 'S';
    if (swapped) spoilt.replace(0, 4, backward ? "XPDS" : "SDPX");
    const uint32_t size = 0x39393939;  // in either order
    std::memcpy(spoilt.data() + 32, &size, 4);
    SetContents(Path("a.dpx"), spoilt);
    EXPECT_THAT(Reason("a.dpx"), HasSubstr("found user data of "));
  }
}

TEST_F(BadInputTest, HugeImageInAShortFile) {
  // A BMP header of 54 bytes that declares 30000 x 30000 pixels.
  std::string bmp(54, '\0');
  const auto put = [&](size_t at, uint32_t value, size_t size) {
    std::memcpy(bmp.data() + at, &value, size);
  };
  bmp[0] = 'B', bmp[1] = 'M';
  put(2, 54, 4), put(10, 54, 4), put(14, 40, 4), put(18, 30000, 4), put(22, 30000, 4), put(26, 1, 2),
      put(28, 24, 2);
  SetContents(Path("a.bmp"), bmp);
  EXPECT_THAT(Reason("a.bmp"), HasSubstr("30000 x 30000"));
}

// OpenVDB would take the memory first.
TEST_F(BadInputTest, TextsOfAnOpenVdbAreWithinTheFile) {
  const auto text = [](const std::string& t) {
    const auto size = static_cast<uint32_t>(t.size());
    return std::string(reinterpret_cast<const char*>(&size), 4) + t;
  };
  const std::string one("\1\0\0\0", 4), none(4, '\0');
  const std::string start =
      " BDV" + none + std::string("\xe0\0\0\0\x0a\0\0\0\0\0\0\0\1", 13) + std::string(36, 'a');
  const std::string grid =
      text("body") + text("Tree_float_5_4_3") + text("") + std::string(24, '\x7f') + none;
  for (const std::string& before : {start + one, start + one + text("creator"), start + none + one,
                                    start + none + one + grid + one, start + none + one + grid + none}) {
    SetContents(Path("a.vdb"), before + "\xff\xff\xff\x7f and some more");
    EXPECT_THAT(Reason("a.vdb"), HasSubstr("found a text of 2147483647 bytes declared"));
  }
}

// Gigabytes for a hundred bytes, which the fuzz target of volumes came to.
TEST_F(BadInputTest, OldOpenVdbFilesAreNotTried) {
  for (const uint32_t version : {0u, 221u, 225u, 0xffffffffu}) {
    std::string bytes(" BDV\0\0\0\0", 8);
    bytes += std::string(reinterpret_cast<const char*>(&version), 4) + std::string(8, '\0');
    SetContents(Path("a.vdb"),
                bytes + std::string("\x12\0\1\0\x78\x5e\x7d\xc8\x21", 9) + std::string(80, 'a'));
    EXPECT_THAT(Reason("a.vdb"),
                HasSubstr("found version " + std::to_string(version) + " of OpenVDB's files, expected"));
  }
}

// OpenImageIO would make a canvas of 17 GB before it looks for a picture.
TEST_F(BadInputTest, HugeScreenOfAShortGif) {
  WritePattern(Path("a.gif"), {OIIO::ImageSpec(9, 7, 3, TypeDesc::UINT8)});
  std::string bytes = Contents(Path("a.gif"));
  ASSERT_EQ(ReadAll(Path("a.gif")), "");
  bytes.replace(6, 4, "\xff\xff\xff\xff");
  SetContents(Path("a.gif"), bytes);
  EXPECT_THAT(Reason("a.gif"), HasSubstr("found 65535 x 65535 pixels"));
}

TEST_F(BadInputTest, Unreadable) {
  WritePattern(Path("a.png"), {OIIO::ImageSpec(4, 3, 3, TypeDesc::UINT8)});
  std::filesystem::permissions(Path("a.png"), std::filesystem::perms::none);
  std::filesystem::permissions(std::filesystem::path(Path("a.png")).parent_path(),
                               std::filesystem::perms(0755));
  const bool root = ::geteuid() == 0;  // who may read everything
  if (root) {
    ASSERT_EQ(::seteuid(65534), 0);
  }
  const std::string reason = Reason("a.png");
  if (root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  EXPECT_THAT(reason, HasSubstr("Permission denied"));
}

struct Tag {
  uint16_t id, type;
  uint32_t count, value;
};
constexpr uint16_t kShort = 3, kLong = 4;
// A TIFF whose data begins at byte 8.
std::string HandMadeTiff(const std::vector<Tag>& tags, const std::string& data) {
  std::string tiff("II\x2a\0", 4);
  const auto put = [&tiff](uint32_t value, size_t size) {
    tiff.append(reinterpret_cast<const char*>(&value), size);
  };
  put(static_cast<uint32_t>(8 + data.size()), 4);
  tiff += data;
  put(static_cast<uint32_t>(tags.size()), 2);
  for (const Tag& tag : tags) put(tag.id, 2), put(tag.type, 2), put(tag.count, 4), put(tag.value, 4);
  put(0, 4);
  return tiff;
}

// A palette of two bits: what is read is twelve times what is stored.
TEST_F(BadInputTest, CodesOfAPaletteAreFewBytes) {
  constexpr uint32_t kWidth = 73, kHeight = 43, kStored = 19 * kHeight;
  std::string data(kStored, '\x1b');
  data.push_back(0);
  for (int i = 0; i < 12; ++i) data += {static_cast<char>(40 * i), static_cast<char>(20 * i)};
  SetContents(Path("a.tif"), HandMadeTiff({{256, kShort, 1, kWidth},
                                           {257, kShort, 1, kHeight},
                                           {258, kShort, 1, 2},
                                           {259, kShort, 1, 1},
                                           {262, kShort, 1, 3},
                                           {273, kLong, 1, 8},
                                           {277, kShort, 1, 1},
                                           {278, kShort, 1, kHeight},
                                           {279, kLong, 1, kStored},
                                           {284, kShort, 1, 1},
                                           {320, kShort, 12, 8 + kStored + 1}},
                                          data));
  EXPECT_EQ(ReadAll(Path("a.tif")), "");
}

TEST_F(BadInputTest, AsManyChannelsAsAFileCanHave) {
  // Of two pixels, written by hand: OpenImageIO writes none with so many channels.
  constexpr uint32_t kChannels = 65535;
  const std::vector<Tag> tags = {
      {256, kShort, 1, 2},         {257, kShort, 1, 1}, {258, kShort, 1, 8},
      {259, kShort, 1, 1},         {262, kShort, 1, 1}, {273, kLong, 1, 8},
      {277, kShort, 1, kChannels}, {278, kShort, 1, 1}, {279, kLong, 1, 2 * kChannels},
      {284, kShort, 1, 1}};
  std::string data;
  for (uint32_t i = 0; i < 2 * kChannels; ++i) data.push_back(static_cast<char>(i % 251));
  SetContents(Path("a.tif"), HandMadeTiff(tags, data));
  const std::string reason = ErrorOf([&] {
    const Node node = Read(Path("a.tif"));
    ASSERT_EQ(node.spec().channel_count(), static_cast<int>(kChannels));
    ConstImageView view;
    const auto kept = ReadRows(node, kChannels - 1, kChannels, 1, &view);
    EXPECT_EQ(std::to_integer<int>(*view.At(1, 0)), static_cast<int>((2 * kChannels - 1) % 251));
  });
  if (!reason.empty()) {
    EXPECT_THAT(reason, StartsWith(Path("a.tif") + ": "));  // a library may refuse, but by name
  }
}

TEST_F(BadInputTest, DeepPixels) {
  OIIO::ImageSpec spec(4, 3, 2, TypeDesc::FLOAT);
  spec.channelnames = {"A", "Z"};
  spec.deep = true;
  OIIO::DeepData deep(spec);
  for (int i = 0; i < 12; ++i) deep.set_samples(i, 1);
  auto output = OIIO::ImageOutput::create(Path("a.exr"));
  ASSERT_TRUE(output->open(Path("a.exr"), spec) && output->write_deep_image(deep) && output->close())
      << output->geterror();
  EXPECT_THAT(Reason("a.exr"), HasSubstr("found deep pixels, expected flat ones"));
}

}  // namespace
}  // namespace tessera
