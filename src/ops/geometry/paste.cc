// Images laid over one another or side by side, bit for bit: paste and mosaic.
#include <algorithm>
#include <climits>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/arena_vector.h"
#include "graph/op.h"
#include "model/placements.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

constexpr int kMostImages = 65536;

struct Placed {
  Roi window;  // of the input
  Offset at;

  // What of `out` it fills, in the result's coordinates.
  Roi Part(const Roi& out) const {
    const auto side = [](int a0, int a1, int64_t b0, int64_t b1) {
      const int64_t low = std::max<int64_t>(a0, b0), high = std::min<int64_t>(a1, b1);
      return std::pair(static_cast<int>(std::min<int64_t>(low, a1)),
                       static_cast<int>(std::max<int64_t>(high, a0)));
    };
    if (window.empty()) return {};
    const auto [x0, x1] = side(out.x0, out.x1, int64_t{window.x0} + at.x, int64_t{window.x1} + at.x);
    const auto [y0, y1] = side(out.y0, out.y1, int64_t{window.y0} + at.y, int64_t{window.y1} + at.y);
    const Roi part{x0, y0, x1, y1};
    return part.empty() ? Roi{} : part;
  }
  Roi Source(const Roi& part) const {
    if (part.empty()) return {};
    return {part.x0 - at.x, part.y0 - at.y, part.x1 - at.x, part.y1 - at.y};
  }
};

class PasteStage final : public graph::TileStage {
 public:
  explicit PasteStage(std::vector<Placed> placed) : placed_(std::move(placed)) {}
  Roi InputRoi(int k, const Roi& out) const override {
    const Placed& placed = placed_[static_cast<size_t>(k)];
    return placed.Source(placed.Part(out));
  }
  Wrap InputBorder(int) const override { return Wrap::kBlack; }
  graph::TileSize Preferred() const override { return {4096, 32}; }
  bool Accepts(PixelType) const override { return true; }
  void Run(const graph::TileArgs& args) const override {
    const ImageView& out = args.out;
    bool filled = false;
    for (size_t k = 0; k < placed_.size() && !filled; ++k)
      filled = placed_[k].Part(out.roi) == out.roi && SameChannels(args, k);
    if (!filled) Clear(out);
    for (size_t k = 0; k < placed_.size(); ++k) {
      const Roi part = placed_[k].Part(out.roi);
      if (!part.empty()) Lay(args, k, part);
    }
  }

 private:
  static bool SameChannels(const graph::TileArgs& args, size_t k) {
    const std::span<const int> wanted = args.channels, present = args.in_channels[k];
    return std::equal(wanted.begin(), wanted.end(), present.begin(), present.end());
  }
  static void Clear(const ImageView& out) {
    const size_t bytes = static_cast<size_t>(out.pixel_stride) * static_cast<size_t>(out.roi.width());
    for (int y = out.roi.y0; y < out.roi.y1; ++y) std::memset(out.At(out.roi.x0, y), 0, bytes);
  }

  void Lay(const graph::TileArgs& args, size_t k, const Roi& part) const {
    const ConstImageView& in = args.in[k];
    const ImageView& out = args.out;
    const Roi from = placed_[k].Source(part);
    const std::span<const int> wanted = args.channels, present = args.in_channels[k];
    if (SameChannels(args, k)) {
      const size_t bytes = static_cast<size_t>(out.pixel_stride) * static_cast<size_t>(part.width());
      for (int y = 0; y < part.height(); ++y)
        std::memcpy(out.At(part.x0, part.y0 + y), in.At(from.x0, from.y0 + y), bytes);
      return;
    }
    for (size_t c = 0; c < wanted.size(); ++c) {
      const auto it = std::find(present.begin(), present.end(), wanted[c]);
      if (it != present.end())
        LayChannel(in, static_cast<int>(it - present.begin()), from, out, static_cast<int>(c), part);
    }
  }

  static void LayChannel(const ConstImageView& in, int source, const Roi& from, const ImageView& out,
                         int channel, const Roi& part) {
    const size_t bytes = PixelBytes(out.type);
    for (int y = 0; y < part.height(); ++y) {
      const std::byte* sample = in.At(from.x0, from.y0 + y, source);
      std::byte* to = out.At(part.x0, part.y0 + y, channel);
      for (int x = 0; x < part.width(); ++x, sample += in.pixel_stride, to += out.pixel_stride)
        std::memcpy(to, sample, bytes);
    }
  }

  std::vector<Placed> placed_;
};

class PasteOp final : public graph::OpWith<Placements> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "paste"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override { return params().result; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    std::copy_n(result.begin(), std::min(needed.size(), result.size()), needed.begin());
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    std::vector<Placed> placed;
    for (size_t k = 0; k < params().at.size(); ++k)
      placed.push_back({context.inputs[k].data_window, params().at[k]});
    return std::make_unique<PasteStage>(std::move(placed));
  }
};

// WxH; nothing where it is not.
Offset SizeOf(const std::string& text) {
  try {
    const Roi size = ParseGeometry(text, {});
    if (text.find_first_of("+-,") == std::string::npos) return {size.width(), size.height()};
  } catch (const Error&) {
  }
  return {};
}

Offset Fields(const std::string& modifier, const std::string& text) {
  const Offset size = SizeOf(text);
  if (size.x < 1)
    throw Error("mosaic", "found " + modifier + "\"" + text.substr(0, 60) + "\", expected WxH, such as 3x2");
  return size;
}

int MosaicImages(const Arguments& a) {
  const Offset fields = SizeOf(a.Text("WxH"));
  return fields.x < 1 ? 1 : static_cast<int>(std::min<int64_t>(int64_t{fields.x} * fields.y, kMostImages));
}

}  // namespace

