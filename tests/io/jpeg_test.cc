// JPEG at a fraction of its size: what is kept, what it is off a full decode that is filtered down,
// progressive files without the scans that do not count, damaged files.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

// Needs <cstdio>.
#include <jpeglib.h>

#include "codec_files.h"
#include "io/codec/jpeg_read.h"
#include "support/run_command.h"
#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/ops/geometry.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

struct Shape {
  int width, height, channels;
  int samples;  // of luma for one of chroma, across and down
  bool progressive;
};

// Something like a photograph: shading, edges, grain.
void WriteJpeg(const std::string& file, const Shape& shape) {
  jpeg_compress_struct jpeg;
  jpeg_error_mgr errors;
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  std::FILE* const stream = std::fopen(file.c_str(), "wb");
  jpeg_stdio_dest(&jpeg, stream);
  jpeg.image_width = static_cast<unsigned>(shape.width);
  jpeg.image_height = static_cast<unsigned>(shape.height);
  jpeg.input_components = shape.channels;
  jpeg.in_color_space = shape.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 92, TRUE);
  if (shape.channels == 3) jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = shape.samples;
  if (shape.progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  const std::string comment = "a comment";
  jpeg_write_marker(&jpeg, JPEG_COM, reinterpret_cast<const JOCTET*>(comment.data()), 9);
  uint32_t state = 1;
  std::vector<JSAMPLE> row(static_cast<size_t>(shape.width * shape.channels));
  for (int y = 0; y < shape.height; ++y) {
    for (int x = 0; x < shape.width; ++x) {
      for (int c = 0; c < shape.channels; ++c) {
        state ^= state << 13, state ^= state >> 17, state ^= state << 5;
        const double u = (x + 0.5) / shape.width, v = (y + 0.5) / shape.height;
        const bool disc = std::hypot(u - 0.6, v - 0.4) < 0.25;
        const double value = 110 + 80 * std::sin(5 * u + 3 * v + c) + (disc ? 45 : 0) + (state >> 28) - 8.0;
        row[static_cast<size_t>(x * shape.channels + c)] = static_cast<JSAMPLE>(std::lround(value));
      }
    }
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&jpeg, &pointer, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::fclose(stream);
}

// What libjpeg makes of all scans.
std::vector<JSAMPLE> Decoded(const std::string& file, int divisor) {
  jpeg_decompress_struct jpeg;
  jpeg_error_mgr errors;
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_decompress(&jpeg);
  std::FILE* const stream = std::fopen(file.c_str(), "rb");
  jpeg_stdio_src(&jpeg, stream);
  jpeg_read_header(&jpeg, TRUE);
  jpeg.scale_num = 1;
  jpeg.scale_denom = static_cast<unsigned>(divisor);
  jpeg_start_decompress(&jpeg);
  const size_t row = jpeg.output_width * static_cast<size_t>(jpeg.output_components);
  std::vector<JSAMPLE> samples(row * jpeg.output_height);
  for (JSAMPROW at = samples.data(); jpeg.output_scanline < jpeg.output_height; at += row)
    jpeg_read_scanlines(&jpeg, &at, 1);
  jpeg_finish_decompress(&jpeg);
  jpeg_destroy_decompress(&jpeg);
  std::fclose(stream);
  return samples;
}

class JpegTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (directory_.path() / name).string(); }
  static Node Reduced(const std::string& file, int width, int height) {
    ReadOptions options;
    options.enough_width = width, options.enough_height = height;
    return Read(file, options);
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(JpegTest, PixelsAreThoseOfLibjpegAtThatScale) {
  const std::string file = Path("a.jpg");
  for (const int channels : {1, 3}) {
    for (const int samples : {1, 2}) {
      for (const bool progressive : {false, true}) {
        WriteJpeg(file, {333, 211, channels, samples, progressive});
        for (const int divisor : {1, 2, 4, 8}) {
          SCOPED_TRACE(std::to_string(channels) + " " + std::to_string(samples) + " " +
                       std::to_string(progressive) + " 1/" + std::to_string(divisor));
          const int width = (332 + divisor) / divisor, height = (210 + divisor) / divisor;
          const Node node = Reduced(file, width, height);
          ASSERT_EQ(node.spec().width(), width);
          ASSERT_EQ(node.spec().height(), height);
          EXPECT_EQ(node.spec().display_window, node.spec().data_window);
          const Image image = Render(node, PixelType::kUint8);
          const std::vector<JSAMPLE> expected = Decoded(file, divisor);
          int wrong = 0;
          for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
              for (int c = 0; c < channels; ++c)
                wrong += image.at<uint8_t>(x, y, c) !=
                         expected[static_cast<size_t>((y * width + x) * channels + c)];
            }
          }
          EXPECT_EQ(wrong, 0);
        }
        // One channel alone, and the same metadata as without.
        const Node part = Reduced(file, 40, 20), whole = Read(file);
        EXPECT_EQ(part.spec().channels, whole.spec().channels);
        ASSERT_EQ(part.spec().metadata->size(), whole.spec().metadata->size());
        for (size_t i = 0; i < part.spec().metadata->size(); ++i)
          EXPECT_EQ((*part.spec().metadata)[i].name, (*whole.spec().metadata)[i].name);
      }
    }
  }
}

