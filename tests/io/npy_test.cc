// NumPy's files: every type, both orders, one to three dimensions; what is written, byte by byte; what is
// refused.
#include "files.h"
#include "tessera/io.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using namespace testing_io;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class NumPyTest : public FileTest {
 public:
  std::string Array(const std::string& header, const std::string& samples, int version = 1) {
    const std::string file = Path("a.npy");
    std::string length = {static_cast<char>(header.size() & 255), static_cast<char>(header.size() >> 8)};
    if (version > 1) length += std::string(2, '\0');
    std::ofstream(file, std::ios::binary)
        << "\x93NUMPY" << static_cast<char>(version) << '\0' << length << header << samples;
    return file;
  }
  static std::string Header(const std::string& type, const std::string& shape, bool columns = false) {
    return "{'descr': '" + type + "', 'fortran_order': " + (columns ? "True" : "False") +
           ", 'shape': " + shape + ", }\n";
  }
  static std::vector<float> Samples(const std::string& file) {
    const Image image = Render(Read(file));
    std::vector<float> all;
    const Roi& w = image.spec().data_window;
    for (int y = w.y0; y < w.y1; ++y) {
      for (int x = w.x0; x < w.x1; ++x) {
        for (int c = 0; c < image.spec().channel_count(); ++c) all.push_back(image.at<float>(x, y, c));
      }
    }
    return all;
  }
  std::string RefusalOf(const std::string& file) {
    try {
      Render(Read(file));
    } catch (const Error& e) {
      return e.what();
    }
    return "accepted";
  }
};

// The bytes of numbers as they lie in a file, least significant first or last.
template <class T>
std::string Bytes(const std::vector<T>& values, bool big = false) {
  std::string bytes;
  for (const T& v : values) {
    std::string one(reinterpret_cast<const char*>(&v), sizeof v);
    if (big) std::reverse(one.begin(), one.end());
    bytes += one;
  }
  return bytes;
}

TEST_F(NumPyTest, EveryTypeIsRead) {
  const std::string shape = "(1, 3)";
  EXPECT_THAT(Samples(Array(Header("|u1", shape), Bytes<uint8_t>({0, 51, 255}))), ElementsAre(0, 0.2f, 1));
  EXPECT_THAT(Samples(Array(Header("|b1", shape), Bytes<uint8_t>({0, 1, 1}))), ElementsAre(0, 1, 1));
  for (const bool big : {false, true}) {
    const std::string order = big ? ">" : "<";
    EXPECT_THAT(Samples(Array(Header(order + "u2", shape), Bytes<uint16_t>({0, 13107, 65535}, big))),
                ElementsAre(0, 0.2f, 1));
    EXPECT_THAT(Samples(Array(Header(order + "f4", shape), Bytes<float>({-1.5f, 0.1f, 3e9f}, big))),
                ElementsAre(-1.5f, 0.1f, 3e9f));
    EXPECT_THAT(Samples(Array(Header(order + "f8", shape), Bytes<double>({-1.5, 0.1, 3e9}, big))),
                ElementsAre(-1.5f, 0.1f, 3e9f));
    EXPECT_THAT(Samples(Array(Header(order + "f2", shape), Bytes<uint16_t>({0x3c00, 0xc000, 0x3555}, big))),
                ElementsAre(1, -2, 0.333251953125f));
  }
  EXPECT_EQ(Read(Array(Header("<f2", shape), std::string(6, '\0'))).spec().type, PixelType::kHalf);
}

