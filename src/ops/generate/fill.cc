// Fills a rectangle of an image: one colour, or a gradient between two sides or four corners.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/arithmetic/operands.h"
#include "ops/generate/generate_ops.h"
#include "ops/generate/generators.h"
#include "ops/modifiers.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/generate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/generate/fill.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

// Corners by plane: top left, top right, bottom left, bottom right.
struct FillStage final : graph::PointStage {
  Roi box, steps;  // steps: from the first pixel to the last
  double corners[4][4];

  void Run(const graph::PointArgs& args) const override {
    const s::D d;
    const s::DI di;
    const bool inside = args.y >= box.y0 && args.y < box.y1;
    const double v = (args.y - steps.y0) / static_cast<double>(std::max(1, steps.height()));
    float left[4], right[4];
    for (int c = 0; c < 4; ++c) {
      left[c] = static_cast<float>(corners[0][c] * (1 - v) + corners[2][c] * v);
      right[c] = static_cast<float>(corners[1][c] * (1 - v) + corners[3][c] * v);
    }
    const s::V one = hn::Set(d, 1.0f), across = hn::Set(d, static_cast<float>(std::max(1, steps.width())));
    for (int i = 0; i < args.count; i += s::kLanes) {
      const s::Pixels in = s::LoadPlanes(args.in[0], i);
      if (!inside) {
        s::StorePlanes(in, args.out, i);
        continue;
      }
      const s::VI x = s::Position(args, i).X();
      const auto filled =
          hn::RebindMask(d, hn::And(hn::Gt(x, hn::Set(di, box.x0 - 1)), hn::Gt(hn::Set(di, box.x1), x)));
      const s::V u = hn::Div(hn::ConvertTo(d, hn::Sub(x, hn::Set(di, steps.x0))), across);
      const auto mixed = [&](int c, s::V old) HWY_ATTR {
        const s::V first = hn::Set(d, left[c]), last = hn::Set(d, right[c]);
        const s::V value = left[c] == right[c] ? first : hn::MulAdd(last, u, hn::Mul(first, hn::Sub(one, u)));
        return hn::IfThenElse(filled, value, old);
      };
      s::StorePlanes({mixed(0, in.r), mixed(1, in.g), mixed(2, in.b), mixed(3, in.a)}, args.out, i);
    }
  }
};

std::unique_ptr<graph::PointStage> MakeFillBox(const Roi& box, const Roi& steps, const double (*corners)[4]) {
  auto stage = std::make_unique<FillStage>();
  stage->box = box, stage->steps = steps;
  for (int k = 0; k < 4; ++k) std::copy_n(corners[k], 4, stage->corners[k]);
  return stage;
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeFillBox);

class FillOp final : public graph::OpWith<FillParams> {
 public:
  explicit FillOp(FillParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "fill"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  bool IsIdentity() const override { return params().box.empty(); }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    const FillParams& p = params();
    const std::vector<double>* const colors[4] = {&p.top_left, &p.top_right, &p.bottom_left, &p.bottom_right};
    double corners[4][4];
    for (int k = 0; k < 4; ++k) {
      for (int c = 0; c < 4; ++c) corners[k][c] = ChannelValue(*colors[k], context.channels[c], 1);
    }
    const Roi steps{p.box.x0, p.box.y0, p.box.x1 - 1, p.box.y1 - 1};
    return HWY_DYNAMIC_DISPATCH(MakeFillBox)(p.box, steps, corners);
  }
};

// What is written, as corners; the rest of the words must be absent.
FillParams Written(const Arguments& a, const Roi& box) {
  struct Form {
    std::vector<const char*> words;  // all of them, and no other
    const char* corners[4];          // which one is top left, top right, bottom left, bottom right
  };
  static const Form kForms[] = {{{"topleft", "topright", "bottomleft", "bottomright"},
                                 {"topleft", "topright", "bottomleft", "bottomright"}},
                                {{"top", "bottom"}, {"top", "top", "bottom", "bottom"}},
                                {{"left", "right"}, {"left", "right", "left", "right"}},
                                {{"color"}, {"color", "color", "color", "color"}}};
  size_t given = 0;
  for (const Form& form : kForms) {
    for (const char* const word : form.words) given += a.Given(word) ? 1 : 0;
  }
  if (given == 0) return {.box = box};
  for (const Form& form : kForms) {
    const bool all =
        std::all_of(form.words.begin(), form.words.end(), [&](const char* word) { return a.Given(word); });
    if (!all || given != form.words.size()) continue;
    return {.box = box,
            .top_left = a.Numbers(form.corners[0]),
            .top_right = a.Numbers(form.corners[1]),
            .bottom_left = a.Numbers(form.corners[2]),
            .bottom_right = a.Numbers(form.corners[3])};
  }
  throw Error("fill",
              "found another choice of colours, expected color=, or top= and bottom=, or left= and "
              "right=, or topleft=, topright=, bottomleft= and bottomright=");
}

}  // namespace

OpInfo FillInfo() {
  OpInfo info;
  info.name = "fill";
  info.family = "generate";
  info.summary = "Fill a rectangle with a colour or a gradient";
  info.help =
      "GEOM is a rectangle as --crop takes it. Its pixels become color=, or a mix of top= and bottom=, of left= "
      "and right=, or of all four corners, which the pixels at its edges have; white where nothing is named. "
      "What lies beyond the image does not count: a gradient runs over the part inside, as oiiotool's. A colour "
      "of one value serves every channel, alpha included; channels beyond a longer list get 1, values beyond "
      "the last channel are ignored. Other pixels keep their bits.";
  info.bound = "4 u * the largest corner; one colour: 1 rounding";
  info.bound_u = 4;
  info.arguments = {TextModifier("GEOM", "a geometry like 640x480+10+20 or 10,20,649,499")};
  for (const auto& [name, help] : {std::pair{"color", "everywhere"},
                                   {"top", "of the first row, with bottom="},
                                   {"bottom", "of the last row"},
                                   {"left", "of the first column, with right="},
                                   {"right", "of the last column"},
                                   {"topleft", "of that corner, with the other three"},
                                   {"topright", "of that corner"},
                                   {"bottomleft", "of that corner"},
                                   {"bottomright", "of that corner"}}) {
    info.modifiers.push_back(ColorModifier(name, "1", help));
  }
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Fill(in[0], Written(a, ParseGeometry(a.Text("GEOM"), in[0].spec().data_window)));
  };
  info.examples = {"19x7+3+2 color=1,0.5,0,1", "25x40+1+1 top=0.1,0.2,0.3 bottom=0.9",
                   "30x5-12+4 left=-1 right=2,0.5,3,1",
                   "-3,-2,70,5 topleft=0 topright=1,0,0 bottomleft=0,1,0 bottomright=0,0,1", "1x1+4+4"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Fill(const Node& image, const FillParams& params) {
  for (const auto* const color :
       {&params.top_left, &params.top_right, &params.bottom_left, &params.bottom_right})
    ops::RequireConstants("fill", *color);
  FillParams inside = params;
  inside.box = Intersection(params.box, image.spec().data_window);
  if (inside.box.empty()) inside.box = {};
  return graph::MakeNode(std::make_shared<const ops::FillOp>(std::move(inside)), {image});
}

}  // namespace tessera
#endif  // HWY_ONCE
