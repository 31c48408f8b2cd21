// The laws that every operation of the registry obeys, on every instruction set of this machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "graph/little_memory.h"
#include "graph/op.h"
#include "graph/topology.h"
#include "ops/registry.h"
#include "support/cases.h"
#include "support/every_target.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "tessera/verify.h"
#include "verify/evaluate.h"

namespace tessera {
namespace {

using testing::AllCases;
using testing::AutoTarget;
using testing::Case;
using testing::Content;
using testing::ExpectSameBits;
using testing::kWindow;
using testing::OnEveryTarget;
using testing::Picture;
using testing::StoreSample;
using testing::UnifyNans;
using testing::Unpacked;

double BoundOf(const std::string& name) {
  const ops::OpInfo* const op = ops::FindOp(name);
  return op == nullptr ? 0 : op->bound_u;
}

// What the reference makes of a node: the same on every target, so it is asked for once.
verify::Evaluated Expected(const Node& node) {
  return verify::ReferenceEngine(BoundOf).Evaluate(node, node.spec().data_window);
}
// Float32 result against that within its tolerance.
void ExpectWithinBound(const verify::Evaluated& want, const Image& got) {
  const Roi& window = got.spec().data_window;
  int wrong = 0;
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      for (int c = 0; c < got.spec().channel_count() && wrong < 3; ++c) {
        if (want.JumpAt(x, y, c) > 0) continue;  // hangs on a decision within its own error
        const double reference = want.value.at(x, y, c), value = got.at<float>(x, y, c);
        const double tolerance = want.tolerance.at(x, y, c) * (1 + 1e-6);
        if (value != reference && !(std::fabs(value - reference) <= tolerance)) {  // infinities are the same
          ++wrong;
          ADD_FAILURE() << "at " << x << "," << y << " channel " << c << ": " << value << ", expected "
                        << reference << " within " << tolerance << ", off by "
                        << std::fabs(value - reference);
        }
      }
    }
  }
}

// Nothing is kept: what one evaluation has prepared another one prepares again.
const bool kNothingKept = [] {
  Context::Default().Limit({.cache = 0});
  return true;
}();

class Laws : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Registry, Laws, ::testing::ValuesIn(AllCases()), testing::CaseName);

