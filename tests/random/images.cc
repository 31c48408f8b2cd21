// What images hold and how they lie in memory.
#include "random/images.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <limits>

#include "base/block.h"
#include "graph/source.h"
#include "support/pictures.h"
#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/ops/channels.h"

namespace tessera::random {
namespace {

constexpr std::byte kGap{0xA5}, kUnwritten{0x5A};

// A 512x256 part of a photograph in float, or noise where the package with photographs is absent. Read once.
const Image& Photograph(uint32_t which) {
  static const std::vector<Image> parts = [] {
    std::vector<Image> read;
    for (const char* name : {"Garden.jpg", "LadyBird.jpg"}) {
      const std::filesystem::path file = std::filesystem::path("/usr/share/backgrounds/mate/nature") / name;
      if (!std::filesystem::exists(file)) continue;
      const Node photo = Read(file.string());
      const Roi& w = photo.spec().data_window;
      const int x = w.width() / 3, y = w.height() / 2;
      read.push_back(Render(Crop(photo, Roi{x, y, x + 512, y + 256}), PixelType::kFloat, {.threads = 1}));
    }
    if (read.empty()) {
      read.emplace_back(ImageSpec(512, 256, 3));
      Draw draw(1, 1);
      for (int i = 0; i < 512 * 256 * 3; ++i) {
        read[0].at<float>(i / 3 % 512, i / 3 / 512, i % 3) = static_cast<float>(draw.Unit());
      }
    }
    return read;
  }();
  return parts[which % parts.size()];
}

float HardValue(Draw& draw) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return draw.Of({std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, 0.0f, -0.0f, 1e-40f,
                  -1e-45f, 3.4e38f, -3.4e38f, 1.0f, 65504.0f, 65520.0f, 1e-30f, 0.5f});
}

float ValueAt(const Picture& p, Draw& draw, const float (&colors)[2][8], int x, int y, int c) {
  const int square = 1 + static_cast<int>(p.seed % 9);
  const int dx = x - p.window.x0, dy = y - p.window.y0;
  switch (p.content) {
    case Content::kFlat:
      return colors[0][c % 8];
    case Content::kChecker:
      return colors[(dx / square + dy / square) % 2][c % 8];
    case Content::kNoise:
      return static_cast<float>(draw.Unit());
    case Content::kWide:
      return static_cast<float>(draw.Real(-0.75, 1.75));
    case Content::kRamp:
      return (static_cast<float>(dx) + 0.25f * static_cast<float>(dy + c)) /
             static_cast<float>(p.window.width() + 1);
    case Content::kEdge:
      return dx * 3 + dy > static_cast<int>(p.seed % 3 + 1) * p.window.width() ? 1.0f : 0.0f;
    case Content::kTies:
      return static_cast<float>(draw.Below(1021) - 255) / 510.0f;
    case Content::kTiny:
      return std::ldexp(static_cast<float>(draw.Real(-1, 1)), -120 - draw.Below(28));
    case Content::kRare:
      return draw.Below(50) == 0 ? HardValue(draw) : static_cast<float>(draw.Unit());
    case Content::kSpecial:
      return draw.Below(3) == 0 ? HardValue(draw) : static_cast<float>(draw.Real(-0.75, 1.75));
    case Content::kPhotograph: {
      const Image& photo = Photograph(p.seed);
      const Roi& w = photo.spec().data_window;
      const int from_y = (dy + static_cast<int>(p.seed % 97)) % w.height();
      return c % 4 == 3 ? 1.0f : photo.at<float>(w.x0 + dx % w.width(), w.y0 + from_y, c % 4);
    }
    case Content::kCount:
      break;
  }
  return 0;
}

std::string SizeWords(const Roi& r) {
  char text[64];
  std::snprintf(text, sizeof text, "%dx%d%+d%+d", r.width(), r.height(), r.x0, r.y0);
  return text;
}

class StreamedSource final : public graph::PixelSource {
 public:
  explicit StreamedSource(Image image) : image_(std::move(image)) {}
  const ImageSpec& spec() const override { return image_.spec(); }
  std::string Describe() const override { return "stream"; }
  std::unique_ptr<graph::RowReader> Open(int first, int last) const override {
    return std::make_unique<Reader>(image_, first, last);
  }

