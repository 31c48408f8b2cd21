// Pictures in parts: every operation on no more pixels than the engine says that it needs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "graph/topology.h"
#include "support/cases.h"
#include "support/pictures.h"
#include "tessera/error_kind.h"
#include "tessera/graph_json.h"
#include "tessera/ops/filter.h"
#include "tessera/prepared_graph.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::Case;
using ::testing::HasSubstr;
using testing::kWindow;
using testing::Picture;

// Memory that ends with the last pixel of a part: whatever reads beyond it is seen by the sanitizers.
struct Part {
  std::vector<std::byte> bytes;
  ImageSpec spec;
  ConstImageView view;

  Part(const Image& whole, const Roi& region) : spec(whole.spec()) {
    const size_t pixel = PixelBytes(spec.type) * spec.channels.size();
    bytes.resize(static_cast<size_t>(region.pixels()) * pixel);
    view = ConstImageView(bytes.data(), region, spec.channel_count(), spec.type);
    if (region.empty()) view = ConstImageView(nullptr, Roi(), spec.channel_count(), spec.type);
    for (int y = region.y0; y < region.y1; ++y) {
      std::memcpy(
          bytes.data() + static_cast<size_t>(y - region.y0) * static_cast<size_t>(region.width()) * pixel,
          whole.view().At(region.x0, y), static_cast<size_t>(region.width()) * pixel);
    }
  }
};

// The result's pixels, packed.
std::vector<std::byte> Pixels(const Node& node, const Roi& out, PixelType type) {
  std::vector<std::byte> pixels(static_cast<size_t>(out.pixels()) * node.spec().channels.size() *
                                PixelBytes(type));
  RenderInto(node, ImageView(pixels.data(), out, node.spec().channel_count(), type), {.threads = 1});
  return pixels;
}

// Whether the operation itself, or one of those that it is made of, reads all of an image.
bool NeedsWhole(const Node& node) {
  for (const Node& n : graph::TopologicalOrder(node)) {
    const graph::NodeData& d = *n.data();
    if (d.op->Kind() == graph::OpKind::kWhole) return true;
    for (size_t k = 0; k < d.inputs.size(); ++k) {
      if (d.op->NeedsWhole(static_cast<int>(k))) return true;
    }
  }
  return false;
}

std::vector<Roi> Regions(const Roi& all) {
  const int w = all.width(), h = all.height();
  return {{all.x0, all.y0, all.x0 + (w + 2) / 3, all.y0 + (h + 1) / 2},
          {all.x0 + w / 3, all.y0 + h / 3, all.x1 - w / 4, all.y1 - h / 4},
          {all.x1 - 1, all.y1 - 1, all.x1, all.y1},
          all};
}

class Parts : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Registry, Parts, ::testing::ValuesIn(testing::AllCases()), testing::CaseName);

TEST_P(Parts, GiveTheBitsOfTheWhole) {
  const Case& c = GetParam();
  for (const PixelType type : {PixelType::kUint8, PixelType::kFloat}) {
    std::vector<Image> pictures;
    std::vector<Node> whole, none;
    for (int k = 0; k < c.Operands(); ++k) {
      pictures.push_back(Picture(kWindow, 4, type, 7u * static_cast<uint32_t>(k) + 1));
      whole.push_back(FromImage(pictures.back()));
      none.push_back(FromPart(Part(pictures.back(), Roi()).view, pictures.back().spec()));
    }
    const ImageSpec like = Picture(kWindow, 4, type, 0).spec();
    const Node want = c.On(whole, like), open = c.On(none, like);
    if (NeedsWhole(want) && !none.empty()) {
      try {
        const PreparedGraph prepared(open);
      } catch (const DataError& e) {
        EXPECT_THAT(e.reason(), HasSubstr("all of which it needs"));
        EXPECT_THAT(e.reason(), HasSubstr(", expected "));
        continue;
      }
      // What needs a whole image may be of none of the parts, or be an identity.
    }
    const PreparedGraph prepared(open);
    for (const Roi& out : Regions(want.spec().data_window)) {
      if (out.empty()) continue;
      std::vector<Part> parts;
      parts.reserve(pictures.size());
      std::vector<Node> inputs;
      for (size_t k = 0; k < pictures.size(); ++k) {
        parts.emplace_back(pictures[k], prepared.RequiredRegion(none[k], out));
      }
      for (size_t k = 0; k < pictures.size(); ++k) inputs.push_back(FromPart(parts[k].view, parts[k].spec));
      EXPECT_EQ(Pixels(c.On(inputs, like), out, PixelType::kFloat), Pixels(want, out, PixelType::kFloat));
    }
  }
}

