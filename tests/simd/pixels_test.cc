// Pixel loads and stores on every target: exact conversions, every layout, no access outside the given
// pixels.
#include "simd/pixels.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tessera/error.h"
#include "tessera/targets.h"

namespace tessera::simd {
namespace {

constexpr PixelType kTypes[] = {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat};

// binary16, written from the format's definition: value = (-1)^s 2^(e-25) (1024 + m), or 2^-24 m when e = 0.
double HalfValue(uint16_t h) {
  const int e = (h >> 10) & 31, m = h & 1023;
  const double sign = h & 0x8000 ? -1 : 1;
  if (e == 31)
    return m ? std::numeric_limits<double>::quiet_NaN() : sign * std::numeric_limits<double>::infinity();
  return sign * (e == 0 ? std::ldexp(m, -24) : std::ldexp(1024 + m, e - 25));
}
// Nearest binary16, ties to even, in double arithmetic.
uint16_t NearestHalf(float f) {
  const uint16_t sign = std::signbit(f) ? 0x8000 : 0;
  if (std::isnan(f)) return sign | 0x7E00 | ((std::bit_cast<uint32_t>(f) >> 13) & 0x3FF);
  const double a = std::fabs(static_cast<double>(f));
  if (a >= 65520) return sign | 0x7C00;
  const int e = a < 0x1p-14 ? -14 : std::ilogb(a);
  const double m = std::nearbyint(std::ldexp(a, 10 - e));  // in [0, 2048]
  return sign | static_cast<uint16_t>(((e + 14) << 10) + static_cast<int>(m));
}
uint32_t NearestCode(float v, double max) {
  if (!(v > 0)) return 0;
  return static_cast<uint32_t>(v >= 1 ? max : std::nearbyint(max * static_cast<double>(v)));  // exact product
}
bool SameFloat(float a, float b) { return std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b); }

// Pages of memory between two that trap, placed so that the pixels end (or begin) at the trap.
class GuardedBytes {
 public:
  GuardedBytes(size_t size, bool at_end) : page_(static_cast<size_t>(sysconf(_SC_PAGESIZE))) {
    inner_ = (size + page_ - 1) / page_ * page_;
    base_ = static_cast<std::byte*>(
        mmap(nullptr, inner_ + 2 * page_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    mprotect(base_, page_, PROT_NONE);
    mprotect(base_ + page_ + inner_, page_, PROT_NONE);
    data_ = base_ + page_ + (at_end ? inner_ - size : 0);
  }
  GuardedBytes(const GuardedBytes&) = delete;
  GuardedBytes& operator=(const GuardedBytes&) = delete;
  ~GuardedBytes() { munmap(base_, inner_ + 2 * page_); }
  std::byte* data() const { return data_; }

 private:
  size_t page_, inner_;
  std::byte *base_, *data_;
};

struct Planes {
  alignas(64) float v[4][kBlockPixels] = {};
};

class PixelsTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    SetSimdTarget(GetParam());
    ASSERT_EQ(SimdTarget(), GetParam());
    f_ = CurrentPixelFunctions();
  }
  void TearDown() override { SetSimdTarget("auto"); }

