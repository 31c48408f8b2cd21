// Windows alone: the display window is said anew, or the data window cut to it. No pixel is touched.
#include <memory>
#include <string>

#include "graph/op.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

class DisplayOp final : public graph::OpWith<Roi> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "fullsize"; }
  graph::OpKind Kind() const override { return graph::OpKind::kCrop; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec out = inputs[0];
    out.display_window = params();
    return out;
  }
};

OpInfo Row(const std::string& name, const std::string& summary, const std::string& help) {
  OpInfo info;
  info.name = name;
  info.family = "geometry";
  info.summary = summary;
  info.help = help;
  info.bound = "exact";
  info.examples = {""};
  return info;
}

}  // namespace

OpInfo FullSizeInfo() {
  OpInfo info =
      Row("fullsize", "Set the display window",
          "GEOM is WxH, WxH+X+Y, +X+Y or x0,y0,x1,y1 (x1 and y1 included); what is not named stays. "
          "Pixels and data window stay where they are. As oiiotool.");
  info.arguments = {TextModifier("GEOM", "the new display window, such as 1920x1080 or 1024x768+100+0")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return WithDisplayWindow(in[0], ParseGeometry(a.Text("GEOM"), in[0].spec().display_window));
  };
  info.examples = {"40x30", "100x50-3+4", "+5+6"};
  return info;
}

OpInfo FullPixelsInfo() {
  OpInfo info = Row("fullpixels", "Set the display window to the data window",
                    "What is shown is then exactly the pixels that there are. As oiiotool.");
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return WithDisplayWindow(in[0], in[0].spec().data_window);
  };
  return info;
}

OpInfo CropToFullInfo() {
  OpInfo info =
      Row("croptofull", "Set the data window to the display window, cutting off or padding with zero",
          "As --crop with the display window. As oiiotool.");
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return CropToDisplay(in[0]);
  };
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node WithDisplayWindow(const Node& image, const Roi& window) {
  if (image.spec().display_window == window) return image;
  return graph::MakeNode(std::make_shared<const ops::DisplayOp>(window), {image});
}

Node CropToDisplay(const Node& image) {
  const ImageSpec& spec = image.spec();
  return spec.display_window.empty() || spec.data_window.empty() || spec.data_window == spec.display_window
             ? image
             : Crop(image, spec.display_window);
}

}  // namespace tessera