TEST(Part, OfAWindowHasItsHaloAndNoMore) {
  const Image picture = Picture({0, 0, 100, 80}, 3, PixelType::kFloat, 1);
  const Node none = FromPart(Part(picture, Roi()).view, picture.spec());
  const Node soft = GaussianBlur(none, {.sigma_x = 2, .sigma_y = 1, .wrap = Wrap::kClamp});
  const PreparedGraph prepared(soft);
  const Roi middle = prepared.RequiredRegion(none, {40, 30, 60, 50});
  EXPECT_EQ(middle.x0 + middle.x1, 100);
  EXPECT_EQ(middle.y0 + middle.y1, 80);
  EXPECT_LT(middle.x0, 40 - 4);
  EXPECT_GT(middle.x0, 40 - 16);
  EXPECT_LT(30 - middle.y0, 40 - middle.x0);
  // The border has pixels of the image alone.
  const Roi corner = prepared.RequiredRegion(none, {0, 0, 20, 20});
  EXPECT_EQ(corner.x0, 0);
  EXPECT_EQ(corner.y1, 20 + middle.y1 - 50);
  EXPECT_EQ(prepared.RequiredRegion(none, Roi()), Roi());
  EXPECT_THROW(prepared.RequiredRegion(none, {90, 0, 101, 1}), Error);
  EXPECT_THROW(prepared.RequiredRegion(FromImage(picture), {0, 0, 1, 1}), Error);
  EXPECT_THROW(prepared.RequiredRegion(Node(), {0, 0, 1, 1}), Error);
  // A name makes another node of the same pixels.
  EXPECT_EQ(PreparedGraph(Apply("blur", {AsInput(none, "plate")}, "sigma=2,1 wrap=clamp"))
                .RequiredRegion(none, {40, 30, 60, 50}),
            middle);
}

TEST(Part, ThatIsTooSmallIsRefused) {
  const Image picture = Picture({0, 0, 100, 80}, 3, PixelType::kFloat, 1);
  const Part part(picture, {10, 10, 40, 40});
  const Node soft = GaussianBlur(FromPart(part.view, part.spec), {.sigma_x = 2, .sigma_y = 2});
  EXPECT_EQ(Pixels(soft, {24, 24, 26, 26}, PixelType::kFloat).size(), 2u * 2 * 3 * 4);
  try {
    Pixels(soft, {12, 24, 26, 26}, PixelType::kFloat);
    ADD_FAILURE() << "was accepted";
  } catch (const DataError& e) {
    EXPECT_EQ(e.subject(), "part");
    EXPECT_THAT(e.reason(), HasSubstr("found pixels 30x30+10+10 of an image, expected "));
  }
  EXPECT_THROW(Render(soft), DataError);
}

TEST(Part, OfWhatNeedsTheWholeIsRefusedWithTheOtherMethod) {
  const Image picture = Picture({0, 0, 100, 80}, 3, PixelType::kFloat, 1);
  const Part part(picture, {10, 10, 40, 40});
  const Node image = FromPart(part.view, part.spec);
  try {
    const PreparedGraph prepared(Apply("blur", {image}, "sigma=20 method=recursive"));
    ADD_FAILURE() << "was accepted";
  } catch (const DataError& e) {
    EXPECT_EQ(e.subject(), "blur");
    EXPECT_THAT(e.reason(), HasSubstr("expected method=direct"));
  }
  EXPECT_NO_THROW(PreparedGraph(Apply("blur", {image}, "sigma=20 method=direct")));
  // An image that is there may be needed whole. This kernel begins at its centre: a halo on one side.
  const Node looked = Apply("convolve", {image, FromImage(Picture({0, 0, 3, 3}, 1, PixelType::kFloat, 2))});
  EXPECT_EQ(PreparedGraph(looked).RequiredRegion(image, {20, 20, 22, 22}), (Roi{18, 18, 22, 22}));
}

TEST(Part, ThatIsNoneIsRefused) {
  const Image picture = Picture({0, 0, 10, 8}, 3, PixelType::kFloat, 1);
  ConstImageView view = picture.view();
  view.roi = {1, 0, 11, 8};
  EXPECT_THROW(FromPart(view, picture.spec()), Error);
  view = picture.view(), view.channels = 2;
  EXPECT_THROW(FromPart(view, picture.spec()), Error);
  view = picture.view(), view.data = nullptr;
  EXPECT_THROW(FromPart(view, picture.spec()), Error);
}

}  // namespace
}  // namespace tessera