  // Loads interleaved samples as one contiguous plane, in pixel order.
  template <typename T>
  std::vector<float> LoadLine(PixelType type, const std::vector<T>& samples) {
    std::vector<float> out(samples.size());
    Planes planes;
    for (size_t first = 0; first < samples.size(); first += kBlockPixels) {
      LoadArgs args;
      args.type = type;
      args.pixels = reinterpret_cast<const std::byte*>(&samples[first]);
      args.pixel_stride = sizeof(T);
      args.channel[0] = 0;
      args.count = static_cast<int>(std::min<size_t>(kBlockPixels, samples.size() - first));
      args.plane[0] = planes.v[0];
      f_.load(args);
      for (int i = 0; i < kBlockPixels; ++i) {
        if (f_.order[i] < args.count) out[first + f_.order[i]] = planes.v[0][i];
      }
    }
    return out;
  }
  template <typename T>
  std::vector<T> StoreLine(PixelType type, const std::vector<float>& values) {
    std::vector<T> out(values.size());
    Planes planes;
    for (size_t first = 0; first < values.size(); first += kBlockPixels) {
      StoreArgs args;
      args.type = type;
      args.pixels = reinterpret_cast<std::byte*>(&out[first]);
      args.pixel_stride = sizeof(T);
      args.channel[0] = 0;
      args.count = static_cast<int>(std::min<size_t>(kBlockPixels, values.size() - first));
      for (int i = 0; i < kBlockPixels; ++i) {
        planes.v[0][i] = f_.order[i] < args.count ? values[first + f_.order[i]] : 0;
      }
      args.plane[0] = planes.v[0];
      f_.store(args);
    }
    return out;
  }
  PixelFunctions f_;
};

INSTANTIATE_TEST_SUITE_P(EveryTarget, PixelsTest, testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

TEST_P(PixelsTest, OrderPermutesWithinGroups) {
  for (int g = 0; g < kBlockPixels; g += kGroupPixels) {
    std::vector<int> seen(f_.order + g, f_.order + g + kGroupPixels);
    std::sort(seen.begin(), seen.end());
    for (int i = 0; i < kGroupPixels; ++i) EXPECT_EQ(seen[i], g + i);
  }
}

TEST_P(PixelsTest, UnpacksEveryCodeCorrectlyRounded) {
  std::vector<uint8_t> u8(256);
  std::vector<uint16_t> u16(65536);
  for (int i = 0; i < 256; ++i) u8[i] = static_cast<uint8_t>(i);
  for (int i = 0; i < 65536; ++i) u16[i] = static_cast<uint16_t>(i);
  const auto f8 = LoadLine(PixelType::kUint8, u8);
  const auto f16 = LoadLine(PixelType::kUint16, u16);
  const auto half = LoadLine(PixelType::kHalf, u16);
  for (int i = 0; i < 256; ++i) ASSERT_EQ(f8[i], static_cast<float>(i / 255.0)) << i;
  for (int i = 0; i < 65536; ++i) {
    ASSERT_EQ(f16[i], static_cast<float>(i / 65535.0)) << i;
    const double h = HalfValue(u16[i]);
    if (std::isnan(h)) {
      // Quiet, sign and payload kept.
      const uint32_t bits = (u16[i] & 0x8000u) << 16 | 0x7FC00000u | (u16[i] & 0x3FFu) << 13;
      ASSERT_EQ(std::bit_cast<uint32_t>(half[i]), bits) << i;
    } else {
      ASSERT_TRUE(SameFloat(half[i], static_cast<float>(h))) << i;
    }
  }
  EXPECT_EQ(StoreLine<uint8_t>(PixelType::kUint8, f8), u8);
  EXPECT_EQ(StoreLine<uint16_t>(PixelType::kUint16, f16), u16);
}

// Values whose packing is hard: each code, each tie and their float neighbours, every exponent, the special
// ones.
std::vector<float> HardValues() {
  std::vector<float> v = {0.f,
                          -0.f,
                          1.f,
                          -1.f,
                          2.f,
                          0.49999997f,
                          0.5f,
                          254.5f / 255,
                          255.5f,
                          65519.99f,
                          65520.f,
                          65504.f,
                          std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN(),
                          -std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::denorm_min(),
                          std::numeric_limits<float>::max(),
                          std::bit_cast<float>(0x7FA00001u),
                          std::bit_cast<float>(0xFFFFFFFFu)};
  const auto around = [&](double x) {
    const float f = static_cast<float>(x);
    for (float s : {f, -f}) {
      v.push_back(s), v.push_back(std::nextafter(s, 1e30f)), v.push_back(std::nextafter(s, -1e30f));
    }
  };
  for (int k = 0; k <= 510; ++k) around(k / 510.0);
  for (int k = 0; k <= 131070; ++k) around(k / 131070.0);
  for (int h = 0; h < 0x7C00; ++h) {
    const double a = HalfValue(static_cast<uint16_t>(h));
    around(a), around((a + (h == 0x7BFF ? 65536 : HalfValue(static_cast<uint16_t>(h + 1)))) / 2);
  }
  for (uint64_t bits = 0; bits < (uint64_t{1} << 32); bits += 9973) {
    v.push_back(std::bit_cast<float>(static_cast<uint32_t>(bits)));
  }
  return v;
}

TEST_P(PixelsTest, PacksTheNearestCode) {
  const auto values = HardValues();
  const auto u8 = StoreLine<uint8_t>(PixelType::kUint8, values);
  const auto u16 = StoreLine<uint16_t>(PixelType::kUint16, values);
  const auto half = StoreLine<uint16_t>(PixelType::kHalf, values);
  for (size_t i = 0; i < values.size(); ++i) {
    ASSERT_EQ(u8[i], NearestCode(values[i], 255)) << values[i];
    ASSERT_EQ(u16[i], NearestCode(values[i], 65535)) << values[i];
    ASSERT_EQ(half[i], NearestHalf(values[i])) << std::hexfloat << values[i];
  }
}

TEST_P(PixelsTest, PacksEveryFloat) {
  if (!std::getenv("TESSERA_LONG_TESTS")) GTEST_SKIP() << "all 2^32 floats; set TESSERA_LONG_TESTS=1";
  std::vector<float> values(1 << 20);
  for (uint64_t first = 0; first < (uint64_t{1} << 32); first += values.size()) {
    for (size_t i = 0; i < values.size(); ++i)
      values[i] = std::bit_cast<float>(static_cast<uint32_t>(first + i));
    const auto half = StoreLine<uint16_t>(PixelType::kHalf, values);
    const auto u8 = StoreLine<uint8_t>(PixelType::kUint8, values);
    const auto u16 = StoreLine<uint16_t>(PixelType::kUint16, values);
    for (size_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(half[i], NearestHalf(values[i])) << std::hexfloat << values[i];
      ASSERT_EQ(u8[i], NearestCode(values[i], 255)) << std::hexfloat << values[i];
      ASSERT_EQ(u16[i], NearestCode(values[i], 65535)) << std::hexfloat << values[i];
    }
  }
}

struct TestLayout {
  const char* name;
  int channels;   // samples a pixel has
  int order[4];   // place of plane i's sample in a pixel, -1 for none
  int extra = 0;  // bytes between pixels
  bool planar = false, reversed = false;
};
constexpr TestLayout kLayouts[] = {
    {"rgba", 4, {0, 1, 2, 3}},
    {"bgra", 4, {2, 1, 0, 3}},
    {"rgb", 3, {0, 1, 2, -1}},
    {"bgr", 3, {2, 1, 0, -1}},
    {"rgb_of_rgba", 4, {0, 1, 2, -1}},
    {"alpha_of_rgba", 4, {-1, -1, -1, 3}},
    {"y", 1, {0, -1, -1, -1}},
    {"ya", 2, {0, -1, -1, 1}},
    {"five", 5, {0, 4, 2, 3}},
    {"repeated", 2, {0, 0, 0, 1}},
    {"planar", 4, {0, 1, 2, 3}, 0, true},
    {"reversed", 4, {0, 1, 2, 3}, 0, false, true},
    {"odd", 3, {0, 1, 2, -1}, 1},
    {"sixteen", 16, {3, 0, 15, 7}},
    {"rgba_of_five", 5, {0, 1, 2, 3}},
    {"abgr_of_nine", 9, {8, 7, 6, 5}},
    {"bgr_of_seven", 7, {6, 5, 4, -1}},
};

TEST_P(PixelsTest, LoadsAndStoresEveryLayoutBetweenGuardPages) {
  std::mt19937 random(7);
  for (const PixelType type : kTypes) {
    const ptrdiff_t bytes = static_cast<ptrdiff_t>(PixelBytes(type));
    for (const TestLayout& layout : kLayouts) {
      for (int count = 1; count <= kBlockPixels; ++count) {
        const bool at_end = count % 2 == 0;
        SCOPED_TRACE(testing::Message() << PixelTypeName(type) << ' ' << layout.name << ' ' << count);
        // The last pixel's padding is not part of the pixels.
        const ptrdiff_t step = layout.planar ? bytes : bytes * layout.channels + layout.extra;
        const ptrdiff_t plane_step = layout.planar ? bytes * count : bytes;
        const size_t size =
            static_cast<size_t>(layout.planar ? plane_step * layout.channels : step * count - layout.extra);
        GuardedBytes memory(size, at_end);
        for (size_t i = 0; i < size; ++i) memory.data()[i] = static_cast<std::byte>(random());
        const std::vector<std::byte> before(memory.data(), memory.data() + size);
        std::byte* const first = memory.data() + (layout.reversed ? step * (count - 1) : 0);
        const ptrdiff_t stride = layout.reversed ? -step : step;

        Planes planes;
        LoadArgs load;
        load.type = type, load.pixels = first, load.pixel_stride = stride, load.count = count;
        StoreArgs store;
        store.type = type, store.pixels = first, store.pixel_stride = stride, store.count = count;
        store.stream = count % 3 == 0;
        for (int c = 0; c < 4; ++c) {
          std::fill_n(planes.v[c], kBlockPixels, 77.f);
          if (layout.order[c] < 0) continue;
          load.channel[c] = store.channel[c] = plane_step * layout.order[c];
          load.plane[c] = planes.v[c];
          store.plane[c] = planes.v[c];
        }
        f_.load(load);

        // Each sample alone, through the contiguous path that the tests above check exhaustively.
        const int padded = (count + kGroupPixels - 1) / kGroupPixels * kGroupPixels;
        for (int c = 0; c < 4; ++c) {
          std::vector<float> expected;
          if (layout.order[c] >= 0) {
            std::vector<uint8_t> u8(count);
            std::vector<uint16_t> u16(count);
            std::vector<float> f32(count);
            for (int i = 0; i < count; ++i) {
              const std::byte* const p = first + i * stride + load.channel[c];
              std::memcpy(&u8[i], p, 1);
              if (bytes >= 2) std::memcpy(&u16[i], p, 2);
              if (bytes >= 4) std::memcpy(&f32[i], p, 4);
            }
            expected = type == PixelType::kUint8   ? LoadLine(type, u8)
                       : type == PixelType::kFloat ? f32
                                                   : LoadLine(type, u16);
          }
          for (int i = 0; i < kBlockPixels; ++i) {
            const int pixel = f_.order[i];
            const float want = layout.order[c] < 0 || i >= padded ? 77.f
                               : pixel < count                    ? expected[pixel]
                                                                  : 0.f;
            ASSERT_TRUE(SameFloat(planes.v[c][i], want)) << "plane " << c << " at " << i;
          }
        }
        // Codes survive the round trip; bytes that belong to no channel are untouched.
        f_.store(store);
        FlushStreams();
        const std::vector<std::byte> after(memory.data(), memory.data() + size);
        if (type != PixelType::kHalf) {
          ASSERT_EQ(after, before);
        } else {
          // A signalling NaN comes back quiet.
          for (size_t i = 0; i < size; ++i) {
            ASSERT_EQ(static_cast<int>(after[i]) & ~2, static_cast<int>(before[i]) & ~2);
          }
        }
      }
    }
  }
}

TEST(TargetsTest, NamesAndForces) {
  const auto targets = SimdTargets();
  ASSERT_FALSE(targets.empty());
  EXPECT_EQ(SimdTarget(), targets.front());
  for (const auto& name : targets) {
    SetSimdTarget(name);
    EXPECT_EQ(SimdTarget(), name);
  }
  SetSimdTarget("auto");
  EXPECT_EQ(SimdTarget(), targets.front());
  EXPECT_THROW(SetSimdTarget("AVX9"), Error);
}

}  // namespace
}  // namespace tessera::simd