TEST_F(NumPyTest, ShapesAndOrders) {
  const auto spec = [](const std::string& file) { return Read(file).spec(); };
  const std::string samples = Bytes<float>({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  const std::string line = Array(Header("<f4", "(12,)"), samples);
  EXPECT_EQ(spec(line).data_window, (Roi{0, 0, 12, 1}));
  const std::string plane = Array(Header("<f4", "(3, 4)"), samples);
  EXPECT_EQ(spec(plane).data_window, (Roi{0, 0, 4, 3}));
  EXPECT_EQ(Samples(plane)[4], 5);
  // The same array by columns: element (y, x) is the (3 x + y)th.
  EXPECT_THAT(Samples(Array(Header("<f4", "(3, 4)", true), samples)),
              ElementsAre(1, 4, 7, 10, 2, 5, 8, 11, 3, 6, 9, 12));
  const std::string color = Array(Header("<f4", "(2, 2, 3)"), samples, 2);
  EXPECT_THAT(spec(color).channels, ElementsAre("R", "G", "B"));
  EXPECT_EQ(Samples(color)[11], 12);
  EXPECT_THAT(Samples(Array(Header("<f4", "(2, 2, 3)", true), samples, 3)),
              ElementsAre(1, 5, 9, 3, 7, 11, 2, 6, 10, 4, 8, 12));
  // Two channels are a field, without alpha.
  const std::string field = Array(Header("<f4", "(2, 3, 2)"), samples);
  EXPECT_THAT(spec(field).channels, ElementsAre("X", "Y"));
  EXPECT_EQ(spec(field).alpha, -1);
}

TEST_F(NumPyTest, WhatIsWrittenIsNumPys) {
  Image image(ImageSpec(3, 2, 3));
  for (int i = 0; i < 18; ++i) image.at<float>(i / 3 % 3, i / 9, i % 3) = static_cast<float>(i) / 8;
  const std::string file = Path("o.npy");
  Write(FromImage(image), file, {.type = PixelType::kFloat});
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 3), }";
  ASSERT_EQ(bytes.size(), 128 + 18 * 4u);
  EXPECT_EQ(bytes.substr(0, 10), std::string("\x93NUMPY\1\0\x76\0", 10));
  EXPECT_EQ(bytes.substr(10, header.size()), header);
  EXPECT_EQ(bytes.substr(10 + header.size(), 118 - header.size()),
            std::string(117 - header.size(), ' ') + '\n');
  for (int i = 0; i < 18; ++i) {
    float v = 0;
    std::memcpy(&v, bytes.data() + 128 + i * 4, 4);
    EXPECT_EQ(v, static_cast<float>(i) / 8) << i;
  }
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    Write(FromImage(image), file, {.type = type});
    EXPECT_EQ(Read(file).spec().type, type);
    EXPECT_NEAR(Samples(file)[5], 0.625f, 0.002f);
  }
}

TEST_F(NumPyTest, WhatIsNoneIsRefused) {
  const std::string good = Header("<f4", "(1, 2)"), samples(8, '\0');
  EXPECT_EQ(RefusalOf(Array(good, samples)), "accepted");
  EXPECT_THAT(RefusalOf(Array(good, samples.substr(1))),
              HasSubstr("found fewer samples than the shape says"));
  EXPECT_THAT(RefusalOf(Array(Header("<f4", "(1, 2)", true), samples.substr(1))), HasSubstr("fewer samples"));
  EXPECT_THAT(RefusalOf(Array(Header("<f4", "(2147483647, 2147483647, 65534)"), samples)),
              HasSubstr("fewer samples"));
  EXPECT_THAT(RefusalOf(Array(Header("<f4", "(4294967297, 1)"), samples)), HasSubstr("too large"));
  EXPECT_THAT(RefusalOf(Array(Header("<f4", "(0, 2)"), samples)), HasSubstr("without elements"));
  EXPECT_THAT(RefusalOf(Array(Header("<f4", "()"), samples)), HasSubstr("0 dimensions, expected 1 to 3"));
  EXPECT_THAT(RefusalOf(Array(Header("<f4", "(1, 1, 1, 2)"), samples)), HasSubstr("4 dimensions"));
  EXPECT_THAT(RefusalOf(Array(Header("<f4", "(1, -2)"), samples)), HasSubstr("none of whole numbers"));
  EXPECT_THAT(RefusalOf(Array(Header("<c8", "(1, 1)"), samples)), HasSubstr("found the type <c8"));
  EXPECT_THAT(RefusalOf(Array(Header("|O", "(1, 1)"), samples)), HasSubstr("found the type |O"));
  EXPECT_THAT(RefusalOf(Array("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1,), }", samples)),
              HasSubstr("array of records"));
  EXPECT_THAT(RefusalOf(Array("{}", samples)), HasSubstr("without descr, fortran_order and shape"));
  EXPECT_THAT(RefusalOf(Array("{'descr': '<f4', 'fortran_order': 1, 'shape': (1,)}", samples)),
              HasSubstr("True or False"));
  EXPECT_THAT(RefusalOf(Array("{'descr': '<f4', 'fortran_order': True, 'shape': (1", samples)),
              HasSubstr("without an end"));
  EXPECT_THAT(RefusalOf(Array(good, samples, 4)), HasSubstr("found version 4"));
  // Every cut of a file.
  const std::string file = Array(good, samples);
  std::ifstream in(file, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  for (size_t size = 0; size < whole.size(); ++size) {
    std::ofstream(file, std::ios::binary) << whole.substr(0, size);
    EXPECT_NE(RefusalOf(file), "accepted") << size;
  }
}

}  // namespace
}  // namespace tessera