 private:
  class Reader final : public graph::RowReader {
   public:
    Reader(Image image, int first, int last) : image_(std::move(image)), first_(first), last_(last) {}
    void Read(const ImageView& out) override {
      const Roi& r = out.roi;
      if (r.y0 < next_) throw Error("stream", "rows were read twice or backwards");
      if (!image_.spec().data_window.Contains(r) || out.channels != last_ - first_ ||
          out.type != image_.spec().type) {
        throw Error("stream", "was asked for what it does not have");
      }
      next_ = r.y1;
      ConstImageView from = image_.view();
      from.data = from.At(from.roi.x0, from.roi.y0, first_);
      from.channels = out.channels;
      CopySamples(from.Sub(r), out);
    }

   private:
    Image image_;
    int first_, last_, next_ = INT_MIN;
  };
  Image image_;
};

}  // namespace

const char* ContentName(Content content) {
  constexpr const char* kNames[] = {"flat", "checker", "noise", "wide",    "ramp",      "edge",
                                    "ties", "tiny",    "rare",  "special", "photograph"};
  static_assert(std::size(kNames) == static_cast<size_t>(Content::kCount));
  return kNames[static_cast<size_t>(content)];
}

bool IsOrdinary(Content content) {
  return content != Content::kTiny && content != Content::kRare && content != Content::kSpecial;
}

std::string Layout::Words() const {
  std::string words = planar ? "planar" : "interleaved";
  if (pixel_gap > 0) words += " pixels+" + std::to_string(pixel_gap);
  if (row_gap > 0) words += " rows+" + std::to_string(row_gap);
  if (misaligned > 0) words += " shifted " + std::to_string(misaligned);
  if (rows_up) words += " rows upwards";
  if (pixels_left) words += " pixels leftwards";
  return words;
}

Layout DrawLayout(Draw& draw) {
  Layout layout;
  if (draw.Chance(0.5)) return layout;
  layout.planar = draw.Chance(0.35);
  if (draw.Chance(0.35)) layout.pixel_gap = draw.Of({1, 2, 3, 4, 8, 12});
  if (draw.Chance(0.5)) layout.row_gap = draw.Of({1, 3, 4, 16, 50, 64});
  if (draw.Chance(0.3)) layout.misaligned = draw.Of({1, 2, 4, 16});
  layout.rows_up = draw.Chance(0.3);
  layout.pixels_left = draw.Chance(0.07);
  return layout;
}

std::string Picture::Words() const {
  return std::string(ContentName(content)) + "(" + std::to_string(seed) + ") " + SizeWords(window) + " " +
         std::to_string(channels) + " " + PixelTypeName(type) + " " + layout.Words();
}

Roi DrawWindow(Draw& draw) {
  int w = 1, h = 1;
  switch (draw.Weighted({38, 22, 14, 4, 4, 4, 14})) {
    case 0:
      w = draw.Between(1, 70), h = draw.Between(1, 24);
      break;
    case 1:  // about one or more blocks
      w = draw.Of({1, 2, 2, 3, 4}) * kBlockPixels + draw.Of({-1, 0, 0, 1, 7, 88}), h = draw.Between(1, 5);
      break;
    case 2:
      w = 4 * kBlockPixels + draw.Between(1, 140), h = draw.Between(1, 3);
      break;
    case 3:
      break;
    case 4:
      w = draw.Between(1, 600);
      break;
    case 5:
      h = draw.Between(1, 300);
      break;
    default:
      w = draw.Between(40, 130), h = draw.Between(10, 50);
  }
  const int x = draw.Chance(0.6) ? 0 : draw.Between(-40, 40),
            y = draw.Chance(0.6) ? 0 : draw.Between(-40, 40);
  return {x, y, x + w, y + h};
}

PixelType DrawType(Draw& draw) {
  constexpr PixelType kTypes[] = {PixelType::kFloat, PixelType::kUint8, PixelType::kUint16, PixelType::kHalf};
  return kTypes[draw.Weighted({40, 24, 16, 20})];
}

int DrawChannels(Draw& draw) { return draw.Of({4, 4, 4, 4, 4, 4, 4, 3, 3, 3, 1, 2, 5, 6}); }

