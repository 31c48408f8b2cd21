// What the file tests share: a directory that goes away, pictures written with OpenImageIO alone, exact
// expectations.
#ifndef TESSERA_TESTS_IO_FILES_H_
#define TESSERA_TESTS_IO_FILES_H_

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "graph/source.h"
#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/io.h"

namespace tessera::testing_io {

class FileTest : public ::testing::Test {
 protected:
  FileTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "tessera-io-XXXXXX").string();
    directory_ = ::mkdtemp(pattern.data());
  }
  ~FileTest() override { std::filesystem::remove_all(directory_); }

  std::string Path(const std::string& name) const { return (directory_ / name).string(); }
  // Names in the directory, hidden ones included.
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }

 private:
  std::filesystem::path directory_;
};

inline std::string Contents(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
inline void SetContents(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

// Bytes of a sample that name its place, so that a wrong row, column or channel shows. Floating types get
// finite values; one-byte types repeat after 256.
inline std::vector<std::byte> Sample(PixelType type, int x, int y, int c) {
  const unsigned code = static_cast<unsigned>(x * 7 + y * 131 + c * 3571);
  std::vector<std::byte> bytes(PixelBytes(type));
  switch (type) {
    case PixelType::kUint8: {
      const auto v = static_cast<uint8_t>(code % 251);
      std::memcpy(bytes.data(), &v, 1);
      break;
    }
    case PixelType::kUint16: {
      const auto v = static_cast<uint16_t>(code % 65521);
      std::memcpy(bytes.data(), &v, 2);
      break;
    }
    case PixelType::kHalf: {
      const auto v = static_cast<uint16_t>(0x2000 + code % 0x3000);  // normal numbers below 8192
      std::memcpy(bytes.data(), &v, 2);
      break;
    }
    case PixelType::kFloat: {
      const float v = static_cast<float>(code) / 1024 - 3;
      std::memcpy(bytes.data(), &v, 4);
      break;
    }
  }
  return bytes;
}

inline void Fill(const ImageView& view, int first = 0) {
  for (int y = view.roi.y0; y < view.roi.y1; ++y) {
    for (int x = view.roi.x0; x < view.roi.x1; ++x) {
      for (int c = 0; c < view.channels; ++c) {
        std::memcpy(view.At(x, y, c), Sample(view.type, x, y, c + first).data(), PixelBytes(view.type));
      }
    }
  }
}

// Samples of `view` that are not Sample(x, y, c + first).
inline int64_t Wrong(const ConstImageView& view, int first = 0) {
  int64_t wrong = 0;
  for (int y = view.roi.y0; y < view.roi.y1; ++y) {
    for (int x = view.roi.x0; x < view.roi.x1; ++x) {
      for (int c = 0; c < view.channels; ++c) {
        wrong += std::memcmp(view.At(x, y, c), Sample(view.type, x, y, c + first).data(),
                             PixelBytes(view.type)) != 0;
      }
    }
  }
  return wrong;
}

inline Image Pattern(const ImageSpec& spec) {
  Image image(spec);
  Fill(image.view());
  return image;
}

// Writes the pattern with OpenImageIO alone; the spec's windows, tiles, names and metadata as given.
inline void WritePattern(const std::string& file, const std::vector<OIIO::ImageSpec>& parts) {
  auto output = OIIO::ImageOutput::create(file);
  ASSERT_TRUE(output) << OIIO::geterror();
  for (size_t i = 0; i < parts.size(); ++i) {
    const OIIO::ImageSpec& s = parts[i];
    const bool open = i > 0              ? output->open(file, s, OIIO::ImageOutput::AppendSubimage)
                      : parts.size() > 1 ? output->open(file, static_cast<int>(parts.size()), parts.data())
                                         : output->open(file, s);
    ASSERT_TRUE(open) << output->geterror();
    const PixelType type = *io::PixelTypeOf(s.format);
    // OpenImageIO 2.4's writer of HEIF reads rows as long as the codec's own, the last one too.
    std::vector<std::byte> pixels(s.image_bytes() + 256);
    Fill(ImageView(pixels.data(), {s.x, s.y, s.x + s.width, s.y + s.height}, s.nchannels, type),
         static_cast<int>(100 * i));
    ASSERT_TRUE(output->write_image(s.format, pixels.data())) << output->geterror();
  }
  ASSERT_TRUE(output->close()) << output->geterror();
}

inline const graph::PixelSource& SourceOf(const Node& node) {
  return dynamic_cast<const graph::SourceOp&>(*node.data()->op).source();
}

// Reads [first, last) of a file node in bands of `rows`, rows padded to a stride of its own.
inline std::vector<std::byte> ReadRows(const Node& node, int first, int last, int rows,
                                       ConstImageView* view) {
  const ImageSpec& spec = node.spec();
  const auto reader = SourceOf(node).Open(first, last);
  const size_t pixel = PixelBytes(spec.type) * static_cast<size_t>(last - first);
  const size_t stride = pixel * static_cast<size_t>(spec.width()) + 24;
  std::vector<std::byte> pixels(stride * static_cast<size_t>(spec.height()), std::byte{0xA5});
  const ImageView all(pixels.data(), spec.data_window, last - first, spec.type,
                      static_cast<ptrdiff_t>(PixelBytes(spec.type)), static_cast<ptrdiff_t>(pixel),
                      static_cast<ptrdiff_t>(stride));
  for (int y = spec.data_window.y0; y < spec.data_window.y1; y += rows) {
    reader->Read(all.Sub({spec.data_window.x0, y, spec.data_window.x1, y + rows}));
  }
  for (int y = 0; y < spec.height(); ++y) {  // nothing is written between rows
    for (size_t i = stride - 24; i < stride; ++i)
      EXPECT_EQ(pixels[static_cast<size_t>(y) * stride + i], std::byte{0xA5});
  }
  *view = all;
  return pixels;
}

// The message of the Error that `call` throws; fails the test when it throws none or one of several lines.
template <typename Call>
std::string ErrorOf(Call&& call) {
  try {
    call();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), ::testing::Not(::testing::HasSubstr("\n")));
    return e.what();
  }
  ADD_FAILURE() << "no Error was thrown";
  return "";
}

}  // namespace tessera::testing_io

#endif  // TESSERA_TESTS_IO_FILES_H_