TEST_P(Laws, ResultIsWithinTheBoundOfTheReference) {
  for (const int channels : {3, 4, 6}) {
    for (const PixelType type :
         {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
      SCOPED_TRACE(std::to_string(channels) + " channels of " + PixelTypeName(type));
      const Node node = GetParam().Make(kWindow, channels, type);
      // The bound is the operation's own: its inputs are the floats that the samples become. Defaults may
      // depend on the samples' type, so the operation is the one that was made for them.
      const Node floats = GetParam().Make(kWindow, channels, type, Content::kOrdinary, true);
      const graph::NodeData &made = *node.data(), &of_floats = *floats.data();
      const bool alike = made.op->Name() == of_floats.op->Name() && !of_floats.inputs.empty();
      const auto want = Expected(alike ? graph::MakeNode(made.op, of_floats.inputs) : floats);
      OnEveryTarget([&] { ExpectWithinBound(want, Render(node)); });
    }
  }
}

TEST_P(Laws, TilesAndThreadsAndOrderDoNotMatter) {
  const Node node = GetParam().Make(kWindow, 4, PixelType::kFloat, Content::kSpecial);
  OnEveryTarget([&] {
    const Image whole = Render(node, PixelType::kFloat, {.threads = 1});
    const int tiles[][2] = {{1, 1}, {17, 13}, {4096, 1}, {53, 19}};
    for (const auto& tile : tiles) {
      SCOPED_TRACE(std::to_string(tile[0]) + "x" + std::to_string(tile[1]));
      for (const int threads : {1, 2, 3, 8}) {
        if (tile[0] == 1 && threads > 2) continue;
        ExpectSameBits(whole, Render(node, PixelType::kFloat,
                                     {.threads = threads, .tile_width = tile[0], .tile_height = tile[1]}));
      }
      ExpectSameBits(whole, Render(node, PixelType::kFloat,
                                   {.tile_width = tile[0], .tile_height = tile[1], .shuffle_tiles = true}));
    }
  });
}

// Nothing fits into a budget of one byte: whatever can be computed another way is.
TEST_P(Laws, WithoutMemoryTheBoundStays) {
  const Node node = GetParam().Make(kWindow, 4, PixelType::kFloat);
  const auto want = Expected(node);
  OnEveryTarget([&] { ExpectWithinBound(want, Render(node, PixelType::kFloat, {.memory_budget = 1})); });
}

TEST_P(Laws, WhatIsHeldWholeIsSaidByTheHelp) {
  bool is_whole = false;
  for (const Node& n : graph::TopologicalOrder(GetParam().Make(kWindow, 4, PixelType::kFloat))) {
    const graph::Op& op = *n.data()->op;
    is_whole |= op.Kind() == graph::OpKind::kWhole && !graph::PrefersRows(op);
    for (size_t k = 0; k < n.data()->inputs.size(); ++k) {
      const bool is_small = graph::PrefersRows(*n.data()->inputs[k].data()->op);
      is_whole |= op.NeedsWhole(static_cast<int>(k)) && !is_small;
    }
  }
  if (!is_whole) GTEST_SKIP() << "nothing is";
  EXPECT_NE(GetParam().op->help.find("memory whole"), std::string::npos) << GetParam().op->help;
}

TEST_P(Laws, WidthsDoNotMatter) {
  const Case& c = GetParam();
  const Node node = c.Make({-5, 3, 62, 5}, 4, PixelType::kFloat);
  const Roi all = node.spec().data_window;  // not all results are where their inputs are
  if (all.empty()) GTEST_SKIP() << "the result has no pixels";
  OnEveryTarget([&] {
    const Image whole = Render(node);
    for (int width = 1; width <= std::min(67, all.width()); ++width) {
      const Roi part{all.x0, all.y0, all.x0 + width, std::min(all.y0 + 2, all.y1)};
      const Image image = Render(Crop(node, part));
      for (int y = part.y0; y < part.y1; ++y) {
        ASSERT_EQ(std::memcmp(image.view().At(part.x0, y), whole.view().At(part.x0, y),
                              static_cast<size_t>(width) * 4 * image.spec().channels.size()),
                  0)
            << "width " << width;
      }
    }
  });
}

TEST_P(Laws, SmallestAndEmptyImagesWork) {
  const Case& c = GetParam();
  OnEveryTarget([&] {
    const Node one = c.Make({4, 4, 5, 5}, 4, PixelType::kFloat);
    ExpectWithinBound(Expected(one), Render(one));
    if (c.op->name == "crop" || c.op->name == "cut" || c.op->name == "mean" ||
        (c.Operands() == 0 && !c.op->generator))
      return;  // has a size of its own
    const Node none = c.Make({}, 4, PixelType::kFloat);
    EXPECT_EQ(Render(none).spec().data_window.pixels(), 0);
  });
}

TEST_P(Laws, LazyEqualsEagerWithTheOptimiserOff) {
  const Case& c = GetParam();
  const ops::OpInfo* const before = ops::FindOp("mad");
  const RenderOptions off{.optimize = false};
  OnEveryTarget([&] {
    if (c.Operands() == 0) {  // what makes pictures stands below something else
      const Node made = c.Make(kWindow, 4, PixelType::kFloat);
      const Node other =
          FromImage(Picture(made.spec().data_window, made.spec().channel_count(), PixelType::kHalf, 3));
      const auto above = [&](const Node& node) {
        return before->make(std::vector{node, other, other}, ops::ParseExample(*before, ""), nullptr);
      };
      ExpectSameBits(Render(above(made), PixelType::kFloat, off),
                     Render(above(FromImage(Render(made, PixelType::kFloat, off))), PixelType::kFloat, off));
      return;
    }
    // Something computed below the operation, and it and a sum above.
    std::vector<Node> lazy, eager;
    for (int k = 0; k < c.Operands(); ++k) {
      const std::vector<Node> pictures(
          3, FromImage(Picture(kWindow, 4, PixelType::kHalf, static_cast<uint32_t>(k) + 3)));
      lazy.push_back(before->make(pictures, ops::ParseExample(*before, ""), nullptr));
      eager.push_back(FromImage(Render(lazy.back(), PixelType::kFloat, off)));
    }
    ExpectSameBits(Render(c.On(lazy, {}), PixelType::kFloat, off),
                   Render(c.On(eager, {}), PixelType::kFloat, off));
  });
}

TEST_P(Laws, OptimiserOnEqualsOffWithinTheBound) {
  const Case& c = GetParam();
  const ops::OpInfo* const scale = ops::FindOp("mulc");
  Node node = c.Make(kWindow, 4, PixelType::kFloat);
  node = scale->make(std::vector{node}, ops::ParseExample(*scale, "1.25,0.5,2,1"), nullptr);
  const auto want = Expected(node);
  OnEveryTarget([&] {
    ExpectWithinBound(want, Render(node, PixelType::kFloat, {.optimize = true}));
    ExpectWithinBound(want, Render(node, PixelType::kFloat, {.optimize = false}));
  });
}

// An operation on pictures of the first channel count that its result has too, or null.
Node WithAsManyChannels(const Case& c, std::vector<Image>& pictures) {
  for (const int channels : {4, 3, 1, 2, 5, 6}) {
    pictures.clear();
    std::vector<Node> inputs;
    for (int k = 0; k < c.Operands(); ++k) {
      pictures.push_back(Picture(kWindow, channels, PixelType::kFloat, 1 + 50u * static_cast<uint32_t>(k)));
      inputs.push_back(FromImage(pictures.back()));
    }
    try {
      Node node = c.On(inputs, {});
      if (node.spec().channel_count() == channels) return node;
    } catch (const Error&) {
      // Not for so few channels.
    }
  }
  return {};
}

TEST_P(Laws, InPlaceEqualsOutOfPlace) {
  const Case& c = GetParam();
  if (c.Operands() == 0) GTEST_SKIP() << "no operand whose place the result could take";
  std::vector<Image> pictures;
  const Node any = WithAsManyChannels(c, pictures);
  if (any.data() == nullptr) GTEST_SKIP() << "the result never has as many channels as its operand";
  if (any.spec().data_window != pictures[0].spec().data_window)
    GTEST_SKIP() << "the result has a size of its own";
  const graph::OpKind kind = any.data()->op->Kind();
  if (kind == graph::OpKind::kTile || kind == graph::OpKind::kWhole) {
    GTEST_SKIP() << "promised for point operations only: this one reads neighbours";
  }
  OnEveryTarget([&] {
    const Node node = WithAsManyChannels(c, pictures);  // anew: it is written over
    const Image apart = Render(node);
    RenderInto(node, pictures[0].view());
    ExpectSameBits(apart, Image(pictures[0]));
  });
}

// The reference asks an operation itself where its channels come from, so it cannot tell.
TEST_P(Laws, ChannelsComeFromWhereTheArgumentsSay) {
  const Case& c = GetParam();
  if (c.op->name != "ch" && c.op->name != "chappend" && c.op->name != "chnames") {
    GTEST_SKIP() << "computes something";
  }
  std::vector<Image> pictures;
  std::vector<Node> inputs;
  for (int k = 0; k < c.Operands(); ++k) {
    pictures.push_back(Picture(kWindow, 4, PixelType::kFloat, 11u + static_cast<uint32_t>(k)));
    inputs.push_back(FromImage(pictures.back()));
  }
  struct Origin {
    int picture, channel;  // -1: a constant
    float value;
  };
  std::vector<Origin> origins;
  if (c.op->name == "ch") {
    std::istringstream words(c.example);
    for (std::string word; std::getline(words, word, ',');) {
      const size_t equals = word.find('=');
      origins.push_back(equals == std::string::npos ? Origin{0, std::stoi(word), 0}
                                                    : Origin{-1, 0, std::stof(word.substr(equals + 1))});
    }
  } else {
    for (int k = 0; k < c.Operands(); ++k) {
      for (int channel = 0; channel < 4; ++channel) origins.push_back({k, channel, 0});
    }
  }
  const Image image = Render(c.On(inputs, {}));
  ASSERT_EQ(image.spec().channels.size(), origins.size());
  for (int y = kWindow.y0; y < kWindow.y1; ++y) {
    for (int x = kWindow.x0; x < kWindow.x1; ++x) {
      for (size_t k = 0; k < origins.size(); ++k) {
        const Origin& from = origins[k];
        const float want = from.picture < 0
                               ? from.value
                               : pictures[static_cast<size_t>(from.picture)].at<float>(x, y, from.channel);
        ASSERT_EQ(image.at<float>(x, y, static_cast<int>(k)), want) << x << "," << y << " channel " << k;
      }
    }
  }
}

class IdentityLaw : public ::testing::TestWithParam<const ops::OpInfo*> {};
INSTANTIATE_TEST_SUITE_P(Registry, IdentityLaw, ::testing::ValuesIn(testing::AllRows()), testing::RowName);

// Of several operands all are the same picture.
TEST_P(IdentityLaw, ReturnsTheInputsBits) {
  const ops::OpInfo& op = *GetParam();
  std::string words = op.identity;
  if (op.name == "crop") {  // to the picture's own window
    words = std::to_string(kWindow.width()) + "x" + std::to_string(kWindow.height()) + "-5+3";
  }
  if (words.empty()) GTEST_SKIP() << "the row knows no arguments that return the input";
  const Case c{&op, words};
  OnEveryTarget([&] {
    for (const Content content : {Content::kOrdinary, Content::kSpecial}) {
      const Image in = Picture(kWindow, 4, PixelType::kFloat, 5, content);
      const Node node = c.On(std::vector<Node>(static_cast<size_t>(c.Operands()), FromImage(in)), {});
      ExpectSameBits(Render(node), in);
    }
  });
}

TEST(LawsTest, NansOfAnySignAreAlike) {
  for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
    ImageSpec spec(3, 1, 1);
    spec.type = type;
    const Image one(spec), other(spec);
    for (const double sign : {-1, 1}) {
      const Image& image = sign < 0 ? one : other;
      StoreSample(image.view(), 0, 0, 0, -INFINITY);
      StoreSample(image.view(), 1, 0, 0, std::copysign(NAN, sign));
      StoreSample(image.view(), 2, 0, 0, 0.5);
    }
    UnifyNans(one);
    UnifyNans(other);
    ExpectSameBits(one, other);
  }
}

