// Operations on images, rendering and files, through the C interface.
#include <utility>

#include "c/handles.h"
#include "ops/apply.h"
#include "tessera/io.h"
#include "tessera/render.h"

namespace tessera::c {
namespace {

constexpr int32_t kMostThreads = 4096;

RenderOptions OptionsOf(int32_t threads, uint64_t memory, tessera_progress progress, void* user) {
  RenderOptions options;
  if (threads < 0 || threads > kMostThreads)
    throw Misuse("threads", "found " + std::to_string(threads) + ", expected 0 to 4096");
  options.threads = threads;
  if (memory > 0) options.memory_budget = static_cast<size_t>(memory);
  if (progress != nullptr)
    options.progress = [progress, user](double share) { return progress(share, user) != 0; };
  return options;
}

}  // namespace
}  // namespace tessera::c

using namespace tessera::c;  // NOLINT: all that this file is for

extern "C" {

tessera_status tessera_apply(const tessera_parameters* parameters, const tessera_image* const* images,
                             size_t count, tessera_image** result, tessera_error** error) {
  return Guarded(error, [&] {
    tessera_image*& made = Result(result, "result");
    const tessera_parameters& p = Checked(parameters, "parameters");
    if (p.op->generator) throw Misuse(p.op->name, "is a generator, expected tessera_generate");
    const tessera::ops::Arguments arguments = ArgumentsOf(p);
    const int wanted = p.op->Operands(arguments);
    if (count != static_cast<size_t>(wanted)) {
      throw Misuse(p.op->name,
                   "found " + std::to_string(count) + " images, expected " + std::to_string(wanted));
    }
    if (images == nullptr && count > 0) throw Misuse("images", "found NULL, expected images");
    std::vector<tessera::Node> inputs;
    for (size_t k = 0; k < count; ++k) inputs.push_back(Checked(images[k], "images").node);
    made = NewImage(tessera::ops::Apply(*p.op, inputs, arguments, nullptr), images, count);
  });
}

tessera_status tessera_generate(const tessera_parameters* parameters, const tessera_window* window,
                                int32_t channels, tessera_image** result, tessera_error** error) {
  return Guarded(error, [&] {
    tessera_image*& made = Result(result, "result");
    const tessera_parameters& p = Checked(parameters, "parameters");
    if (!p.op->generator) throw Misuse(p.op->name, "takes images, expected tessera_apply");
    if (window == nullptr) throw Misuse("window", "found NULL, expected the pixels to make");
    if (channels < 1 || channels > 1024)
      throw Misuse("channels", "found " + std::to_string(channels) + ", expected 1 to 1024");
    const tessera::Roi roi = RoiOf(*window, "window");
    tessera::ImageSpec spec(roi.width(), roi.height(), channels);
    spec.data_window = spec.display_window = roi;
    made = NewImage(tessera::ops::Apply(*p.op, {}, ArgumentsOf(p), &spec), nullptr, 0);
  });
}

tessera_status tessera_render(const tessera_image* image, const tessera_pixels* out,
                              const tessera_render_options* given, tessera_error** error) {
  return Guarded(error, [&] {
    const tessera::Node& node = Checked(image, "image").node;
    const tessera_render_options options = Taken(given, "options");
    const tessera::ConstImageView view = ViewOf(out, "out");
    const tessera::ImageSpec& spec = node.spec();
    if (view.channels != spec.channel_count()) {
      throw Misuse("out", "found " + std::to_string(view.channels) + " channels, expected the image's " +
                              std::to_string(spec.channel_count()));
    }
    if (!spec.data_window.Contains(view.roi))
      throw Misuse("out", "found a window beyond the image's, expected one within it");
    if (view.roi.empty()) return;
    const tessera::ImageView writable(const_cast<std::byte*>(view.data), view.roi, view.channels, view.type,
                                      view.channel_stride, view.pixel_stride, view.row_stride);
    RenderInto(node, writable, OptionsOf(options.threads, options.memory, options.progress, options.user));
  });
}

tessera_status tessera_read(const char* file, const tessera_read_options* given, tessera_image** image,
                            tessera_error** error) {
  return Guarded(error, [&] {
    tessera_image*& result = Result(image, "image");
    const tessera_read_options options = Taken(given, "options");
    tessera::ReadOptions read;
    read.subimage = options.subimage;
    if (options.part != nullptr) read.part = options.part;
    if (options.all_formats != 0) read.formats = tessera::Formats::kAll;
    result = NewImage(tessera::Read(Text(file, "file"), read), nullptr, 0);
  });
}

tessera_status tessera_write(const tessera_image* image, const char* file, const tessera_write_options* given,
                             tessera_error** error) {
  return Guarded(error, [&] {
    const tessera_image& from = Checked(image, "image");
    const tessera_write_options options = Taken(given, "options");
    tessera::WriteOptions write;
    if (options.type != TESSERA_TYPE_DEFAULT) write.type = TypeOf(options.type, "type");
    write.render = OptionsOf(options.threads, options.memory, options.progress, options.user);
    tessera::Write(from.node, Text(file, "file"), write);
  });
}

}  // extern "C"
