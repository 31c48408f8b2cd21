// Images of the C interface: the caller's pixels, what an image is.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "c/handles.h"
#include "tessera/image.h"

namespace tessera::c {
namespace {

constexpr int32_t kFarthest = 1 << 30;  // sides and sums of coordinates stay integers
constexpr int32_t kMostChannels = 1024;

bool IsNone(const tessera_window& w) { return w.x0 == 0 && w.y0 == 0 && w.x1 == 0 && w.y1 == 0; }

tessera_window WindowOf(const Roi& r) { return {r.x0, r.y0, r.x1, r.y1}; }

std::vector<std::string> NamesOf(const char* text, int channels) {
  if (text == nullptr) return DefaultChannelNames(channels);
  std::vector<std::string> names(1);
  for (const char* c = text; *c != 0; ++c) {
    *c == ',' ? names.emplace_back() : names.back() += *c;
  }
  if (names.size() != static_cast<size_t>(channels)) {
    throw Misuse("channels",
                 "found " + std::to_string(names.size()) + " names, expected " + std::to_string(channels));
  }
  for (const std::string& name : names) {
    if (name.empty() || std::count(names.begin(), names.end(), name) > 1)
      throw Misuse("channels", "found \"" + std::string(text) + "\", expected names that differ");
  }
  return names;
}

ImageSpec SpecOf(const ConstImageView& view, const tessera_image_options* given) {
  const tessera_image_options options = Taken(given, "options");
  ImageSpec spec(view.roi.width(), view.roi.height(), view.channels, view.type);
  spec.data_window = view.roi;
  spec.display_window =
      IsNone(options.display_window) ? view.roi : RoiOf(options.display_window, "display_window");
  spec.channels = NamesOf(options.channels, view.channels);
  if (options.alpha == nullptr) {
    spec.alpha = spec.ChannelIndex("A");
  } else {
    spec.alpha = *options.alpha == 0 ? -1 : spec.ChannelIndex(options.alpha);
    if (*options.alpha != 0 && spec.alpha < 0)
      throw Misuse("alpha", "found \"" + std::string(options.alpha) + "\", expected one of the channels");
  }
  return spec;
}

}  // namespace

Roi RoiOf(const tessera_window& w, const char* name) {
  for (const int32_t v : {w.x0, w.y0, w.x1, w.y1}) {
    if (v < -kFarthest || v > kFarthest)
      throw Misuse(name, "found the coordinate " + std::to_string(v) + ", expected -2^30 to 2^30");
  }
  if (w.x1 < w.x0 || w.y1 < w.y0) {
    throw Misuse(name, "found " + std::to_string(w.x0) + "," + std::to_string(w.y0) + " to " +
                           std::to_string(w.x1) + "," + std::to_string(w.y1) +
                           ", expected the second corner right of and below the first");
  }
  return {w.x0, w.y0, w.x1, w.y1};
}

PixelType TypeOf(tessera_type type, const char* name) {
  if (type < TESSERA_UINT8 || type > TESSERA_FLOAT) {
    throw Misuse(name, "found " + std::to_string(type) + ", expected TESSERA_UINT8, UINT16, HALF or FLOAT");
  }
  return static_cast<PixelType>(type - TESSERA_UINT8);
}
tessera_type TypeOf(PixelType type) { return static_cast<tessera_type>(type) + TESSERA_UINT8; }

ConstImageView ViewOf(const tessera_pixels* given, const char* name) {
  if (given == nullptr) throw Misuse(name, "found NULL, expected pixels");
  tessera_pixels p = Taken(given, name);
  const Roi roi = RoiOf(p.window, "window");
  const PixelType type = TypeOf(p.type, "type");
  const auto bytes = static_cast<int64_t>(PixelBytes(type));
  if (p.channels < 1 || p.channels > kMostChannels)
    throw Misuse("channels", "found " + std::to_string(p.channels) + ", expected 1 to 1024");
  if (p.channel_stride == 0 && p.pixel_stride == 0 && p.row_stride == 0) {
    p.channel_stride = bytes, p.pixel_stride = bytes * p.channels;
    p.row_stride = p.pixel_stride * roi.width();
  }
  if (p.data == nullptr && !roi.empty()) throw Misuse("data", "found NULL, expected the first sample");
  const auto address = reinterpret_cast<uintptr_t>(p.data);
  if (address % static_cast<uintptr_t>(bytes) != 0 || p.channel_stride % bytes != 0 ||
      p.pixel_stride % bytes != 0 || p.row_stride % bytes != 0) {
    throw Misuse(name, "found an address or stride that is no multiple of a sample's " +
                           std::to_string(bytes) + " bytes");
  }
  return {static_cast<const std::byte*>(p.data),
          roi,
          p.channels,
          type,
          p.channel_stride,
          p.pixel_stride,
          p.row_stride};
}

tessera_image* NewImage(Node node, const tessera_image* const* from, size_t count) {
  auto image = std::make_unique<tessera_image>();
  image->node = std::move(node);
  for (size_t k = 0; k < count; ++k) {
    for (const auto& pixels : from[k]->borrowed) {
      if (std::find(image->borrowed.begin(), image->borrowed.end(), pixels) == image->borrowed.end())
        image->borrowed.push_back(pixels);
    }
  }
  return image.release();
}

}  // namespace tessera::c