TEST_P(Laws, TargetsWithFusedMultiplyAddAgreeInEveryBit) {
  if (!testing::HasBothFusedTargets()) GTEST_SKIP() << "there are not both AVX2 and AVX-512";
  const AutoTarget restore;
  for (const PixelType type : {PixelType::kUint8, PixelType::kHalf, PixelType::kFloat}) {
    const Node node = GetParam().Make(kWindow, 4, type, Content::kSpecial);
    SetSimdTarget("AVX2");
    const Image avx2 = Render(node);
    SetSimdTarget("AVX3");
    const Image avx3 = Render(node);
    UnifyNans(avx2);
    UnifyNans(avx3);
    ExpectSameBits(avx2, avx3);
  }
}

TEST_P(Laws, TypesOfResultsRoundTheFloatResult) {
  const Node node = GetParam().Make(kWindow, 4, PixelType::kFloat);
  OnEveryTarget([&] {
    const Image exact = Render(node);
    for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf}) {
      const Image packed = Render(node, type);
      Image expected(packed.spec());
      const Roi& w = node.spec().data_window;
      for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
          for (int c = 0; c < exact.spec().channel_count(); ++c) {
            StoreSample(expected.view(), x, y, c, exact.at<float>(x, y, c));
          }
        }
      }
      ExpectSameBits(packed, expected);
    }
  });
}

