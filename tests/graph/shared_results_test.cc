// Results that more than one operation reads: no rule may take them away from the other reader.
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "support/apply.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Apply;
using testing::Content;
using testing::ExpectSameBits;
using testing::Picture;
using testing::UnifyNans;
using testing::Words;

using T = PixelType;

// One after the other.
Node ApplyAll(const std::vector<Words>& all, Node node) {
  for (const Words& words : all) node = Apply(words, {node});
  return node;
}

constexpr char kMatrix[] = "0.5,0.25,0.25,0.1,0.8,0.1,0.3,0.3,0.4";
const Roi kWindow{-5, 3, 4 * kBlockPixels + 30, 8};

Image Unified(const Node& node, T type, const RenderOptions& options) {
  const Image image = Render(node, type, options);
  UnifyNans(image);
  return image;
}

// The graph at once, the rules that keep bits on, against all of them off; and where `shared` has been
// computed before.
void ExpectAlike(const std::function<Node(const Node&)>& make, const Node& shared, T type) {
  const Image plain = Unified(make(shared), type, {.rules_off = {"all"}});
  ExpectSameBits(Unified(make(shared), type, {.rules_off = {"codes"}}), plain);
  ExpectSameBits(Unified(make(shared), type, {.tile_width = 37, .tile_height = 2, .rules_off = {"codes"}}),
                 plain);
  // The optimiser may fold what has been computed before into what follows.
  const RenderOptions unfolded{.optimize = false, .rules_off = {"all"}};
  const Node before = FromImage(Render(shared, T::kFloat, unfolded));
  ExpectSameBits(Unified(make(before), type, unfolded), Unified(make(shared), type, unfolded));
}

TEST(SharedResults, OfPointOperationsAreThereForEveryReader) {
  const std::vector<std::vector<Words>> firsts = {{{"ccmatrix", kMatrix}, {"clamp", "min=0 max=1"}},
                                                  {{"saturate", "1.5"}, {"clamp", "min=0.1 max=0.9"}},
                                                  {{"mulc", "0.5"}},
                                                  {{"premult", ""}},
                                                  {{"hue", "30"}}};
  const std::vector<std::vector<Words>> seconds = {{{"ccmatrix", kMatrix}},
                                                   {{"hue", "-75"}, {"clamp", "min=0 max=1"}},
                                                   {{"addc", "0.25"}},
                                                   {{"invert", ""}}};
  for (const std::string& target : SimdTargets()) {
    SetSimdTarget(target);
    for (const auto& first : firsts) {
      for (const auto& second : seconds) {
        for (const T type : {T::kUint8, T::kFloat}) {
          SCOPED_TRACE(std::string(first[0].op) + ", " + second[0].op + " on " + target + " to " +
                       PixelTypeName(type));
          const Node shared = ApplyAll(first, FromImage(Picture(kWindow, 4, type, 3, Content::kOrdinary)));
          for (const Words joint : {Words{"sub", ""}, Words{"blend", "over"}, Words{"chappend", ""}}) {
            ExpectAlike([&](const Node& a) { return Apply(joint, {a, ApplyAll(second, a)}); }, shared, type);
            ExpectAlike([&](const Node& a) { return Apply(joint, {ApplyAll(second, a), a}); }, shared, type);
          }
          ExpectAlike([&](const Node& a) { return Apply({"add", ""}, {a, a}); }, shared, type);
        }
      }
    }
  }
  SetSimdTarget("auto");
}

// Windows of other sizes and borders over one tile, and pixels of it beside them.
TEST(SharedResults, OfTilesReachAsFarAsEveryReaderAsks) {
  const std::vector<Words> windows = {{"blur", "9x3"}, {"median", "3x3"}, {"sobel", ""}, {"shift", "5,-2"}};
  for (const Words& one : windows) {
    for (const Words& other : windows) {
      SCOPED_TRACE(std::string(one.op) + ", " + other.op);
      const Node source = FromImage(Picture({-3, 2, 130, 60}, 4, T::kFloat, 9));
      const Node shared = Apply({"mad", ""}, {source, source, source});
      const auto make = [&](const Node& a) {
        return Apply({"sub", ""}, {Apply(one, {a}), Apply(other, {a})});
      };
      ExpectAlike(make, shared, T::kFloat);
      const auto beside = [&](const Node& a) { return Apply({"sub", ""}, {a, Apply(one, {a})}); };
      ExpectAlike(beside, shared, T::kFloat);
    }
  }
}

}  // namespace
}  // namespace tessera
