// Operations on images, rendering and files, through the C interface.
#include <functional>
#include <memory>
#include <utility>

#include "c/handles.h"
#include "ops/apply.h"
#include "tessera/context.h"
#include "tessera/io.h"
#include "tessera/prepared_graph.h"
#include "tessera/render.h"

namespace tessera::c {
namespace {

constexpr int32_t kMostThreads = 4096;

std::function<bool(double)> ProgressOf(tessera_progress progress, void* user) {
  if (progress == nullptr) return {};
  return [progress, user](double share) { return progress(share, user) != 0; };
}

// Of options to render or to write.
template <class Options>
RenderOptions RenderOptionsOf(const Options& given) {
  RenderOptions options;
  if (given.threads < 0 || given.threads > kMostThreads)
    throw Misuse("threads", "found " + std::to_string(given.threads) + ", expected 0 to 4096");
  options.threads = given.threads;
  if (given.memory > 0) options.memory_budget = static_cast<size_t>(given.memory);
  options.progress = ProgressOf(given.progress, given.user);
  if (given.context != nullptr) options.context = Checked(given.context, "context").context.get();
  return options;
}

// Where the image's pixels go, or an empty view.
ImageView OutOf(const tessera_pixels* out, const ImageSpec& spec) {
  const ConstImageView view = ViewOf(out, "out");
  if (view.channels != spec.channel_count()) {
    throw Misuse("out", "found " + std::to_string(view.channels) + " channels, expected the image's " +
                            std::to_string(spec.channel_count()));
  }
  if (!spec.data_window.Contains(view.roi))
    throw Misuse("out", "found a window beyond the image's, expected one within it");
  return ImageView(const_cast<std::byte*>(view.data), view.roi, view.channels, view.type, view.channel_stride,
                   view.pixel_stride, view.row_stride);
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
    const tessera::RenderOptions options = RenderOptionsOf(Taken(given, "options"));
    const tessera::ImageView view = OutOf(out, node.spec());
    if (!view.roi.empty()) RenderInto(node, view, options);
  });
}

tessera_status tessera_prepare(const tessera_image* image, const tessera_render_options* given,
                               tessera_prepared** prepared, tessera_error** error) {
  return Guarded(error, [&] {
    tessera_prepared*& result = Result(prepared, "prepared");
    const tessera_image& from = Checked(image, "image");
    const tessera_render_options options = Taken(given, "options");
    auto made = std::make_unique<tessera_prepared>();
    made->borrowed = from.borrowed;
    if (options.context != nullptr) made->context = Checked(options.context, "context").context;
    made->graph = std::make_unique<tessera::PreparedGraph>(from.node, RenderOptionsOf(options));
    result = made.release();
  });
}

tessera_status tessera_prepared_render(const tessera_prepared* prepared, const tessera_pixels* out,
                                       tessera_progress progress, void* user, tessera_error** error) {
  return Guarded(error, [&] {
    const tessera::PreparedGraph& graph = *Checked(prepared, "prepared").graph;
    const tessera::ImageView view = OutOf(out, graph.spec());
    if (!view.roi.empty()) graph.RenderInto(view, ProgressOf(progress, user));
  });
}

void tessera_prepared_free(tessera_prepared* prepared) {
  if (prepared != nullptr && prepared->tag == Tag::kPrepared) delete prepared;
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
    write.render = RenderOptionsOf(options);
    tessera::Write(from.node, Text(file, "file"), write);
  });
}

}  // extern "C"
