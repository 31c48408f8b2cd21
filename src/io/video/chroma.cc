// Chroma up and down as tables of taps, one row at a time; matrices in double.
#include "io/video/chroma.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace tessera::io {
namespace {

// What of the samples at `at` a result is made of.
template <size_t N>
struct Taps {
  std::array<int, N> at;
  std::array<float, N> weight;
};
using UpTaps = Taps<3>;
using DownTaps = Taps<5>;

int Mirrored(int at, int count) {
  if (count == 1) return 0;
  while (at < 0 || at >= count) at = at < 0 ? -at : 2 * (count - 1) - at;
  return at;
}

// From samples to twice as many; the same number where nothing is halved.
std::vector<UpTaps> Up(bool half, bool amid, int size) {
  std::vector<UpTaps> taps;
  const int last = (half ? (size + 1) / 2 : size) - 1;
  for (int k = 0; k < size; ++k) {
    const int i = half ? k / 2 : k, before = std::max(i - 1, 0), next = std::min(i + 1, last);
    if (!half) {
      taps.push_back({{i, i, i}, {1, 0, 0}});
    } else if (!amid) {
      taps.push_back({{i, next, next}, k % 2 == 0 ? std::array{1.F, 0.F, 0.F} : std::array{0.5F, 0.5F, 0.F}});
    } else {
      // One that has no other beside it is alone.
      const float slope = 2 * i + 1 == size ? 0 : k % 2 == 0 ? 0.125F : -0.125F;
      taps.push_back({{i, before, next}, {1, slope, -slope}});
    }
  }
  return taps;
}

std::vector<DownTaps> Down(bool half, bool amid, int size) {
  // Of what comes in twice: weights of 0 would make NaN of what is infinite.
  constexpr std::array kHalves = {0.5F, 0.125F, 0.125F, 0.125F, 0.125F};
  std::vector<DownTaps> taps;
  for (int i = 0; i < (half ? (size + 1) / 2 : size); ++i) {
    const auto at = [&](int offset) { return Mirrored(2 * i + offset, size); };
    if (!half) {
      taps.push_back({{i, i, i, i, i}, kHalves});
    } else if (!amid) {
      taps.push_back({{at(-2), at(-1), 2 * i, at(1), at(2)}, {-0.125F, 0.25F, 0.75F, 0.25F, -0.125F}});
    } else {
      const int other = std::min(2 * i + 1, size - 1);
      taps.push_back({{2 * i, other, other, other, other}, kHalves});
    }
  }
  return taps;
}

// A row of sums of rows; `row(k)` is the k-th.
template <size_t N, typename RowAt>
void AcrossRows(const Taps<N>& taps, const RowAt& row, size_t count, float* to) {
  std::array<const float*, N> rows;
  for (size_t t = 0; t < N; ++t) rows[t] = row(taps.at[t]);
  for (size_t x = 0; x < count; ++x) {
    float sum = taps.weight[0] * rows[0][x];
    for (size_t t = 1; t < N; ++t) sum += taps.weight[t] * rows[t][x];
    to[x] = sum;
  }
}

template <size_t N>
float Sum(const Taps<N>& taps, const float* row) {
  float sum = taps.weight[0] * row[taps.at[0]];
  for (size_t t = 1; t < N; ++t) sum += taps.weight[t] * row[taps.at[t]];
  return sum;
}

// Between the ends the taps come again every kResults results, kSamples samples further.
template <size_t kResults, size_t kSamples, size_t N>
void AlongRow(const std::vector<Taps<N>>& taps, const float* row, float* to) {
  constexpr size_t kEnd = 4;
  const size_t all = taps.size(), count = all < 2 * kEnd ? 0 : (all - 2 * kEnd) / kResults;
  std::array<Taps<N>, kResults> first{};
  for (size_t p = 0; p < kResults && count > 0; ++p) first[p] = taps[kEnd + p];
  for (size_t x = 0; x < std::min(kEnd, all); ++x) to[x] = Sum(taps[x], row);
  float* const inner = to + kEnd;
  for (size_t k = 0; k < count; ++k) {
    for (size_t p = 0; p < kResults; ++p) inner[k * kResults + p] = Sum(first[p], row + k * kSamples);
  }
  for (size_t x = kEnd + count * kResults; x < all; ++x) to[x] = Sum(taps[x], row);
}

void UpRow(const PixelFormat& format, const std::vector<UpTaps>& taps, const float* row, float* to) {
  format.half_width ? AlongRow<2, 1>(taps, row, to) : AlongRow<1, 1>(taps, row, to);
}

void DownRow(const PixelFormat& format, const std::vector<DownTaps>& taps, const float* row, float* to) {
  format.half_width ? AlongRow<1, 2>(taps, row, to) : AlongRow<1, 1>(taps, row, to);
}

template <typename Code>
void Floats(const std::byte* from, size_t count, float* to) {
  for (size_t i = 0; i < count; ++i) {
    Code code;
    std::memcpy(&code, from + i * sizeof code, sizeof code);
    to[i] = static_cast<float>(code);
  }
}

template <typename Code>
void Codes(const float* from, size_t count, float top, std::byte* to) {
  for (size_t i = 0; i < count; ++i) {
    const float kept = from[i] > 0 ? std::min(from[i], top) : 0;  // NaN is not above 0
    const auto code = static_cast<Code>(static_cast<int>(kept + 0.5F));
    std::memcpy(to + i * sizeof code, &code, sizeof code);
  }
}

void ToFloats(const PixelFormat& format, const std::byte* from, size_t count, float* to) {
  format.bits > 8 ? Floats<uint16_t>(from, count, to) : Floats<uint8_t>(from, count, to);
}

void ToCodes(const PixelFormat& format, const float* from, size_t count, std::byte* to) {
  const auto top = static_cast<float>(format.Top());
  format.bits > 8 ? Codes<uint16_t>(from, count, top, to) : Codes<uint8_t>(from, count, top, to);
}

// Where the planes of a frame are.
struct Layout {
  Layout(const PixelFormat& format, int width, int height)
      : bytes(PixelBytes(format.type)),
        chroma_width(static_cast<size_t>(ChromaWidth(format, width))),
        chroma_height(static_cast<size_t>(ChromaHeight(format, height))),
        width(static_cast<size_t>(width)),
        height(static_cast<size_t>(height)) {}
  size_t Luma(size_t y) const { return y * width * bytes; }
  size_t Chroma(size_t plane, size_t y) const {
    return (width * height + (plane * chroma_height + y) * chroma_width) * bytes;
  }
  size_t bytes, chroma_width, chroma_height, width, height;
};

// The latest rows of a plane that somebody made, each once.
class RecentRows {
 public:
  explicit RecentRows(size_t width) : width_(width), rows_(kKept * width) { index_.fill(-1); }
  template <typename Make>
  const float* At(int y, const Make& make) {
    const size_t slot = static_cast<size_t>(y) % kKept;
    float* const row = rows_.data() + slot * width_;
    if (index_[slot] != y) make(row);
    index_[slot] = y;
    return row;
  }

