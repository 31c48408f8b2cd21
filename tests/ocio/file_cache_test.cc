// What OpenColorIO keeps from one use of a file to the next.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "lut_files.h"
#include "tessera/error.h"
#include "tessera/ocio.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::Folder;

TEST(FileCacheTest, AFileThatChangedIsReadAgain) {
  const Folder folder;
  const auto cube = [&](const std::string& one) {
    std::string text = "LUT_3D_SIZE 2\n";
    for (int i = 0; i < 8; ++i) {
      for (int c = 0; c < 3; ++c) text += (i >> c & 1) != 0 ? one + " " : "0.0 ";
      text += "\n";
    }
    return folder.Write("l.cube", text);
  };
  const Image white(ImageSpec(1, 1, 3));
  for (int c = 0; c < 3; ++c) white.at<float>(0, 0, c) = 1;
  for (const char* one : {"1.0", "0.5", "0.2"}) {
    const Image result = Render(ApplyLut(FromImage(white), cube(one)));
    EXPECT_NEAR(result.at<float>(0, 0, 1), std::strtod(one, nullptr), 1e-6);
  }
  folder.Write("l.cube", "LUT_3D_SIZE 2\nnothing\n");
  EXPECT_THROW(ApplyLut(FromImage(white), folder.path() + "/l.cube"), Error);
}

// A config names a LUT that is not there yet.
TEST(FileCacheTest, AFileThatAppearsIsFound) {
  const Folder folder;
  const std::string config =
      folder.Write("config.ocio",
                   "ocio_profile_version: 2\nsearch_path: " + folder.path() +
                       "\nroles: {default: a, scene_linear: a}\n"
                       "displays: {d: [!<View> {name: v, colorspace: a}]}\n"
                       "file_rules:\n  - !<Rule> {name: Default, colorspace: default}\n"
                       "colorspaces:\n  - !<ColorSpace> {name: a}\n"
                       "  - !<ColorSpace> {name: b, from_scene_reference: !<FileTransform> {src: b.cube}}\n");
  const Image white(ImageSpec(1, 1, 3));
  for (int c = 0; c < 3; ++c) white.at<float>(0, 0, c) = 1;
  const auto converted = [&] { return Render(ColorConvert(FromImage(white), "a", "b", {.config = config})); };
  EXPECT_THROW(converted(), Error);
  folder.Write("b.cube", "LUT_3D_SIZE 2\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n.5 .5 .5\n");
  EXPECT_NEAR(converted().at<float>(0, 0, 1), 0.5, 1e-6);
}

}  // namespace
}  // namespace tessera