using namespace tessera::c;  // NOLINT: all that this file is for

extern "C" {

tessera_status tessera_image_borrow(const tessera_pixels* pixels, const tessera_image_options* options,
                                    void (*release)(void* user), void* user, tessera_image** image,
                                    tessera_error** error) {
  return Guarded(error, [&] {
    tessera_image*& result = Result(image, "image");
    const tessera::ConstImageView view = ViewOf(pixels, "pixels");
    std::unique_ptr<tessera_image> made(NewImage(tessera::FromView(view, SpecOf(view, options)), nullptr, 0));
    if (release != nullptr) {
      made->borrowed.push_back(std::make_shared<tessera::c::Borrowed>());
      made->borrowed[0]->release = release, made->borrowed[0]->user = user;  // nothing can fail from here on
    }
    result = made.release();
  });
}

tessera_status tessera_image_copy(const tessera_pixels* pixels, const tessera_image_options* options,
                                  tessera_image** image, tessera_error** error) {
  return Guarded(error, [&] {
    tessera_image*& result = Result(image, "image");
    const tessera::ConstImageView from = ViewOf(pixels, "pixels");
    const tessera::Image copy(SpecOf(from, options));
    const size_t bytes = PixelBytes(from.type);
    for (int y = from.roi.y0; y < from.roi.y1; ++y) {
      for (int x = from.roi.x0; x < from.roi.x1; ++x) {
        for (int c = 0; c < from.channels; ++c) std::memcpy(copy.view().At(x, y, c), from.At(x, y, c), bytes);
      }
    }
    result = NewImage(FromImage(copy), nullptr, 0);
  });
}

void tessera_image_free(tessera_image* image) {
  if (image != nullptr && image->tag == Tag::kImage) delete image;
}

tessera_status tessera_image_get_info(const tessera_image* image, tessera_image_info* info,
                                      tessera_error** error) {
  return Guarded(error, [&] {
    const tessera::ImageSpec& spec = Checked(image, "image").node.spec();
    tessera_image_info all = {};
    all.data_window = WindowOf(spec.data_window), all.display_window = WindowOf(spec.display_window);
    all.channels = spec.channel_count(), all.alpha = spec.alpha;
    all.type = TypeOf(spec.type);
    Fill(info, all, "info");
  });
}

const char* tessera_image_channel(const tessera_image* image, int32_t index) {
  if (image == nullptr || image->tag != Tag::kImage) return nullptr;
  const auto& names = image->node.spec().channels;
  return index < 0 || static_cast<size_t>(index) >= names.size() ? nullptr
                                                                 : names[static_cast<size_t>(index)].c_str();
}

}  // extern "C"
