// Images in files as lazy sources: rows are read when the engine asks.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/origin.h"
#include "graph/source.h"
#include "io/image_file.h"
#include "io/open_input.h"
#include "io/spec.h"
#include "sched/scheduler.h"
#include "tessera/context.h"
#include "tessera/io.h"

namespace tessera {
namespace io {
namespace {

bool IsReadApart(const std::string& file, Formats formats) {
  const Policy policy = Context::Default().policy();
  if (policy.sandbox == Sandbox::kOff) return false;
  if (policy.sandbox == Sandbox::kAll) return true;
  return formats == Formats::kAll && !policy.listed_formats && !IsListed(file);
}

class FileSource final : public graph::PixelSource {
 public:
  FileSource(const std::string& file, const ReadOptions& options)
      : file_(file), image_(OpenFile({file, options})), spec_(SpecFrom(native())) {}

  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return file_; }
  std::unique_ptr<graph::RowReader> Open(int first, int last) const override {
    return image_->Open(first, last);
  }
  std::string Decoder() const override { return image_->Decoder(); }
  int RowGranularity() const override {
    return native().tile_height > 0 ? native().tile_height : ChunkRows(image_->header().format, native());
  }

  bool IsVolume() const { return native().depth > 1; }
  // A volume's slices one above the other, the first on top: what look-ups take as a table of three axes.
  // They are read whole, because formats of volumes are tiled along the depth too.
  Image Slices() const {
    ImageSpec stack = spec_;
    stack.data_window.y1 = stack.data_window.y0 + native().height * native().depth;
    stack.display_window = stack.data_window;
    const Image image = Image::Uninitialized(std::move(stack));
    image_->ReadAll(0, native().nchannels, image.spec().type, image.view().data);
    return image;
  }

 private:
  const OIIO::ImageSpec& native() const { return image_->header().spec; }

  std::string file_;
  std::unique_ptr<ImageFile> image_;
  ImageSpec spec_;
};

}  // namespace

std::unique_ptr<ImageFile> OpenFile(const FileRequest& request) {
  return IsReadApart(request.file, request.options.formats) ? OpenFileApart(request) : OpenFileHere(request);
}

}  // namespace io

Node Read(const std::string& file, const ReadOptions& options) {
  auto source = std::make_shared<io::FileSource>(file, options);
  const Node node = source->IsVolume() ? FromImage(source->Slices()) : graph::MakeSource(source);
  if (options.enough_width > 0 || options.enough_height > 0) return node;  // not the file's own pixels
  graph::Origin origin;
  origin.kind = graph::Origin::Kind::kFile, origin.name = file;
  if (!options.part.empty()) {
    origin.values = {{"part", options.part}};
  } else if (options.subimage != 0) {
    origin.values = {{"subimage", std::to_string(options.subimage)}};
  }
  return graph::WithOrigin(node, std::move(origin));
}

std::vector<std::string> Subimages(const std::string& file, Formats formats) {
  return io::IsReadApart(file, formats) ? io::PartNamesApart(file, formats)
                                        : io::PartNamesHere(file, formats);
}

void LimitCodecThreads(int threads) {
  const int count = sched::ThreadCount(threads);
  // Of OpenEXR's pool: -1 for none, where the caller does all. OpenImageIO's own pool is not asked for here.
  OIIO::attribute("exr_threads", count == 1 ? -1 : count);
}

}  // namespace tessera