 private:
  static constexpr size_t kKept = 8;  // more than one result is made of
  size_t width_;
  std::vector<float> rows_;
  std::array<int, kKept> index_;
};

bool AmidColumns(Siting siting) { return siting == Siting::kCentre; }
bool AmidRows(Siting siting) { return siting != Siting::kTopLeft; }

}  // namespace

void PlanesOfFrame(const PixelFormat& format, Siting siting, int width, int height, const std::byte* frame,
                   float* planes) {
  const Layout l(format, width, height);
  ToFloats(format, frame, l.width * l.height, planes);
  const auto columns = Up(format.half_width, AmidColumns(siting), width);
  const auto rows = Up(format.half_height, AmidRows(siting), height);
  std::vector<float> row(l.chroma_width);
  for (size_t plane = 0; plane < 2; ++plane) {
    RecentRows codes(l.chroma_width);
    const auto code_row = [&](int y) {
      return codes.At(y, [&](float* to) {
        ToFloats(format, frame + l.Chroma(plane, static_cast<size_t>(y)), l.chroma_width, to);
      });
    };
    for (size_t y = 0; y < l.height; ++y) {
      AcrossRows(rows[y], code_row, l.chroma_width, row.data());
      UpRow(format, columns, row.data(), planes + ((plane + 1) * l.height + y) * l.width);
    }
  }
}

void FrameOfPlanes(const PixelFormat& format, Siting siting, int width, int height, const float* planes,
                   std::byte* frame) {
  const Layout l(format, width, height);
  ToCodes(format, planes, l.width * l.height, frame);
  const auto columns = Down(format.half_width, AmidColumns(siting), width);
  const auto rows = Down(format.half_height, AmidRows(siting), height);
  std::vector<float> row(l.chroma_width);
  for (size_t plane = 0; plane < 2; ++plane) {
    RecentRows narrow(l.chroma_width);
    const auto narrow_row = [&](int y) {
      return narrow.At(y, [&](float* to) {
        DownRow(format, columns, planes + ((plane + 1) * l.height + static_cast<size_t>(y)) * l.width, to);
      });
    };
    for (size_t y = 0; y < l.chroma_height; ++y) {
      AcrossRows(rows[y], narrow_row, l.chroma_width, row.data());
      ToCodes(format, row.data(), l.chroma_width, frame + l.Chroma(plane, y));
    }
  }
}

namespace {

// Codes of Y' from `black` over `luma` steps, of chroma over `chroma` steps about `zero`; all / top.
struct Steps {
  Steps(const YccCoding& coding, double top) {
    const double unit = std::ldexp(1.0, coding.bits - 8) / top;
    const double all = (std::ldexp(1.0, coding.bits) - 1) / top;
    luma = coding.full ? all : 219 * unit;
    chroma = coding.full ? all : 224 * unit;
    black = coding.full ? 0 : 16 * unit;
    zero = 128 * unit;
  }
  double luma, chroma, black, zero;
};

}  // namespace

std::vector<double> RgbOfYcc(const YccCoding& coding, double top) {
  const Steps s(coding, top);
  const double r = coding.red, b = coding.blue, g = 1 - r - b;
  const double red = 2 * (1 - r) / s.chroma, blue = 2 * (1 - b) / s.chroma, luma = 1 / s.luma;
  const double green_b = -blue * b / g, green_r = -red * r / g, base = -s.black * luma;
  // Rows: what Y', Cb and Cr give to R', G', B'.
  return {luma,
          luma,
          luma,
          0,
          green_b,
          blue,
          red,
          green_r,
          0,
          base - red * s.zero,
          base - (green_b + green_r) * s.zero,
          base - blue * s.zero};
}

std::vector<double> YccOfRgb(const YccCoding& coding, double top) {
  const Steps s(coding, top);
  const double r = coding.red, b = coding.blue, g = 1 - r - b;
  const double red = s.chroma / (2 * (1 - r)), blue = s.chroma / (2 * (1 - b));
  // Rows: what R', G' and B' give to Y', Cb, Cr.
  return {s.luma * r, -blue * r,      red * (1 - r), s.luma * g, -blue * g, -red * g,
          s.luma * b, blue * (1 - b), -red * b,      s.black,    s.zero,    s.zero};
}

void GreyCodes(const YccCoding& coding, double top, double& black, double& white) {
  const Steps s(coding, top);
  black = s.black, white = s.luma;
}

}  // namespace tessera::io