Picture DrawPicture(Draw& draw, const Roi& window) {
  Picture p;
  p.window = window;
  p.channels = DrawChannels(draw);
  p.type = DrawType(draw);
  p.content = static_cast<Content>(draw.Weighted({5, 8, 24, 14, 6, 6, 6, 3, 6, 8, 14}));
  p.seed = static_cast<uint32_t>(draw.Below(1000));
  p.layout = DrawLayout(draw);
  return p;
}

Pixels::Pixels(const Roi& roi, int channels, PixelType type, const Layout& layout) {
  const auto size = static_cast<ptrdiff_t>(PixelBytes(type));
  const ptrdiff_t w = roi.width(), h = roi.height();
  ptrdiff_t channel_stride = size, pixel_stride = size * channels + layout.pixel_gap;
  ptrdiff_t row_stride = pixel_stride * w + layout.row_gap;
  ptrdiff_t total = row_stride * h;
  if (layout.planar) {
    pixel_stride = size + layout.pixel_gap;
    row_stride = pixel_stride * w + layout.row_gap;
    channel_stride = row_stride * h;
    total = channel_stride * channels;
  }
  // Exactly as long as needed, so that address sanitizers see what is read beyond the last pixel.
  total += layout.misaligned - (total > 0 ? layout.pixel_gap + layout.row_gap : 0);
  bytes_ = std::make_shared<std::vector<std::byte>>(static_cast<size_t>(std::max<ptrdiff_t>(total, 1)), kGap);
  std::byte* first = bytes_->data() + layout.misaligned;
  if (layout.rows_up && h > 0) first += row_stride * (h - 1), row_stride = -row_stride;
  if (layout.pixels_left && w > 0) first += pixel_stride * (w - 1), pixel_stride = -pixel_stride;
  view_ = ImageView(first, roi, channels, type, channel_stride, pixel_stride, row_stride);
}

void Pixels::Scribble() const {
  const Roi& r = view_.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < view_.channels; ++c) {
        std::fill_n(view_.At(x, y, c), PixelBytes(view_.type), kUnwritten);
      }
    }
  }
}

bool Pixels::GapsAreWhole() const {
  std::vector<bool> owned(bytes_->size());
  const Roi& r = view_.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < view_.channels; ++c) {
        const auto at = static_cast<size_t>(view_.At(x, y, c) - bytes_->data());
        for (size_t i = 0; i < PixelBytes(view_.type); ++i) owned[at + i] = true;
      }
    }
  }
  for (size_t i = 0; i < owned.size(); ++i) {
    if (!owned[i] && (*bytes_)[i] != kGap) return false;
  }
  return true;
}

Pixels Paint(const Picture& p) {
  Pixels pixels(p.window, p.channels, p.type, p.layout);
  Draw draw(p.seed, 77);
  float colors[2][8];
  for (auto& color : colors) {
    for (float& v : color) v = static_cast<float>(draw.Below(256)) / 255.0f;
  }
  // Strides of any number of bytes: samples are stored densely first.
  const Pixels one({0, 0, 1, 1}, 1, p.type, {});
  for (int y = p.window.y0; y < p.window.y1; ++y) {
    for (int x = p.window.x0; x < p.window.x1; ++x) {
      for (int c = 0; c < p.channels; ++c) {
        testing::StoreSample(one.view(), 0, 0, 0, ValueAt(p, draw, colors, x, y, c));
        std::memcpy(pixels.view().At(x, y, c), one.view().data, PixelBytes(p.type));
      }
    }
  }
  return pixels;
}

ImageSpec SpecOf(const Picture& p) {
  ImageSpec spec(p.window.width(), p.window.height(), p.channels, p.type);
  spec.data_window = spec.display_window = p.window;
  return spec;
}

void CopySamples(const ConstImageView& from, const ImageView& to) {
  const Roi& r = to.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < to.channels; ++c) {
        std::memcpy(to.At(x, y, c), from.At(x, y, c), PixelBytes(to.type));
      }
    }
  }
}

Node Streamed(const Image& image) {
  return graph::MakeNode(
      std::make_shared<const graph::SourceOp>(std::make_shared<const StreamedSource>(image)), {});
}

}  // namespace tessera::random
