// The colour state of a spec, and the operation that changes nothing else.
#include "tessera/color_state.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "graph/op.h"

namespace tessera {
namespace {

// As OpenImageIO has them.
constexpr char kSpace[] = "oiio:ColorSpace", kUnassociated[] = "oiio:UnassociatedAlpha";

// What files say of their own colours; not true of others. ICCProfile has further items behind a colon.
constexpr std::array<std::string_view, 12> kOfOneSpace = {
    "iccprofile",     "chromaticities",         "whiteluminance", "adoptedneutral",  "cicp",
    "colorinteropid", "acesimagecontainerflag", "oiio:gamma",     "exif:colorspace", "exif:gamma",
    "dpx:transfer",   "dpx:colorimetric"};

bool IsOfOneSpace(const Attribute& item) {
  std::string name = item.name;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.starts_with("iccprofile:") ||
         std::find(kOfOneSpace.begin(), kOfOneSpace.end(), name) != kOfOneSpace.end();
}

struct ColorStateChange {
  ColorState color;
  std::vector<std::byte> icc_profile;
};

class ColorStateOp final : public graph::OpWith<ColorStateChange> {
 public:
  explicit ColorStateOp(ColorStateChange change) : OpWith(std::move(change)) {}
  std::string Name() const override { return "iscolorspace"; }
  graph::OpKind Kind() const override { return graph::OpKind::kShuffle; }
  bool IsIdentity() const override { return true; }

  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    const std::vector<std::byte>& profile = params().icc_profile;
    if (!profile.empty()) SetColorState(spec, {"", params().color.premultiplied});
    SetColorState(spec, params().color);
    if (profile.empty()) return spec;
    auto items = spec.metadata ? *spec.metadata : std::vector<Attribute>();
    std::erase_if(items, IsOfOneSpace);
    items.push_back({"ICCProfile", "uint8[" + std::to_string(profile.size()) + "]", profile, {}});
    spec.metadata = std::make_shared<const std::vector<Attribute>>(std::move(items));
    return spec;
  }

  std::vector<graph::ChannelRef> ChannelMap(std::span<const ImageSpec> inputs) const override {
    std::vector<graph::ChannelRef> map;
    for (int c = 0; c < inputs[0].channel_count(); ++c) map.push_back({0, c, 0});
    return map;
  }
};

}  // namespace

ColorState ColorStateOf(const ImageSpec& spec) {
  ColorState color;
  if (!spec.metadata) return color;
  for (const Attribute& item : *spec.metadata) {
    if (item.name == kSpace && !item.strings.empty()) color.space = item.strings[0];
    if (item.name == kUnassociated) {
      color.premultiplied =
          std::all_of(item.bytes.begin(), item.bytes.end(), [](std::byte b) { return b == std::byte{0}; });
    }
  }
  return color;
}

void SetColorState(ImageSpec& spec, const ColorState& color) {
  const ColorState before = ColorStateOf(spec);
  if (before == color) return;
  auto items = spec.metadata ? *spec.metadata : std::vector<Attribute>();
  std::erase_if(items, [&](const Attribute& item) {
    return item.name == kSpace || item.name == kUnassociated ||
           (before.space != color.space && IsOfOneSpace(item));
  });
  if (!color.space.empty()) items.push_back({kSpace, "string", {}, {color.space}});
  if (!color.premultiplied) {
    const int one = 1;
    Attribute mark{kUnassociated, "int", std::vector<std::byte>(sizeof one), {}};
    std::memcpy(mark.bytes.data(), &one, sizeof one);
    items.push_back(std::move(mark));
  }
  spec.metadata = std::make_shared<const std::vector<Attribute>>(std::move(items));
}

Node WithColorState(const Node& image, const ColorState& color, const std::vector<std::byte>& icc_profile) {
  if (ColorStateOf(image.spec()) == color && icc_profile.empty()) return image;
  return graph::MakeNode(std::make_shared<const ColorStateOp>(ColorStateChange{color, icc_profile}), {image});
}

}  // namespace tessera
