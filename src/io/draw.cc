// OpenImageIO's functions on images in memory.
#include "tessera/draw.h"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>

#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/oiio_adapter.h"

namespace tessera {
namespace {

using OIIO::ImageBuf;
namespace ImageBufAlgo = OIIO::ImageBufAlgo;

// As many values as OpenImageIO looks at.
std::vector<float> Filled(const Image& image, std::vector<float> color) {
  color.resize(std::max(color.size(), static_cast<size_t>(image.spec().channel_count()) + 1), 1.0F);
  return color;
}

void Require(bool ok, const char* what, const ImageBuf& buffer) {
  if (!ok) throw DataError(what, io::OneLine(buffer.geterror()));
}

Image CopyOf(const ImageBuf& buffer, const ImageSpec& like) {
  ImageSpec spec(buffer.spec().width, buffer.spec().height, buffer.nchannels());
  spec.data_window = {buffer.spec().x, buffer.spec().y, buffer.spec().x + buffer.spec().width,
                      buffer.spec().y + buffer.spec().height};
  spec.display_window = spec.data_window;
  spec.channels = buffer.spec().channelnames;
  spec.alpha = -1;
  spec.metadata = like.metadata;
  const Image image = Image::Uninitialized(std::move(spec));
  Require(buffer.get_pixels(buffer.roi(), OIIO::TypeFloat, image.view().data), "pixels", buffer);
  return image;
}

template <typename Function>
Image Transformed(const Image& image, const char* name, const Function& function) {
  const auto buffer = ToImageBuf(image);
  const ImageBuf result = function(*buffer);
  if (result.has_error() || !result.initialized()) throw DataError(name, io::OneLine(result.geterror()));
  return CopyOf(result, image.spec());
}

void RequireComplex(const Image& image, const char* name) {
  if (image.spec().channel_count() != 2)
    throw DataError(name,
                    "found " + std::to_string(image.spec().channel_count()) + " channels, expected two");
}

}  // namespace

void DrawBox(const Image& image, int x1, int y1, int x2, int y2, const std::vector<float>& color, bool fill) {
  const auto buffer = ToImageBuf(image);
  Require(ImageBufAlgo::render_box(*buffer, x1, y1, x2, y2, Filled(image, color), fill), "box", *buffer);
}

void DrawLines(const Image& image, const std::vector<int>& points, const std::vector<float>& color) {
  const auto buffer = ToImageBuf(image);
  const std::vector<float> filled = Filled(image, color);
  const size_t n = points.size();
  const bool closed = n > 4 && points[0] == points[n - 2] && points[1] == points[n - 1];
  // A point that two lines share is drawn once.
  for (size_t i = 0; i + 3 < n; i += 2) {
    Require(ImageBufAlgo::render_line(*buffer, points[i], points[i + 1], points[i + 2], points[i + 3], filled,
                                      closed || i > 0),
            "line", *buffer);
  }
}

void DrawPoints(const Image& image, const std::vector<int>& points, const std::vector<float>& color) {
  const auto buffer = ToImageBuf(image);
  std::vector<float> filled = Filled(image, color);
  for (size_t i = 0; i + 1 < points.size(); i += 2)
    Require(ImageBufAlgo::render_point(*buffer, points[i], points[i + 1], filled), "point", *buffer);
}

void DrawText(const Image& image, const std::string& text, const TextStyle& style) {
  const auto buffer = ToImageBuf(image);
  const auto x = style.x_align == "right"    ? ImageBufAlgo::TextAlignX::Right
                 : style.x_align == "center" ? ImageBufAlgo::TextAlignX::Center
                                             : ImageBufAlgo::TextAlignX::Left;
  const auto y = style.y_align == "top"      ? ImageBufAlgo::TextAlignY::Top
                 : style.y_align == "bottom" ? ImageBufAlgo::TextAlignY::Bottom
                 : style.y_align == "center" ? ImageBufAlgo::TextAlignY::Center
                                             : ImageBufAlgo::TextAlignY::Baseline;
  // OpenImageIO's own choice is a font that few machines have.
  const std::vector<std::string> fonts =
      style.font.empty() ? std::vector<std::string>{"", "DejaVuSans", "LiberationSans-Regular", "FreeSans"}
                         : std::vector<std::string>{style.font};
  const std::vector<float> color = Filled(image, style.color);
  for (const std::string& font : fonts) {
    if (ImageBufAlgo::render_text(*buffer, style.x, style.y, text, style.size, font, color, x, y,
                                  style.shadow))
      return;
    if (font != fonts.back()) buffer->geterror();
  }
  Require(false, "text", *buffer);
}

Image FourierTransform(const Image& image) {
  return Transformed(image, "fft", [](const ImageBuf& in) { return ImageBufAlgo::fft(in); });
}

Image InverseFourierTransform(const Image& image) {
  RequireComplex(image, "ifft");
  return Transformed(image, "ifft", [](const ImageBuf& in) { return ImageBufAlgo::ifft(in); });
}

Image ToPolar(const Image& image) {
  RequireComplex(image, "polar");
  return Transformed(image, "polar", [](const ImageBuf& in) { return ImageBufAlgo::complex_to_polar(in); });
}

Image FromPolar(const Image& image) {
  RequireComplex(image, "unpolar");
  return Transformed(image, "unpolar", [](const ImageBuf& in) { return ImageBufAlgo::polar_to_complex(in); });
}

int64_t PerceptualDifferences(const Image& a, const Image& b) {
  ImageBufAlgo::CompareResults result;
  return ImageBufAlgo::compare_Yee(*ToImageBuf(a), *ToImageBuf(b), result);
}

}  // namespace tessera