OpInfo PasteInfo() {
  OpInfo info;
  info.name = "paste";
  info.family = "geometry";
  info.inputs = 2;
  info.summary = "Put an image's pixels into another one";
  info.help =
      "FG BG --paste +X+Y: the foreground's pixels, moved X to the right and Y down, take the place of the "
      "background's; alpha is a channel as any other (--over composites). The windows are the background's, with "
      "mergeroi=1 they hold both images'. A place of - or auto moves nothing. Channels that the foreground lacks "
      "stay. As oiiotool, of two images. Bits stay.";
  info.bound = "exact";
  info.arguments = {TextModifier("+X+Y", "how far the foreground moves; - or auto: not at all")};
  info.modifiers = {FlagModifier("mergeroi", "1: the windows hold both images'")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::string& text = a.Text("+X+Y");
    PasteParams p;
    if (text != "-" && text != "auto") p.at = ParseOffset("paste", text);
    p.merge_windows = a.Flag("mergeroi");
    return Paste(in[0], in[1], p);
  };
  info.examples = {"+11+5", "-7-2 mergeroi=1", "+9-4 mergeroi=1", "auto", "+900+900"};
  return info;
}

OpInfo MosaicInfo() {
  OpInfo info;
  info.name = "mosaic";
  info.family = "geometry";
  info.inputs = 4;
  info.operands = MosaicImages;
  info.summary = "Images side by side";
  info.help =
      "WxH fields, filled row after row with as many images, the lowest of the stack first; a field is as large as "
      "the largest display window, or as fit=WxH says, into which every image is fitted as --fit:pad=1 does. Between "
      "fields lie pad= pixels. An image lies in its field as in its display window's coordinates. What no image "
      "fills is zero; the result has as many channels as the image that has most. As oiiotool, but that it takes "
      "blank images for those that are not there. Bits stay where nothing is fitted.";
  info.bound = "exact";
  info.arguments = {TextModifier("WxH", "fields side by side and above each other")};
  info.modifiers = {IntegerModifier("pad", "0", 0, 1 << 20, "pixels between fields"),
                    TextModifier("fit", "WxH: the size of a field, into which images are fitted")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const Offset fields = Fields("", a.Text("WxH"));
    if (int64_t{fields.x} * fields.y > kMostImages) {
      throw Error("mosaic",
                  "found " + a.Text("WxH") + ", expected at most " + std::to_string(kMostImages) + " images");
    }
    MosaicParams p;
    p.columns = fields.x;
    p.pad = a.Integer("pad");
    if (a.Given("fit")) {
      const Offset fit = Fields("fit=", a.Text("fit"));
      p.fit_width = fit.x, p.fit_height = fit.y;
    }
    return Mosaic({in.begin(), in.end()}, p);
  };
  info.examples = {"2x2", "2x1 pad=3", "1x3", "2x2 fit=13x9 pad=1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Paste(const Node& front, const Node& back, const PasteParams& params) {
  ops::Placements placements{back.spec(), {{}, params.at}};
  if (params.merge_windows) {
    const ImageSpec& spec = front.spec();
    placements.result.data_window = Union(placements.result.data_window, spec.data_window);
    placements.result.display_window = Union(placements.result.display_window, spec.display_window);
  }
  return graph::MakeNode(std::make_shared<const ops::PasteOp>(std::move(placements)), {back, front});
}

Node Mosaic(const std::vector<Node>& given, const MosaicParams& params) {
  if (given.empty() || given.size() > ops::kMostImages || params.columns < 1 || params.pad < 0) {
    throw Error("mosaic", "found " + std::to_string(given.size()) + " images in " +
                              std::to_string(params.columns) + " columns, expected at least one of each");
  }
  std::vector<Node> images = given;
  int64_t width = 0, height = 0;
  for (Node& image : images) {
    if (params.fit_width > 0) {
      FitParams fit;
      fit.width = params.fit_width, fit.height = params.fit_height, fit.pad = true;
      image = Fit(image, fit);
    }
    width = std::max<int64_t>(width, image.spec().display_window.width());
    height = std::max<int64_t>(height, image.spec().display_window.height());
  }
  const auto most = std::max_element(images.begin(), images.end(), [](const Node& a, const Node& b) {
    return a.spec().channel_count() < b.spec().channel_count();
  });
  const int64_t columns = params.columns,
                rows = (static_cast<int64_t>(images.size()) + columns - 1) / columns;
  const int64_t all_wide = columns * width + (columns - 1) * params.pad,
                all_high = rows * height + (rows - 1) * params.pad;
  if (all_wide >= INT_MAX || all_high >= INT_MAX) {
    throw DataError("mosaic", "found a result of " + std::to_string(all_wide) + " x " +
                                  std::to_string(all_high) + " pixels, expected sides below 2^31");
  }
  ops::Placements placements{images[0].spec(), {}};
  placements.result.channels = most->spec().channels;
  placements.result.alpha = most->spec().alpha;
  placements.result.data_window =
      placements.result.display_window = {0, 0, static_cast<int>(all_wide), static_cast<int>(all_high)};
  if (std::all_of(images.begin(), images.end(), [](const Node& n) { return n.spec().data_window.empty(); }))
    placements.result.data_window = {};
  for (size_t k = 0; k < images.size(); ++k) {
    const auto i = static_cast<int64_t>(k);
    placements.at.push_back({static_cast<int>(i % columns * (width + params.pad)),
                             static_cast<int>(i / columns * (height + params.pad))});
  }
  return graph::MakeNode(std::make_shared<const ops::PasteOp>(std::move(placements)), std::move(images));
}

}  // namespace tessera
