// Files written and read by our codecs and by OpenImageIO, side by side.
#ifndef TESSERA_TESTS_IO_CODEC_FILES_H_
#define TESSERA_TESTS_IO_CODEC_FILES_H_

#include <random>

#include "files.h"
#include "outcome.h"

namespace tessera::testing_io {

// All that OpenImageIO says of a file, and its pixels as they are stored.
struct Seen {
  std::string text;
  std::vector<unsigned char> pixels;
  bool operator==(const Seen&) const = default;
};
inline Seen See(const std::string& file) {
  OIIO::ImageSpec raw;
  raw.attribute("oiio:UnassociatedAlpha", 1);
  const auto input = OIIO::ImageInput::open(file, &raw);
  EXPECT_TRUE(input) << OIIO::geterror();
  if (!input) return {};
  Seen seen{input->spec().serialize(OIIO::ImageSpec::SerialText, OIIO::ImageSpec::SerialDetailedHuman), {}};
  seen.pixels.resize(input->spec().image_bytes(true));
  EXPECT_TRUE(input->read_image(0, 0, 0, -1, OIIO::TypeDesc::UNKNOWN, seen.pixels.data()))
      << input->geterror();
  return seen;
}

inline std::vector<std::byte> PixelsOf(const Node& node, int first, int last, int rows, int threads = 2,
                                       size_t memory = size_t{1} << 27) {
  const ImageSpec& spec = node.spec();
  const auto reader = SourceOf(node).Open(first, last);
  reader->Limit(threads, memory);
  const size_t row =
      PixelBytes(spec.type) * static_cast<size_t>(last - first) * static_cast<size_t>(spec.width());
  std::vector<std::byte> pixels(row * static_cast<size_t>(spec.height()));
  const ImageView all(pixels.data(), spec.data_window, last - first, spec.type);
  for (int y = spec.data_window.y0; y < spec.data_window.y1; y += rows)
    reader->Read(
        all.Sub({spec.data_window.x0, y, spec.data_window.x1, std::min(y + rows, spec.data_window.y1)}));
  return pixels;
}

inline bool IsOurs(const std::string& text) { return text.find("the codec") != std::string::npos; }

inline std::string HowWritten(const Node& node, const std::string& file, WriteOptions options) {
  RunStats stats;
  options.stats = &stats;
  Write(node, file, options);
  return stats.files.back();
}

inline Attribute Text(const std::string& name, const std::string& value) {
  return {name, "string", {}, {value}};
}
inline Attribute Number(const std::string& name, int value) {
  Attribute a{name, "int", std::vector<std::byte>(sizeof value), {}};
  std::memcpy(a.bytes.data(), &value, sizeof value);
  return a;
}

class CodecTest : public FileTest {
 protected:
  // Writes `image` both ways and reads both files both ways. The files are read whole, in bands that fit
  // nothing, and channel by channel.
  void ExpectSame(const Image& image, const std::string& extension,
                  const std::vector<Attribute>& attributes = {}) {
    const Node node = FromImage(image);
    const std::string ours = Path("ours" + extension), theirs = Path("theirs" + extension);
    WriteOptions options;
    options.attributes = attributes;
    options.render.threads = 2;
    EXPECT_TRUE(IsOurs(HowWritten(node, ours, options)));
    options.codec = Codec::kOpenImageIO;
    EXPECT_FALSE(IsOurs(HowWritten(node, theirs, options)));
    EXPECT_EQ(See(ours), See(theirs));
    ExpectReadTheSame(ours);
    ExpectReadTheSame(theirs);
  }

  // Whole, in bands that fit nothing, and channel by channel.
  void ExpectReadTheSame(const std::string& file, int part = 0) {
    const Node fast = Read(file, {.subimage = part});
    const Node slow = Read(file, {.subimage = part, .codec = Codec::kOpenImageIO});
    EXPECT_TRUE(IsOurs(SourceOf(fast).Decoder())) << SourceOf(fast).Decoder();
    EXPECT_FALSE(IsOurs(SourceOf(slow).Decoder()));
    const int channels = fast.spec().channel_count(), height = fast.spec().height();
    const auto expected = PixelsOf(slow, 0, channels, height);
    EXPECT_EQ(PixelsOf(fast, 0, channels, height), expected);
    EXPECT_TRUE(IsOurs(SourceOf(fast).Decoder())) << "given up: " << SourceOf(fast).Decoder();
    EXPECT_EQ(PixelsOf(fast, 0, channels, 7, 1), expected);
    EXPECT_EQ(PixelsOf(fast, 0, channels, 7, 2, 1), expected) << "without memory";
    for (int c = 0; c < channels; ++c)
      EXPECT_EQ(PixelsOf(fast, c, c + 1, 5), PixelsOf(slow, c, c + 1, height)) << c;
  }

  // Flips bits and cuts the end off `file`: what OpenImageIO reads is read the same, what it refuses is
  // refused.
  void ExpectSameRefusals(const std::string& file, int attempts, bool checked = true) {
    const std::string good = Contents(file),
                      bad = Path("bad" + std::filesystem::path(file).extension().string());
    std::mt19937 random(3);
    const std::string undamaged = OutcomeOf(file, Codec::kOpenImageIO);
    int refused = 0;
    for (int i = 0; i < attempts; ++i) {
      std::string bytes = good;
      if (i % 4 == 0) {
        bytes.resize(random() % good.size());
      } else {
        for (unsigned k = 0; k <= random() % 3; ++k)
          bytes[random() % bytes.size()] ^= static_cast<char>(1u << random() % 8);
      }
      SetContents(bad, bytes);
      const std::string theirs = OutcomeOf(bad, Codec::kOpenImageIO), ours = OutcomeOf(bad, Codec::kAuto);
      // OpenEXR gives another reason from run to run; libdeflate reads what zlib finds fault with where the
      // checksum is right; and what has no checksum may be rubbish of another kind.
      const bool refuses = IsRefusal(theirs, bad), refused_by_us = IsRefusal(ours, bad);
      EXPECT_TRUE(ours == theirs || ours == undamaged || (refuses && refused_by_us) ||
                  (!checked && !refuses && !refused_by_us))
          << "attempt " << i << ": " << theirs.substr(0, 200) << " / " << ours.substr(0, 200);
      refused += refuses;
    }
    EXPECT_GE(refused, attempts / 4);
  }
};

inline Image Picture(int width, int height, int channels, PixelType type) {
  ImageSpec spec(width, height, channels, type);
  if (channels % 2 == 0) spec.alpha = channels - 1;
  return Pattern(spec);
}

// Values that compress in different ways: noise, slopes, runs.
inline void Vary(Image& image) {
  std::mt19937 random(4);
  const ImageView view = image.view();
  const Roi& w = view.roi;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < view.channels; ++c) {
        const float slope = static_cast<float>(x + 2 * y) / 64,
                    noise = static_cast<float>(random() % 1024) / 1024;
        const float value = y % 16 < 5 ? slope : y % 16 < 9 ? noise : c == 0 ? 0.25f : slope * noise;
        if (view.type == PixelType::kFloat) {
          std::memcpy(view.At(x, y, c), &value, sizeof value);
        } else {
          const auto code = static_cast<uint16_t>(0x2000 + static_cast<int>(value * 1000) % 0x3000);
          std::memcpy(view.At(x, y, c), &code, sizeof code);
        }
      }
    }
  }
}

// OpenImageIO writes the time of day otherwise.
inline const Attribute kDate = Text("DateTime", "2020:02:03 04:05:06");

}  // namespace tessera::testing_io

#endif  // TESSERA_TESTS_IO_CODEC_FILES_H_
