// The table of pixel formats, put together from what their names are put together from.
#include "io/video/pixel_format.h"

#include <algorithm>

namespace tessera::io {
namespace {

PixelType TypeOf(int bits) { return bits > 8 ? PixelType::kUint16 : PixelType::kUint8; }

void AddInterleaved(std::vector<PixelFormat>& all) {
  const auto add = [&](const char* name, Samples samples, const char* order, PixelType type) {
    const int bits = type == PixelType::kUint8 ? 8 : type == PixelType::kFloat ? 32 : 16;
    all.push_back({name, samples, order, type, bits});
  };
  using enum PixelType;
  for (const auto& [name, order] : {std::pair{"rgb24", "RGB"},
                                    {"bgr24", "BGR"},
                                    {"rgba", "RGBA"},
                                    {"bgra", "BGRA"},
                                    {"argb", "ARGB"},
                                    {"abgr", "ABGR"}})
    add(name, Samples::kRgb, order, kUint8);
  for (const auto& [name, order] :
       {std::pair{"rgb48le", "RGB"}, {"bgr48le", "BGR"}, {"rgba64le", "RGBA"}, {"bgra64le", "BGRA"}})
    add(name, Samples::kRgb, order, kUint16);
  add("rgbf16le", Samples::kRgb, "RGB", kHalf);
  add("rgbaf16le", Samples::kRgb, "RGBA", kHalf);
  add("rgbf32le", Samples::kRgb, "RGB", kFloat);
  add("rgbaf32le", Samples::kRgb, "RGBA", kFloat);
  add("ya8", Samples::kGrey, "YA", kUint8);
  add("ya16le", Samples::kGrey, "YA", kUint16);
}

void AddPlanar(std::vector<PixelFormat>& all) {
  const auto add = [&](const std::string& stem, Samples samples, const char* order, bool half_width,
                       bool half_height) {
    for (const int bits : {8, 9, 10, 12, 14, 16}) {
      const std::string depth = bits == 8 ? "" : std::to_string(bits) + "le";
      all.push_back({stem + depth, samples, order, TypeOf(bits), bits, true, half_width, half_height});
    }
  };
  add("gray", Samples::kGrey, "Y", false, false);
  all.push_back({"grayf32le", Samples::kGrey, "Y", PixelType::kFloat, 32, true});
  add("gbrp", Samples::kRgb, "GBR", false, false);
  all.push_back({"gbrpf32le", Samples::kRgb, "GBR", PixelType::kFloat, 32, true});
  add("gbrap", Samples::kRgb, "GBRA", false, false);
  all.push_back({"gbrapf32le", Samples::kRgb, "GBRA", PixelType::kFloat, 32, true});
  add("yuv420p", Samples::kYcc, "Ybr", true, true);
  add("yuv422p", Samples::kYcc, "Ybr", true, false);
  add("yuv444p", Samples::kYcc, "Ybr", false, false);
}

}  // namespace

const std::vector<PixelFormat>& PixelFormats() {
  static const std::vector<PixelFormat> kAll = [] {
    std::vector<PixelFormat> all;
    AddInterleaved(all);
    AddPlanar(all);
    return all;
  }();
  return kAll;
}

const PixelFormat* FindPixelFormat(const std::string& name) {
  const auto& all = PixelFormats();
  const auto at = std::find_if(all.begin(), all.end(), [&](const PixelFormat& f) { return f.name == name; });
  return at == all.end() ? nullptr : &*at;
}

int ChromaWidth(const PixelFormat& format, int width) { return format.half_width ? (width + 1) / 2 : width; }

int ChromaHeight(const PixelFormat& format, int height) {
  return format.half_height ? (height + 1) / 2 : height;
}

size_t FrameBytes(const PixelFormat& format, int width, int height) {
  const auto samples = [](int w, int h) { return static_cast<size_t>(w) * static_cast<size_t>(h); };
  size_t count = samples(width, height) * format.order.size();
  if (format.IsSubsampled())
    count = samples(width, height) + 2 * samples(ChromaWidth(format, width), ChromaHeight(format, height));
  return count * PixelBytes(format.type);
}

std::vector<std::string> ChannelNames(const PixelFormat& format) {
  std::vector<std::string> names;
  for (const char c : format.order) names.push_back(c == 'b' ? "Cb" : c == 'r' ? "Cr" : std::string(1, c));
  return names;
}

ImageView FrameView(const PixelFormat& format, int width, int height, std::byte* bytes) {
  const Roi roi{0, 0, width, height};
  const int channels = static_cast<int>(format.order.size());
  if (!format.planar) return {bytes, roi, channels, format.type};
  const auto sample = static_cast<ptrdiff_t>(PixelBytes(format.type));
  return {bytes, roi, channels, format.type, sample * width * height, sample, sample * width};
}

}  // namespace tessera::io