// The whole of it by our way and by OpenImageIO's: header, pixels, one channel alone.
TEST_F(JpegTest, WholeFilesAreOpenImageIOs) {
  const std::string file = Path("a.jpg");
  for (const int channels : {1, 3}) {
    for (const int samples : {1, 2}) {
      for (const bool progressive : {false, true}) {
        for (const auto& [width, height] : {std::pair{1, 1}, {17, 9}, {333, 211}}) {
          WriteJpeg(file, {width, height, channels, samples, progressive});
          const Node ours = Read(file), theirs = Read(file, {.codec = Codec::kOpenImageIO});
          EXPECT_EQ(testing_io::SourceOf(ours).Decoder(), "the codec jpeg");
          EXPECT_EQ(testing_io::OutcomeOf(file, Codec::kAuto, 1),
                    testing_io::OutcomeOf(file, Codec::kOpenImageIO, 1));
          EXPECT_EQ(testing_io::PixelsOf(ours, channels - 1, channels, 1),
                    testing_io::PixelsOf(theirs, channels - 1, channels, 1));
          ASSERT_EQ(ours.spec().metadata->size(), theirs.spec().metadata->size());
          for (size_t i = 0; i < ours.spec().metadata->size(); ++i) {
            EXPECT_EQ((*ours.spec().metadata)[i].name, (*theirs.spec().metadata)[i].name);
            EXPECT_EQ((*ours.spec().metadata)[i].bytes, (*theirs.spec().metadata)[i].bytes);
          }
        }
      }
    }
  }
}

// What libjpeg only warns of is OpenImageIO's to judge.
TEST_F(JpegTest, DamagedFilesAreOpenImageIOsToJudge) {
  for (const bool progressive : {false, true}) {
    WriteJpeg(Path("a.jpg"), {160, 120, 3, 2, progressive});
    const std::string bytes = testing::FileText(Path("a.jpg"));
    for (size_t at = 2; at < bytes.size(); at += at < 700 ? 3 : 1 + bytes.size() / 97) {
      std::string other = bytes;
      other[at] = static_cast<char>(other[at] ^ 0x55);
      std::ofstream(Path("b.jpg"), std::ios::binary) << other;
      const std::string ours = testing_io::OutcomeOf(Path("b.jpg"), Codec::kAuto, 1),
                        theirs = testing_io::OutcomeOf(Path("b.jpg"), Codec::kOpenImageIO, 1);
      // The rows that are named are those that were asked for at once.
      if (testing_io::IsRefusal(ours, Path("b.jpg")) && testing_io::IsRefusal(theirs, Path("b.jpg")))
        continue;
      EXPECT_TRUE(ours == theirs) << at << " " << progressive << " " << ours.substr(0, 200);
    }
  }
}

TEST_F(JpegTest, TypeIsKnownBeforeAFileIsThere) {
  WriteJpeg(Path("a.jpg"), {16, 16, 3, 1, false});
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    WriteOptions options;
    options.type = type;
    const Node node = Read(Path("a.jpg"));
    PendingOutput output(node, Path("b.jpg"), options);
    EXPECT_EQ(StoredType(node, Path("b.jpg"), options), output.type());
  }
  EXPECT_THROW(StoredType(Read(Path("a.jpg")), Path("missing/b.jpg")), Error);
}

