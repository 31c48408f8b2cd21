// A contact sheet of hue rotations, twelve cells rendered straight into one picture.   hue_wheel OUT [IMAGE]
// Without an image it draws a colour wheel. Cells are thumbnails made of strided views: no pixel is copied.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tessera/tessera.h"

namespace {

using tessera::Image;
using tessera::ImageSpec;
using tessera::Node;
using tessera::Roi;

constexpr int kColumns = 4, kRows = 3, kGap = 8, kCellWidth = 320;

// A disc of all hues on a grey ground that grows brighter downwards, drawn sample by sample with plain code.
Image ColorWheel(int width, int height) {
  Image image(ImageSpec(width, height, 3));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dx = x + 0.5 - width / 2.0, dy = y + 0.5 - height / 2.0;
      const double radius = std::hypot(dx, dy) / (0.46 * height), angle = std::atan2(-dy, dx);
      const double edge = std::clamp((1 - radius) * 0.46 * height, 0.0, 1.0);
      const double chroma = 0.42 * std::min(radius, 1.0), ground = 0.06 + 0.1 * y / height;
      for (int c = 0; c < 3; ++c) {
        const double disc = 0.5 + chroma * std::cos(angle - 2 * std::numbers::pi / 3 * c);
        image.at<float>(x, y, c) = static_cast<float>(ground + edge * (disc - ground));
      }
    }
  }
  return image;
}

// The mean of factor x factor pixels, as a sum of views that each see every factor-th pixel.
Node Thumbnail(const Image& image, int factor) {
  const Roi all = image.spec().data_window;
  const ImageSpec small(all.width() / factor, all.height() / factor, image.spec().channel_count());
  Node sum;
  for (int y = 0; y < factor; ++y) {
    for (int x = 0; x < factor; ++x) {
      tessera::ConstImageView view = image.view();
      view.data = image.view().At(all.x0 + x, all.y0 + y);
      view.roi = small.data_window;
      view.pixel_stride *= factor;
      view.row_stride *= factor;
      const Node part = tessera::FromView(view, small);
      sum = sum ? tessera::Add(sum, part) : part;
    }
  }
  return tessera::MulConstant(sum, {1.0 / (factor * factor)});
}

double MeanLuminance(const Node& node) {
  const Image grey = tessera::Render(tessera::Luminance(node));
  const Roi r = grey.spec().data_window;
  double sum = 0;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) sum += grey.at<float>(x, y);
  }
  return sum / static_cast<double>(r.pixels());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: hue_wheel OUT [IMAGE]\n");
    return 2;
  }
  try {
    const Image image = argc == 3 ? tessera::Render(tessera::SelectChannels(tessera::Read(argv[2]), "R,G,B"))
                                  : ColorWheel(2 * kCellWidth, 2 * kCellWidth * 5 / 8);
    const Node cell = Thumbnail(image, std::clamp(image.spec().width() / kCellWidth, 1, 8));
    const int width = cell.spec().width(), height = cell.spec().height();
    const double luminance = MeanLuminance(cell);

    const Image sheet(ImageSpec(kColumns * (width + kGap) + kGap, kRows * (height + kGap) + kGap, 3,
                                tessera::PixelType::kUint8));
    for (int i = 0; i < kColumns * kRows; ++i) {
      const Node turned = tessera::RotateHue(cell, tessera::Degrees(i * 360.0 / (kColumns * kRows)));
      if (std::abs(MeanLuminance(turned) - luminance) > 1e-6) {
        std::printf("cell %d: mean luminance %.9g, expected %.9g\n", i, MeanLuminance(turned), luminance);
        return 1;
      }
      // The cell's window on the sheet, seen as the whole of the node's data window.
      const int x = kGap + i % kColumns * (width + kGap), y = kGap + i / kColumns * (height + kGap);
      tessera::ImageView window = sheet.view().Sub({x, y, x + width, y + height});
      window.roi = cell.spec().data_window;
      tessera::RenderInto(turned, window);
    }
    tessera::Write(tessera::FromImage(sheet), argv[1]);
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "hue_wheel: %s\n", error.what());
    return 1;
  }
  return 0;
}
