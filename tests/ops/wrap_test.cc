// One enum for what lies beyond an edge: what an operation does not have is refused by name.
#include "tessera/wrap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "support/refusal.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/bump.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/flow.h"
#include "tessera/ops/geometry.h"
#include "tessera/ops/lookup.h"
#include "tessera/table.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr Wrap kAll[] = {Wrap::kBlack,     Wrap::kClamp,       Wrap::kRepeat, Wrap::kMirror,
                         Wrap::kMirror101, Wrap::kRenormalize, Wrap::kValid,  Wrap::kGlClamp};

Node Zeros(std::vector<std::string> channels) {
  ImageSpec spec;
  spec.channels = std::move(channels);
  spec.data_window = spec.display_window = {0, 0, 4, 4};
  return FromImage(Image(spec));
}

// Those of kAll that make() takes; the others' message ends with `expected`.
template <class Make>
std::vector<Wrap> Taken(const char* expected, const Make& make) {
  std::vector<Wrap> taken;
  for (const Wrap wrap : kAll) {
    try {
      make(wrap);
      taken.push_back(wrap);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(expected));
      EXPECT_THAT(error.what(), HasSubstr("wrap"));
    }
  }
  return taken;
}

TEST(Wrap, WhatAnOperationHasNotIsRefusedByName) {
  const Node y = Zeros({"Y"}), st = Zeros({"s", "t"});
  const std::vector<Wrap> image = {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror};
  const char* const four = "expected black, clamp, repeat or mirror";
  EXPECT_EQ(Taken(four, [&](Wrap w) { Mip(y, {"box", w, 1}); }), image);
  EXPECT_EQ(Taken(four, [&](Wrap w) { Shift(y, {1, 1, "box", w}); }), image);
  EXPECT_EQ(Taken(four, [&](Wrap w) { Warp(y, {{1, 0, 0, 0, 1, 0, 1, 0, 1}, "box", w}); }), image);
  EXPECT_EQ(Taken(four, [&](Wrap w) { StWarp(y, st, {"box", w, Wrap::kClamp}); }), image);
  EXPECT_EQ(Taken(four, [&](Wrap w) { StWarp(y, st, {"box", Wrap::kClamp, w}); }), image);
  EXPECT_EQ(Taken(four, [&](Wrap w) { Distort(y, st, {.amount = 1, .wrap = w}); }), image);
  EXPECT_EQ(Taken(four, [&](Wrap w) { HeightToNormals(y, {.wrap = w}); }), image);
  EXPECT_EQ(Taken(four, [&](Wrap w) { Bump(y, {.wrap = w}); }), image);

  std::vector<Wrap> sums = image;
  sums.push_back(Wrap::kMirror101);
  EXPECT_EQ(Taken("mirror or mirror101", [&](Wrap w) { Sobel(y, {.wrap = w}); }), sums);

  EXPECT_EQ(Taken("expected renormalize, clamp or repeat", [&](Wrap w) { Lic(st, {.wrap = w}); }),
            (std::vector<Wrap>{Wrap::kClamp, Wrap::kRepeat, Wrap::kRenormalize}));

  std::vector<Wrap> tables = image;
  tables.push_back(Wrap::kGlClamp);
  const Table table({2}, 1, std::vector<float>{0, 1}, TableAlign::kEnds);
  EXPECT_EQ(Taken("glclamp, black, repeat or mirror", [&](Wrap w) { Lookup(y, table, {.wrap = {w}}); }),
            tables);
  EXPECT_EQ(Taken("kGlClamp, kBlack, kRepeat", [&](Wrap w) { MipChain(table, MipFilter::kBox, {w}); }),
            tables);

  std::vector<Wrap> filters = sums;
  filters.push_back(Wrap::kRenormalize), filters.push_back(Wrap::kValid);
  EXPECT_EQ(Taken("renormalize or valid", [&](Wrap w) { GaussianBlur(y, {.sigma_x = 1, .wrap = w}); }),
            filters);
  EXPECT_EQ(Taken("renormalize or valid", [&](Wrap w) { BoxBlur(y, {.width = 3, .height = 3, .wrap = w}); }),
            filters);
  EXPECT_EQ(Taken("renormalize or valid", [&](Wrap w) { Convolve(y, NamedKernel("gaussian"), {.wrap = w}); }),
            filters);
}

}  // namespace
}  // namespace tessera
