// The fixture of the command line's tests: a directory, the built program, pictures to work on.
#ifndef TESSERA_TESTS_CLI_CLI_TEST_H_
#define TESSERA_TESTS_CLI_CLI_TEST_H_

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagecache.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "support/run_command.h"

namespace tessera::testing {

inline std::vector<std::string> Words(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

class CliTest : public ::testing::Test {
 protected:
  // `line` is split at blanks.
  CommandResult Tessera(const std::string& line) { return Tessera(Words(line)); }
  CommandResult Tessera(std::vector<std::string> words) {
    words.insert(words.begin(), TESSERA_PROGRAM);
    return RunCommand(std::move(words), directory_.path());
  }
  CommandResult Oiiotool(const std::string& line) { return Oiiotool(Words(line)); }
  CommandResult Oiiotool(std::vector<std::string> words) {
    words.insert(words.begin(), "oiiotool");
#ifdef TESSERA_STAND_INS
    // Its start would be most of what these tests take.
    words.insert(words.begin(), {"env", "GLIBC_TUNABLES=glibc.malloc.hugetlb=1:glibc.malloc.top_pad=33554432",
                                 "LD_LIBRARY_PATH=" TESSERA_STAND_INS, "LD_PRELOAD=" TESSERA_START_OVER});
#endif
    return RunCommand(std::move(words), directory_.path());
  }
  // Runs and expects success; returns stdout.
  std::string Works(const std::string& line) {
    const CommandResult result = Tessera(line);
    EXPECT_EQ(result.exit_code, 0) << "tessera " << line << "\n" << result.err;
    return result.out;
  }

  std::string Path(const std::string& name) const { return (directory_.path() / name).string(); }
  OIIO::ImageBuf Load(const std::string& name) const {
    // OpenImageIO's shared cache tells a file written twice by its time in seconds: two tests' lines may
    // share one.
    OIIO::ImageCache* const cache = OIIO::ImageCache::create(/*shared=*/true);
    cache->invalidate(OIIO::ustring(Path(name)), /*force=*/true);
    OIIO::ImageCache::destroy(cache);
    OIIO::ImageBuf image(Path(name));
    EXPECT_TRUE(image.read(0, 0, true, OIIO::TypeFloat)) << name << ": " << image.geterror();
    return image;
  }
  // A sample of a file.
  float Sample(const std::string& name, int x, int y, int channel) const {
    return Load(name).getchannel(x, y, 0, channel);
  }

  // Something like a photograph: smooth shading, edges, grain, a few values outside [0,1] in float.
  void MakePicture(const std::string& name, int width, int height, int channels, OIIO::TypeDesc type,
                   int seed = 1) {
    OIIO::ImageSpec spec(width, height, channels, type);
    spec.attribute("compression", "none");
    OIIO::ImageBuf image(spec);
    uint32_t state = 2463534242u + static_cast<uint32_t>(seed);
    std::vector<float> pixel(static_cast<size_t>(channels));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < channels; ++c) {
          state ^= state << 13, state ^= state >> 17, state ^= state << 5;
          const double grain = (state >> 8) / 16777216.0 - 0.5;
          const double u = (x + 0.5) / width, v = (y + 0.5) / height;
          const bool disc = std::hypot(u - 0.6, v - 0.4) < 0.25;
          double value = 0.5 + 0.4 * std::sin(5 * u + 3 * v + c + seed) + (disc ? 0.2 : 0) + 0.05 * grain;
          if (c == 3) value = 0.2 + 0.7 * u;
          if (type == OIIO::TypeFloat && c < 3 && (state & 1023) == 0) value = value * 4 - 1;
          pixel[static_cast<size_t>(c)] = static_cast<float>(value);
        }
        image.setpixel(x, y, pixel.data(), channels);
      }
    }
    ASSERT_TRUE(image.write(Path(name))) << image.geterror();
  }

  TemporaryDirectory directory_;
};

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_CLI_CLI_TEST_H_
