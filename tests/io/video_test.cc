// Raw frames and Y4M: headers, chroma up and down, matrices, against formulas of their own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <vector>

#include "io/video/chroma.h"
#include "io/video/pixel_format.h"
#include "io/video/y4m.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

TEST(Y4m, HeaderSaysWhatItsWordsSay) {
  const Y4mHeader h = ParseY4mHeader(
      "in", "YUV4MPEG2 W720 H576 F25:1 It A59:54 C420mpeg2 XYSCSS=420MPEG2 XCOLORRANGE=FULL Xother");
  EXPECT_EQ(h.width, 720);
  EXPECT_EQ(h.height, 576);
  EXPECT_EQ(h.rate, "25:1");
  EXPECT_EQ(h.interlacing, "t");
  EXPECT_EQ(h.aspect, "59:54");
  EXPECT_EQ(h.pixels->name, "yuv420p");
  EXPECT_EQ(h.siting, Siting::kLeft);
  EXPECT_EQ(h.full, true);
  EXPECT_EQ(Y4mLine(h), "YUV4MPEG2 W720 H576 F25:1 It A59:54 C420mpeg2 XYSCSS=420MPEG2 XCOLORRANGE=FULL\n");
  const Y4mHeader plain = ParseY4mHeader("in", "YUV4MPEG2 W2 H3");
  EXPECT_EQ(plain.pixels->name, "yuv420p");
  EXPECT_EQ(plain.siting, Siting::kCentre);
  EXPECT_FALSE(plain.full);
}

TEST(Y4m, EveryColorSpaceComesBack) {
  for (const std::string& word : Y4mColorWords()) {
    Y4mHeader h = ParseY4mHeader("in", "YUV4MPEG2 W5 H7 C" + word);
    ASSERT_NE(h.pixels, nullptr) << word;
    const Y4mHeader again = ParseY4mHeader("in", Y4mLine(h).substr(0, Y4mLine(h).size() - 1));
    EXPECT_EQ(again.pixels, h.pixels) << word;
    EXPECT_EQ(again.siting, h.siting) << word;
    if (word != "420") {
      EXPECT_NE(Y4mLine(h).find(" C" + word), std::string::npos) << Y4mLine(h);
    }
  }
}