TEST_F(JpegTest, SidesStayAsLargeAsAskedFor) {
  WriteJpeg(Path("a.jpg"), {333, 211, 3, 2, false});
  const auto width = [&](int w, int h) { return Reduced(Path("a.jpg"), w, h).spec().width(); };
  EXPECT_EQ(width(42, 27), 42);
  EXPECT_EQ(width(43, 27), 84);
  EXPECT_EQ(width(42, 28), 84);
  EXPECT_EQ(width(85, 1), 167);
  EXPECT_EQ(width(168, 1), 333);
  EXPECT_EQ(width(1000, 1000), 333);
  EXPECT_EQ(Read(Path("a.jpg")).spec().width(), 333);
}

// The stated figures, of codes of 255.
TEST_F(JpegTest, ErrorOfAThumbnail) {
  for (const Shape& shape : {Shape{1600, 1200, 3, 2, false}, Shape{1603, 1201, 3, 2, true},
                             Shape{1600, 1200, 3, 1, false}, Shape{1601, 1207, 1, 1, false}}) {
    WriteJpeg(Path("a.jpg"), shape);
    for (const int width : {400, 256, 128, 64}) {
      ResizeParams size;
      size.width = width, size.height = width * 3 / 4;
      const Image whole = Render(Resize(Read(Path("a.jpg")), size), PixelType::kUint8),
                  fast = Render(Resize(Reduced(Path("a.jpg"), 2 * size.width, 2 * size.height), size),
                                PixelType::kUint8);
      double sum = 0, largest = 0;
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          for (int c = 0; c < shape.channels; ++c) {
            const double d = std::abs(whole.at<uint8_t>(x, y, c) - fast.at<uint8_t>(x, y, c));
            sum += d, largest = std::max(largest, d);
          }
        }
      }
      const double mean = sum / (size.width * size.height * shape.channels);
      std::printf("%dx%d, %d samples, to %d: mean %.2f, largest %.0f of 255\n", shape.width, shape.height,
                  shape.samples, width, mean, largest);
      EXPECT_LT(mean, 1.0);
      EXPECT_LE(largest, 16);
    }
  }
}

TEST_F(JpegTest, DamagedFilesAreRefused) {
  for (const bool progressive : {false, true}) {
    WriteJpeg(Path("a.jpg"), {640, 480, 3, 2, progressive});
    const std::string bytes = testing::FileText(Path("a.jpg"));
    for (size_t size = 3; size < bytes.size(); size += 1 + bytes.size() / 97) {
      std::ofstream(Path("b.jpg"), std::ios::binary) << bytes.substr(0, size);
      EXPECT_THROW(Render(Reduced(Path("b.jpg"), 80, 60)), Error) << size;
    }
    // Any byte may be another: a picture of that size, or a refusal.
    for (size_t at = 2; at < bytes.size(); at += at < 700 ? 1 : 1 + bytes.size() / 97) {
      std::string other = bytes;
      other[at] = static_cast<char>(other[at] ^ 0x55);
      std::ofstream(Path("b.jpg"), std::ios::binary) << other;
      try {
        Render(Reduced(Path("b.jpg"), 80, 60));
      } catch (const Error& e) {
        EXPECT_THAT(e.what(), HasSubstr("b.jpg"));
      }
    }
  }
}

TEST_F(JpegTest, CoarseFilesAreSmallerAndOfProgressiveOnesAlone) {
  const auto coarse = [&](bool progressive) {
    WriteJpeg(Path("a.jpg"), {640, 480, 3, 2, progressive});
    const std::string text = testing::FileText(Path("a.jpg"));
    const std::vector<uint8_t> bytes(text.begin(), text.end());
    const auto found = io::CoarseJpeg(bytes);
    return found ? static_cast<double>(found->size()) / static_cast<double>(bytes.size()) : 1;
  };
  EXPECT_EQ(coarse(false), 1);
  EXPECT_LT(coarse(true), 0.5);
}

}  // namespace
}  // namespace tessera
