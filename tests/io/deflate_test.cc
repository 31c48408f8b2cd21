// Segments that join to one stream, and the walk that finds where a stream may be continued.
#include "io/codec/deflate.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "io/codec/deflate_tail.h"
#include "io/codec/png_rows.h"

namespace tessera::io {
namespace {

using base::Bytes;

// Of several kinds, so that streams have stored, fixed and dynamic blocks, long codes and long matches.
Bytes Made(int kind, size_t size) {
  std::mt19937 random(static_cast<unsigned>(kind * 1000 + static_cast<int>(size)));
  std::geometric_distribution<int> small(0.05), rare(0.4);
  Bytes bytes(size);
  for (size_t i = 0; i < size; ++i) {
    switch (kind) {
      case 0:
        bytes[i] = static_cast<uint8_t>(random());
        break;
      case 1:
        bytes[i] = 7;
        break;
      case 2:
        bytes[i] = static_cast<uint8_t>(small(random));
        break;
      case 3:
        bytes[i] = i < 1000 || random() % 97 == 0 ? static_cast<uint8_t>(random()) : bytes[i - 1000];
        break;
      default:
        bytes[i] = static_cast<uint8_t>(rare(random) * rare(random));
        break;
    }
  }
  return bytes;
}

TEST(DeflateTest, SegmentsJoinToOneStream) {
  for (const int level : {1, 4, 6, 9, 12}) {
    Deflater deflater(level);
    for (int kind = 0; kind < 5; ++kind) {
      Bytes all, stream(std::begin(kZlibHeader), std::end(kZlibHeader));
      uint32_t adler = kAdlerOfNothing;
      const std::vector<size_t> sizes = {1, 2, 0, 5, 300, 70000, 262144, 99, 0, 600001, 17};
      for (size_t i = 0; i < sizes.size(); ++i) {
        const Bytes part = Made(kind, sizes[i]);
        deflater.Segment(part, i + 1 == sizes.size(), stream);
        adler = JoinedAdler32(adler, Adler32(kAdlerOfNothing, part), part.size());
        all.insert(all.end(), part.begin(), part.end());
      }
      EXPECT_EQ(adler, Adler32(kAdlerOfNothing, all));
      for (int shift = 24; shift >= 0; shift -= 8) stream.push_back(static_cast<uint8_t>(adler >> shift));
      Bytes back(all.size());
      EXPECT_TRUE(Inflater().Zlib(stream, back)) << "kind " << kind << ", level " << level;
      EXPECT_EQ(back, all);
    }
  }
}

TEST(DeflateTest, AStreamOfAnotherLengthOrADamagedOneIsRefused) {
  const Bytes bytes = Made(2, 5000);
  Bytes stream;
  Deflater(6).Zlib(bytes, stream);
  Bytes right(5000), longer(5001), shorter(4999);
  EXPECT_TRUE(Inflater().Zlib(stream, right));
  EXPECT_FALSE(Inflater().Zlib(stream, longer));
  EXPECT_FALSE(Inflater().Zlib(stream, shorter));
  stream.back() ^= 1;
  EXPECT_FALSE(Inflater().Zlib(stream, right));
}

TEST(DeflateTest, TheWalkEndsWhereTheStreamDoes) {
  for (int kind = 0; kind < 5; ++kind) {
    for (const size_t size : {0u, 1u, 3u, 40u, 1000u, 100000u, 1000000u}) {
      Bytes stream;
      Deflater(6).Segment(Made(kind, size), true, stream);
      const auto tail = FindDeflateTail(stream);
      ASSERT_TRUE(tail) << kind << ", " << size;
      EXPECT_EQ((tail->end + 7) / 8, stream.size());
      EXPECT_EQ(stream[tail->last_block / 8] >> tail->last_block % 8 & 1, 1);
      // What follows belongs to somebody else.
      const size_t before = stream.size();
      stream.insert(stream.end(), 100, 0xFF);
      EXPECT_EQ(FindDeflateTail(stream)->end, tail->end);
      stream.resize(before > 1 ? before - 2 : 0);
      EXPECT_FALSE(FindDeflateTail(stream)) << kind << ", " << size;
    }
  }
}

TEST(DeflateTest, TheWalkOverRubbishEnds) {
  std::mt19937 random(1);
  Bytes good;
  Deflater(6).Segment(Made(3, 30000), true, good);
  for (int i = 0; i < 20000; ++i) {
    Bytes stream = good;
    if (i % 2 == 0) {
      stream.resize(random() % 300);
      for (uint8_t& b : stream) b = static_cast<uint8_t>(random());
    } else {
      for (int k = 0; k < 3; ++k)
        stream[random() % stream.size()] ^= static_cast<uint8_t>(1u << random() % 8);
    }
    const auto tail = FindDeflateTail(stream);
    if (tail) {
      EXPECT_LE(tail->end, stream.size() * 8);
    }
  }
}

TEST(PngRowsTest, UnfilteringUndoesFiltering) {
  std::mt19937 random(2);
  for (const size_t pixel : {1u, 2u, 3u, 4u, 6u, 8u}) {
    for (const size_t width : {1u, 2u, 5u, 100u, 401u}) {
      const size_t row = pixel * width;
      constexpr size_t kRows = 40;
      Bytes image(row * kRows), filtered;
      // Slopes of several kinds, so that every filter is the best of some rows.
      for (size_t i = 0; i < image.size(); ++i) {
        const size_t y = i / row, x = i % row / pixel;
        const size_t slopes[] = {0, 3 * x, 3 * y, 2 * x + 2 * y, x * y / 4, random()};
        image[i] = static_cast<uint8_t>(slopes[y / 2 % 6] + random() % 3);
      }
      PngRowFilter filter(row, pixel);
      for (size_t y = 0; y < kRows; ++y)
        filter.Filter(PngFilter::kAdaptive, &image[y * row], y > 0 ? &image[(y - 1) * row] : nullptr,
                      filtered);
      for (size_t y = 0; y < kRows; ++y) {
        uint8_t* const at = &filtered[y * (row + 1)];
        ASSERT_TRUE(PngUnfilter(at, y > 0 ? at - row : nullptr, row, pixel));
        ASSERT_TRUE(std::equal(at + 1, at + 1 + row, &image[y * row]))
            << pixel << ", " << width << ", row " << y;
      }
    }
  }
  uint8_t unknown[] = {5, 1, 2, 3};
  EXPECT_FALSE(PngUnfilter(unknown, unknown + 1, 3, 3));
}

}  // namespace
}  // namespace tessera::io
