// Isolated lights and zeros: what a sum of a bright sample and dark ones shows of weights and transforms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "support/filters.h"
#include "tessera/ops/filter.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::Flat;
using testing::OnEveryTarget;

// What the weights lose in rounding must not gather in one of them, which an isolated light would show.
TEST(LightsTest, AnImpulseShowsEveryWeightWithinTheBound) {
  const Image impulse = Flat(40, 40, 1, 0);
  impulse.at<float>(20, 20) = 1;
  const Node node = FromImage(impulse);
  for (const std::string& name : KernelNames()) {
    for (const int size : {3, 5, 7, 15, 31}) {
      if (name == "laplacian" && size > 3) continue;  // it has one size
      const Kernel k = NamedKernel(name, size, size > 3 ? size - 2 : size);
      OnEveryTarget([&] {
        const Image result = Render(Convolve(node, k, {.wrap = Wrap::kBlack}));
        const double bound = 2 + std::log2(static_cast<double>(k.width * k.height));
        double worst = 0;
        for (int y = 0; y < k.height; ++y) {
          for (int x = 0; x < k.width; ++x) {
            const double want = k.at(x, y), got = result.at<float>(20 + x - k.anchor_x, 20 + y - k.anchor_y);
            if (want != 0) worst = std::max(worst, std::fabs(got - want) / std::fabs(want));
          }
        }
        EXPECT_LE(worst, bound * 0x1p-24) << name << " " << k.width << "x" << k.height;
      });
    }
  }
}

// A sun in a dark picture: its transform in floats would leave nothing right around it, in alpha neither.
TEST(LightsTest, LightsLeaveTheDarkRight) {
  for (const int channels : {1, 3, 4}) {
    Image image(ImageSpec(200, 180, channels));
    std::mt19937 random(3);
    std::uniform_real_distribution<float> dark(0.001f, 0.01f);
    for (int y = 0; y < 180; ++y) {
      for (int x = 0; x < 200; ++x) {
        const bool light = x >= 70 && x < 78 && y >= 60 && y < 68;
        for (int c = 0; c < channels; ++c)
          image.at<float>(x, y, c) = light && c < 3 ? 1e5f * static_cast<float>(c + 1) : dark(random);
      }
    }
    const Kernel k = NamedKernel("disk", 31, 31);
    const double taps = std::count_if(k.weights.begin(), k.weights.end(), [](double w) { return w != 0; });
    OnEveryTarget([&] {
      const Image result = Render(Convolve(FromImage(image), k));
      double worst = 0;
      for (int y = 20; y < 160; y += 3) {
        for (int x = 20; x < 180; x += 3) {
          for (int c = 0; c < channels; ++c) {
            double sum = 0;
            for (int j = 0; j < 31; ++j) {
              for (int i = 0; i < 31; ++i) sum += k.at(i, j) * image.at<float>(x - i + 15, y - j + 15, c);
            }
            worst = std::max(worst, std::fabs(result.at<float>(x, y, c) - sum) / sum);
          }
        }
      }
      EXPECT_LE(worst, (2 + std::log2(taps)) * 0x1p-24) << channels << " channels";
    });
  }
}

// In a picture that is flat but for it, at whatever place of a transform's block, beside flat channels.
TEST(LightsTest, WhatIsNotFiniteReachesItsWindowAlone) {
  const Kernel k = NamedKernel("disk", 31, 31);
  for (const float special : {testing::kNaN, testing::kInf}) {
    for (const int channels : {1, 2, 4}) {
      for (const int place : {80, 83}) {
        const Image image = Flat(160, 150, channels, 0.5f);
        image.at<float>(place, place - 7, channels - 1) = special;
        OnEveryTarget([&] {
          const Image result = Render(Convolve(FromImage(image), k));
          int wrong = 0;
          for (int y = 0; y < 150; ++y) {
            for (int x = 0; x < 160; ++x) {
              const int i = x - place + 15, j = y - place + 22;
              const bool reached = i >= 0 && i < 31 && j >= 0 && j < 31 && k.at(i, j) != 0;
              for (int c = 0; c < channels; ++c) {
                const float got = result.at<float>(x, y, c);
                wrong += reached && c == channels - 1 ? std::isfinite(got) : !(std::fabs(got - 0.5f) < 1e-6f);
              }
            }
          }
          EXPECT_EQ(wrong, 0) << special << ", " << channels << " channels, at " << place;
        });
      }
    }
  }
}

// Differences of zeros of either sign have no direction, on any target.
TEST(ZerosTest, OfEitherSignHaveDirectionZero) {
  const Image image{ImageSpec(13, 5, 1)};
  for (int i = 0; i < 13 * 5; ++i) image.at<float>(i % 13, i / 13, 0) = i % 3 == 0 ? -0.0f : 0.0f;
  OnEveryTarget([&] {
    const Image result = Render(Sobel(FromImage(image), {.output = SobelOutput::kDirection}));
    for (int i = 0; i < 13 * 5; ++i) EXPECT_EQ(result.at<float>(i % 13, i / 13, 0), 0) << i;
  });
}

}  // namespace
}  // namespace tessera
