// Whose turn it is when something fails: what was asked for, what it was asked of, the system, the caller.
#include "tessera/error_kind.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "support/run_command.h"
#include "tessera/io.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/geometry.h"
#include "tessera/render.h"
#include "tessera/table.h"

namespace tessera {
namespace {

// The kind of what an action throws.
ErrorKind Kind(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& e) {
    return KindOf(e);
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorKind::kUsage;
}

Node Picture(int width, int channels) { return FromImage(Image(ImageSpec(width, 8, channels))); }

TEST(ErrorKindTest, WhatNoImageMakesRightIsUsage) {
  const Node image = Picture(8, 3);
  EXPECT_EQ(Kind([&] { GaussianBlur(image, -1); }), ErrorKind::kUsage);
  EXPECT_EQ(Kind([&] { Zoom(image, {.x = 0}); }), ErrorKind::kUsage);
  EXPECT_EQ(Kind([&] { ParseGeometry("0x0", {}); }), ErrorKind::kUsage);
  EXPECT_EQ(Kind([&] { Convolve(image, NamedKernel("none", 3, 3)); }), ErrorKind::kUsage);
}

TEST(ErrorKindTest, WhatAnotherImageMakesRightIsData) {
  EXPECT_EQ(Kind([] { Add(Picture(8, 3), Picture(8, 2)); }), ErrorKind::kData);
  EXPECT_EQ(Kind([] { SelectChannels(Picture(8, 3), "Q"); }), ErrorKind::kData);
  EXPECT_EQ(Kind([] { ColorMatrix(Picture(8, 1), {{1, 0, 0, 0, 1, 0, 0, 0, 1}}); }), ErrorKind::kData);
  EXPECT_EQ(Kind([] { Mip(Picture(8, 3), {.level = 9}); }), ErrorKind::kData);
}

TEST(ErrorKindTest, FilesThatAreMissingAreDataAndThoseRefusedAreTheSystems) {
  const testing::TemporaryDirectory directory;
  const std::string at = directory.path().string();
  EXPECT_EQ(Kind([&] { Read(at + "/none.exr"); }), ErrorKind::kData);
  EXPECT_EQ(Kind([&] { Read(at); }), ErrorKind::kData);
  EXPECT_EQ(Kind([&] { Write(Picture(8, 3), at + "/none/a.exr"); }), ErrorKind::kData);
  EXPECT_EQ(Kind([&] { Write(Picture(8, 3), "/dev/full/a.exr"); }), ErrorKind::kSystem);
}

TEST(ErrorKindTest, MemoryIsTheSystemsAndTheEndTheCallers) {
  EXPECT_EQ(Kind([] { Image(ImageSpec(1 << 30, 1 << 30, 4)); }), ErrorKind::kSystem);
  RenderOptions options;
  options.progress = [](double) { return false; };
  EXPECT_EQ(Kind([&] { Render(GaussianBlur(Picture(64, 3), 2), PixelType::kFloat, options); }),
            ErrorKind::kCancelled);
}

TEST(ErrorKindTest, AnotherSubjectKeepsTheKind) {
  EXPECT_THROW(ThrowAbout("b", DataError("a", "bad")), DataError);
  EXPECT_THROW(ThrowAbout("b", SystemError("a", "bad")), SystemError);
  EXPECT_THROW(ThrowAbout("b", Cancelled()), Cancelled);
  try {
    ThrowAbout("b", Error("a", "bad"));
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "b: bad");
    EXPECT_EQ(KindOf(e), ErrorKind::kUsage);
  }
}

}  // namespace
}  // namespace tessera