TEST(Registry, RandomChainsStayWithinTheirBounds) {
  const AutoTarget restore;
  std::vector<Case> cases;
  for (const Case& c : AllCases()) {
    // A quantised value may take the neighbouring code when its input is off by a rounding, and a division's
    // error has no bound near alpha 0: neither can be chained. Nor can look-ups and gathers, whose response
    // to an error of a coordinate has none.
    const std::set<std::string> families = {"color", "arithmetic", "curve", "ocio"};
    if (families.count(c.op->family) && c.op->name != "quantize" && c.op->name != "unpremult" &&
        c.op->name != "repremult" && c.op->name != "dof" && c.op->name != "transfer" &&
        c.example.find("unpremult") == std::string::npos && c.example.find("bits") == std::string::npos &&
        c.op->name != "contrast") {
      cases.push_back(c);
    }
  }
  ASSERT_GT(cases.size(), 20u);
  std::mt19937 random(20);
  for (int chain = 0; chain < 40; ++chain) {
    std::vector<Node> nodes;
    for (uint32_t k = 0; k < 3; ++k)
      nodes.push_back(FromImage(Picture(kWindow, 4, PixelType::kFloat, 90 + k)));
    std::string words;
    for (int length = 0; length < 8; ++length) {
      const Case& c = cases[random() % cases.size()];
      std::vector<Node> inputs;
      for (int k = 0; k < c.Operands(); ++k) inputs.push_back(nodes[nodes.size() - 1 - random() % 3]);
      const Node node = c.On(inputs, {});
      if (node.spec().channel_count() != 4) continue;
      nodes.push_back(node);
      words += " --" + c.op->name + " " + c.example;
    }
    SCOPED_TRACE(words);
    for (const std::string& target : SimdTargets()) {
      SetSimdTarget(target);
      const VerifyReport report =
          Verify(nodes.back(), PixelType::kFloat, {.samples = 4, .tile_size = 32, .render = {}});
      EXPECT_TRUE(report.within_bound) << target << ": " << report.Summary();
      EXPECT_GT(report.samples, 0);
    }
  }
}

}  // namespace
}  // namespace tessera
