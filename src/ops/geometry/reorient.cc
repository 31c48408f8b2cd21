// The picture as it is meant to be seen: the Orientation that a camera wrote, carried out.
#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/geometry/geometry_ops.h"
#include "tessera/error.h"
#include "tessera/ops/arrangement.h"

namespace tessera::ops {
namespace {

constexpr char kOrientation[] = "Orientation";

class OrientationOp final : public graph::OpWith<int> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "orientation"; }
  graph::OpKind Kind() const override { return graph::OpKind::kCrop; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec out = inputs[0];
    auto items = out.metadata ? *out.metadata : std::vector<Attribute>();
    std::erase_if(items, [](const Attribute& item) { return item.name == kOrientation; });
    Attribute item{kOrientation, "int", std::vector<std::byte>(sizeof(int)), {}};
    std::memcpy(item.bytes.data(), &params(), sizeof(int));
    items.push_back(std::move(item));
    out.metadata = std::make_shared<const std::vector<Attribute>>(std::move(items));
    return out;
  }
};

}  // namespace

OpInfo ReorientInfo() {
  OpInfo info;
  info.name = "reorient";
  info.family = "geometry";
  info.summary = "Turn or mirror the image as its Orientation says";
  info.help =
      "Cameras write how they were held into a file's Orientation, 1 to 8 as Exif and TIFF number them. The "
      "pixels are rearranged so that the picture is upright, and Orientation becomes 1; without it, or where it "
      "is 1, nothing happens. --autoorient does it to every file that is read. As oiiotool. Bits stay.";
  info.bound = "exact";
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Reorient(in[0]); };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

int OrientationOf(const ImageSpec& spec) {
  if (!spec.metadata) return 1;
  for (const Attribute& item : *spec.metadata) {
    if (item.name != ops::kOrientation || item.bytes.size() > sizeof(int) || item.bytes.empty()) continue;
    int value = 0;  // int, or a shorter one
    std::memcpy(&value, item.bytes.data(), item.bytes.size());
    if (value >= 1 && value <= 8) return value;
  }
  return 1;
}

Node WithOrientation(const Node& image, int orientation) {
  if (orientation < 1 || orientation > 8) {
    throw Error("orientation", "found " + std::to_string(orientation) + ", expected 1 to 8");
  }
  if (OrientationOf(image.spec()) == orientation) return image;
  return graph::MakeNode(std::make_shared<const ops::OrientationOp>(orientation), {image});
}

Node Reorient(const Node& image) {
  const auto upright = [&]() -> Node {
    switch (OrientationOf(image.spec())) {
      case 2:
        return Flop(image);
      case 3:
        return Rotate180(image);
      case 4:
        return Flip(image);
      case 5:
        return Flop(Rotate270(image));
      case 6:
        return Rotate90(image);
      case 7:
        return Rotate90(Flip(image));
      case 8:
        return Rotate270(image);
      default:
        return image;
    }
  };
  return WithOrientation(upright(), 1);
}

}  // namespace tessera
