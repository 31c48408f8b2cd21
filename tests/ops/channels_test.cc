// Channels selected, reordered, joined and set: samples keep their bits in every type and layout.
#include "tessera/ops/channels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "tessera/error.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

constexpr PixelType kTypes[] = {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat};

// A row-by-row dense picture of random bits whose memory ends with its last sample.
struct Bits {
  Bits(int width, int height, int channels, PixelType type, uint32_t seed)
      : spec(width, height, channels, type),
        sample(PixelBytes(type)),
        memory(static_cast<size_t>(width) * static_cast<size_t>(height * channels) * sample) {
    for (std::byte& b : memory) b = static_cast<std::byte>((seed = seed * 1664525u + 1013904223u) >> 24);
  }
  ImageView View() {
    const auto bytes = static_cast<ptrdiff_t>(sample);
    const ptrdiff_t pixel = bytes * spec.channel_count();
    return {memory.data(),
            spec.data_window,
            spec.channel_count(),
            spec.type,
            bytes,
            pixel,
            pixel * spec.data_window.width()};
  }
  Node AsNode() { return FromView(View(), spec); }
  const std::byte* At(size_t pixel, int channel) const {
    return memory.data() + (pixel * spec.channels.size() + static_cast<size_t>(channel)) * sample;
  }

  ImageSpec spec;
  size_t sample;
  std::vector<std::byte> memory;
};

// One half, as every type has it.
std::vector<uint8_t> Half(PixelType type) {
  if (type == PixelType::kUint8) return {128};
  if (type == PixelType::kUint16) return {0, 128};
  if (type == PixelType::kHalf) return {0, 0x38};
  return {0, 0, 0, 0x3F};
}

class ChannelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};

constexpr int kOneHalf = -1;
struct Case {
  std::vector<int> inputs;  // channels of each, appended in this order
  std::vector<int> taken;   // channels of all inputs together, or kOneHalf
};

TEST_P(ChannelsTest, MovedSamplesKeepTheirBits) {
  const Case cases[] = {{{4}, {2, 1, 0, 3}},
                        {{4}, {0, 1, 2}},
                        {{4}, {3}},
                        {{3}, {0, 1, 2, -1}},
                        {{3}, {2, 1, 0}},
                        {{1}, {0, 0, 0}},
                        {{3, 1}, {0, 1, 2, 3}},
                        {{2, 2}, {3, 0, 2}},
                        {{1, 1, 1}, {2, 1, 0}},
                        {{5}, {4, 0}},
                        {{1, 2, 1, 1}, {4, 3, 2, 1}},
                        {{2, 5}, {6, -1, 0, 1, 2}},
                        {{4}, {-1, -1, 1}}};
  for (const PixelType type : kTypes) {
    for (const Case& c : cases) {
      for (const int width : {1, 2, 5, 15, 16, 17, 40, 511, 700}) {
        std::vector<Bits> inputs;
        for (const int channels : c.inputs)
          inputs.emplace_back(width, 3, channels, type, static_cast<uint32_t>(inputs.size()));
        Node all = inputs[0].AsNode();
        for (size_t k = 1; k < inputs.size(); ++k) all = AppendChannels(all, inputs[k].AsNode());
        std::vector<ChannelChoice> choices;
        for (const int t : c.taken)
          choices.push_back({t, 0.5f, t < 0 ? "half" + std::to_string(choices.size()) : ""});
        Bits out(width, 3, static_cast<int>(c.taken.size()), type, 99);
        RenderInto(SelectChannels(all, choices), out.View());
        for (size_t pixel = 0; pixel < static_cast<size_t>(width) * 3; ++pixel) {
          for (size_t k = 0; k < c.taken.size(); ++k) {
            const std::vector<uint8_t> half = Half(type);
            const void* wanted = half.data();
            int channel = c.taken[k];
            for (size_t input = 0; channel >= 0 && input < inputs.size(); ++input) {
              if (channel < c.inputs[input]) {
                wanted = inputs[input].At(pixel, channel);
                break;
              }
              channel -= c.inputs[input];
            }
            ASSERT_EQ(std::memcmp(out.At(pixel, static_cast<int>(k)), wanted, out.sample), 0)
                << c.inputs.size() << " inputs, channel " << k << " of pixel " << pixel << ", width "
                << width;
          }
        }
      }
    }
  }
}

TEST_P(ChannelsTest, InPlace) {
  for (const PixelType type : kTypes) {
    for (const std::vector<int>& from : {std::vector{2, 0, 1}, {2, 0, 3, 1}, {1, 0}}) {
      const auto channels = static_cast<int>(from.size());
      Bits pixels(701, 3, channels, type, 5);
      const Bits before = pixels;
      std::vector<ChannelChoice> choices;
      for (const int c : from) choices.push_back({c, 0, ""});
      RenderInto(SelectChannels(pixels.AsNode(), choices), pixels.View());
      for (size_t i = 0; i < size_t{701} * 3; ++i) {
        for (int c = 0; c < channels; ++c) {
          ASSERT_EQ(std::memcmp(pixels.At(i, c), before.At(i, from[static_cast<size_t>(c)]), before.sample),
                    0)
              << channels << " channels, pixel " << i;
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, ChannelsTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

TEST(Channels, MissingOnesAreNamed) {
  Bits pixels(2, 2, 3, PixelType::kFloat, 1);
  try {
    SelectChannels(pixels.AsNode(), "R,depth");
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("depth"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("R,G,B"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace tessera
