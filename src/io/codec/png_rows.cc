// Filtering is written so that compilers make vectors of it; unfiltering goes from pixel to pixel.
#include "io/codec/png_rows.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>

namespace tessera::io {
namespace {

enum Number : uint8_t { kNone, kSub, kUp, kAverage, kPaeth };

// The one of the three that is nearest to left + above - above_left; ties in this order.
inline int Paeth(int left, int above, int above_left) {
  const int from_left = std::abs(above - above_left), from_above = std::abs(left - above_left);
  const int from_both = std::abs(left + above - 2 * above_left);
  const int nearer = from_above <= from_both ? above : above_left;
  return from_left <= from_above && from_left <= from_both ? left : nearer;
}

// Pointers are to whole rows, `left` and `above_left` one pixel back. Returns the sum of magnitudes.
template <typename Predict>
uint64_t Differences(const uint8_t* __restrict row, const uint8_t* __restrict left,
                     const uint8_t* __restrict above, const uint8_t* __restrict above_left, size_t bytes,
                     uint8_t* __restrict out, Predict predict) {
  uint64_t sum = 0;
  constexpr size_t kBlock = 256;  // whose sum fits in 16 bits
  for (size_t begin = 0; begin < bytes; begin += kBlock) {
    const size_t end = std::min(bytes, begin + kBlock);
    uint16_t part = 0;
    for (size_t i = begin; i < end; ++i) {
      const auto difference = static_cast<uint8_t>(
          row[i] - static_cast<uint8_t>(predict(static_cast<int16_t>(left[i]), static_cast<int16_t>(above[i]),
                                                static_cast<int16_t>(above_left[i]))));
      out[i] = difference;
      part = static_cast<uint16_t>(part + std::min<uint8_t>(difference, static_cast<uint8_t>(-difference)));
    }
    sum += part;
  }
  return sum;
}

template <size_t kPixel>
void UnfilterSub(uint8_t* row, size_t bytes) {
  for (size_t i = kPixel; i < bytes; ++i) row[i] = static_cast<uint8_t>(row[i] + row[i - kPixel]);
}

template <size_t kPixel>
void UnfilterAverage(uint8_t* row, const uint8_t* above, size_t bytes) {
  std::array<int, kPixel> left{};
  for (size_t i = 0; i < bytes; i += kPixel) {
    for (size_t c = 0; c < kPixel; ++c) {
      left[c] = static_cast<uint8_t>(row[i + c] + (left[c] + above[i + c]) / 2);
      row[i + c] = static_cast<uint8_t>(left[c]);
    }
  }
}

template <size_t kPixel>
void UnfilterPaeth(uint8_t* row, const uint8_t* above, size_t bytes) {
  std::array<int16_t, kPixel> left{}, corner{};
  for (size_t i = 0; i < bytes; i += kPixel) {
    for (size_t c = 0; c < kPixel; ++c) {
      const int16_t up = above[i + c];
      const auto to_left = static_cast<int16_t>(up - corner[c]),
                 to_up = static_cast<int16_t>(left[c] - corner[c]);
      const auto both = static_cast<int16_t>(std::abs(to_left + to_up));
      const auto from_left = static_cast<int16_t>(std::abs(to_left)),
                 from_up = static_cast<int16_t>(std::abs(to_up));
      int16_t guess = from_up <= both ? up : corner[c];
      guess = from_left <= std::min(from_up, both) ? left[c] : guess;
      corner[c] = up;
      left[c] = static_cast<uint8_t>(row[i + c] + guess);
      row[i + c] = static_cast<uint8_t>(left[c]);
    }
  }
}

template <size_t kPixel>
bool Unfilter(uint8_t number, uint8_t* row, const uint8_t* above, size_t bytes) {
  switch (number) {
    case kNone:
      return true;
    case kSub:
      UnfilterSub<kPixel>(row, bytes);
      return true;
    case kUp:
      for (size_t i = 0; i < bytes; ++i) row[i] = static_cast<uint8_t>(row[i] + above[i]);
      return true;
    case kAverage:
      UnfilterAverage<kPixel>(row, above, bytes);
      return true;
    case kPaeth:
      UnfilterPaeth<kPixel>(row, above, bytes);
      return true;
    default:
      return false;
  }
}

}  // namespace

PngRowFilter::PngRowFilter(size_t row_bytes, size_t pixel)
    : pixel_(pixel), zeros_(row_bytes), left_(row_bytes + pixel), above_left_(row_bytes + pixel) {
  for (auto& t : tries_) t.resize(row_bytes);
}

void PngRowFilter::Filter(PngFilter filter, const uint8_t* row, const uint8_t* above, base::Bytes& out) {
  const size_t bytes = zeros_.size();
  if (filter == PngFilter::kNone) {
    out.push_back(kNone);
    out.insert(out.end(), row, row + bytes);
    return;
  }
  if (above == nullptr) above = zeros_.data();
  std::memcpy(left_.data() + pixel_, row, bytes);
  std::memcpy(above_left_.data() + pixel_, above, bytes);
  uint8_t best = kNone;
  uint64_t least = UINT64_MAX;
  const auto attempt = [&](uint8_t number, auto predict) {
    const uint64_t sum =
        Differences(row, left_.data(), above, above_left_.data(), bytes, tries_[0].data(), predict);
    if (sum >= least) return;
    least = sum;
    best = number;
    tries_[0].swap(tries_[1]);
  };
  attempt(kSub, [](int16_t left, int16_t, int16_t) { return left; });
  attempt(kUp, [](int16_t, int16_t up, int16_t) { return up; });
  attempt(kAverage, [](int16_t left, int16_t up, int16_t) { return static_cast<int16_t>((left + up) >> 1); });
  attempt(kPaeth, [](int16_t left, int16_t up, int16_t corner) {
    const auto to_left = static_cast<int16_t>(up - corner), to_up = static_cast<int16_t>(left - corner);
    const auto sum = static_cast<int16_t>(to_left + to_up);
    const auto from_left = static_cast<int16_t>(to_left < 0 ? -to_left : to_left);
    const auto from_up = static_cast<int16_t>(to_up < 0 ? -to_up : to_up);
    const auto both = static_cast<int16_t>(sum < 0 ? -sum : sum);
    const int16_t guess = from_up <= both ? up : corner;
    return from_left <= std::min(from_up, both) ? left : guess;
  });
  attempt(kNone, [](int16_t, int16_t, int16_t) { return int16_t{0}; });
  out.push_back(best);
  out.insert(out.end(), tries_[1].begin(), tries_[1].end());
}

bool PngUnfilter(uint8_t* filtered, const uint8_t* above, size_t bytes, size_t pixel) {
  const uint8_t number = filtered[0];
  uint8_t* row = filtered + 1;
  if (above == nullptr) {
    // Above the picture are zeros: nothing to add, or what is left of it.
    static constexpr size_t kRun = 4096;
    static constexpr std::array<uint8_t, kRun> kZeros{};
    if (number == kUp || number == kNone) return true;
    if (number == kPaeth) return PngUnfilter((filtered[0] = kSub, filtered), row, bytes, pixel);
    if (number == kAverage) {
      for (size_t i = pixel; i < bytes; ++i) row[i] = static_cast<uint8_t>(row[i] + row[i - pixel] / 2);
      return true;
    }
    above = kZeros.data();  // not read by the others
  }
  switch (pixel) {
    case 1:
      return Unfilter<1>(number, row, above, bytes);
    case 2:
      return Unfilter<2>(number, row, above, bytes);
    case 3:
      return Unfilter<3>(number, row, above, bytes);
    case 4:
      return Unfilter<4>(number, row, above, bytes);
    case 6:
      return Unfilter<6>(number, row, above, bytes);
    case 8:
      return Unfilter<8>(number, row, above, bytes);
    default:
      return false;
  }
}

}  // namespace tessera::io