TEST(Y4m, WhatIsWrongIsTold) {
  const auto refusal = [](const std::string& line) -> std::string {
    try {
      ParseY4mHeader("in", line);
    } catch (const DataError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(refusal("RIFF").find("YUV4MPEG2"), std::string::npos);
  EXPECT_NE(refusal("").find("YUV4MPEG2"), std::string::npos);
  EXPECT_NE(refusal("YUV4MPEG2 H5").find("without W"), std::string::npos);
  EXPECT_NE(refusal("YUV4MPEG2 W5").find("without H"), std::string::npos);
  for (const char* const size : {"W0 H5", "W-3 H5", "W99999 H5", "W5x H5", "W H5", "W5 H1e3"})
    EXPECT_NE(refusal(std::string("YUV4MPEG2 ") + size).find("found the size"), std::string::npos) << size;
  for (const char* const colors : {"C411", "C444alpha", "C420p11", "C", "Cmono8", "Cp10", "C444p10le"})
    EXPECT_NE(refusal(std::string("YUV4MPEG2 W5 H5 ") + colors).find(colors), std::string::npos) << colors;
}

TEST(PixelFormats, SizesAndNames) {
  std::set<std::string> names;
  for (const PixelFormat& f : PixelFormats()) EXPECT_TRUE(names.insert(f.name).second) << f.name;
  const auto bytes = [](const char* name) { return FrameBytes(*FindPixelFormat(name), 5, 3); };
  EXPECT_EQ(bytes("rgb24"), 45U);
  EXPECT_EQ(bytes("rgba64le"), 120U);
  EXPECT_EQ(bytes("gbrpf32le"), 180U);
  EXPECT_EQ(bytes("gray"), 15U);
  EXPECT_EQ(bytes("yuv420p"), 15U + 2 * 3 * 2);
  EXPECT_EQ(bytes("yuv422p10le"), 2 * (15U + 2 * 3 * 3));
  EXPECT_EQ(FindPixelFormat("nv12"), nullptr);
}

struct Rng {
  uint32_t state = 12345;
  uint32_t operator()() { return state ^= state << 13, state ^= state >> 17, state ^= state << 5; }
};

std::vector<std::byte> RandomFrame(const PixelFormat& f, int width, int height, Rng& random) {
  std::vector<std::byte> frame(FrameBytes(f, width, height));
  for (size_t i = 0; i < frame.size() / PixelBytes(f.type); ++i) {
    const uint32_t code = random() % static_cast<uint32_t>(f.Top() + 1);
    std::memcpy(frame.data() + i * PixelBytes(f.type), &code, PixelBytes(f.type));  // the little end first
  }
  return frame;
}

// Whatever the codes, and odd sizes too.
TEST(Chroma, BackUndoesUpExactly) {
  Rng random;
  for (const PixelFormat& f : PixelFormats()) {
    if (!f.IsSubsampled()) continue;
    for (const Siting siting : {Siting::kCentre, Siting::kLeft, Siting::kTopLeft}) {
      for (int width = 1; width < 10; ++width) {
        for (int height = 1; height < 10; ++height) {
          const auto frame = RandomFrame(f, width, height, random);
          std::vector<float> planes(static_cast<size_t>(3 * width * height), -1);
          PlanesOfFrame(f, siting, width, height, frame.data(), planes.data());
          std::vector<std::byte> back(frame.size());
          FrameOfPlanes(f, siting, width, height, planes.data(), back.data());
          ASSERT_EQ(back, frame) << f.name << " " << width << "x" << height;
        }
      }
    }
  }
}

// A ramp of chroma is the same ramp at the luma's places, which each siting has elsewhere.
TEST(Chroma, RampsStayWhereTheyAre) {
  const PixelFormat& f = *FindPixelFormat("yuv420p16le");
  constexpr int kWidth = 16, kHeight = 12, kChromaWidth = 8, kChromaHeight = 6;
  for (const Siting siting : {Siting::kCentre, Siting::kLeft, Siting::kTopLeft}) {
    const double dx = siting == Siting::kCentre ? 0.5 : 0, dy = siting == Siting::kTopLeft ? 0 : 0.5;
    const auto value = [](double x, double y) { return 1000 + 64 * x + 80 * y; };
    std::vector<uint16_t> frame(FrameBytes(f, kWidth, kHeight) / 2);
    for (int y = 0; y < kChromaHeight; ++y) {
      for (int x = 0; x < kChromaWidth; ++x)
        frame[static_cast<size_t>(kWidth * kHeight + y * kChromaWidth + x)] =
            static_cast<uint16_t>(value(2 * x + dx, 2 * y + dy));
    }
    std::vector<float> planes(3 * kWidth * kHeight);
    PlanesOfFrame(f, siting, kWidth, kHeight, reinterpret_cast<const std::byte*>(frame.data()),
                  planes.data());
    for (int y = 2; y < kHeight - 3; ++y) {
      for (int x = 2; x < kWidth - 3; ++x)
        EXPECT_EQ(planes[static_cast<size_t>(kWidth * kHeight + y * kWidth + x)], value(x, y))
            << x << "," << y;
    }
  }
}

TEST(Chroma, CodesAreLimitedAndRounded) {
  const PixelFormat& f = *FindPixelFormat("yuv422p10le");
  const std::vector<float> planes = {-3, 1e9F, 1.49F, NAN, 5, 6, 2000, 2000, -7, -9, 0, INFINITY};
  std::vector<uint16_t> frame(8);
  FrameOfPlanes(f, Siting::kCentre, 4, 1, planes.data(), reinterpret_cast<std::byte*>(frame.data()));
  EXPECT_EQ(frame, (std::vector<uint16_t>{0, 1023, 1, 0, 6, 1023, 0, 1023}));
}

// A formula as the recommendations have it, in words of its own.
struct Codes {
  double y, cb, cr;
};
Codes CodesOf(double r, double g, double b, double kr, double kb, bool full, int bits) {
  const double y = kr * r + (1 - kr - kb) * g + kb * b, pb = 0.5 * (b - y) / (1 - kb),
               pr = 0.5 * (r - y) / (1 - kr);
  const double n = std::pow(2, bits - 8), all = std::pow(2, bits) - 1;
  if (full) return {all * y, all * pb + 128 * n, all * pr + 128 * n};
  return {n * (219 * y + 16), n * (224 * pb + 128), n * (224 * pr + 128)};
}

TEST(Ycc, MatricesAreTheRecommendations) {
  Rng random;
  for (const auto& [kr, kb] : {std::pair{0.299, 0.114}, {0.2126, 0.0722}, {0.2627, 0.0593}}) {
    for (const bool full : {false, true}) {
      for (const int bits : {8, 10, 16}) {
        const double top = bits == 8 ? 255 : 65535;
        const std::vector<double> to = YccOfRgb({kr, kb, full, bits}, top),
                                  from = RgbOfYcc({kr, kb, full, bits}, top);
        for (int i = 0; i < 20; ++i) {
          const double v[3] = {random() % 1000 / 1000.0, random() % 1000 / 1000.0, random() % 1000 / 1000.0};
          const Codes c = CodesOf(v[0], v[1], v[2], kr, kb, full, bits);
          const double codes[3] = {c.y / top, c.cb / top, c.cr / top};
          for (size_t k = 0; k < 3; ++k) {
            double there = to[9 + k], back = from[9 + k];
            for (size_t j = 0; j < 3; ++j) there += v[j] * to[3 * j + k], back += codes[j] * from[3 * j + k];
            EXPECT_NEAR(there, codes[k], 1e-12);
            EXPECT_NEAR(back, v[k], 1e-12);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera::io
