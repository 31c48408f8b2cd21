// Bytes to bytes go through sums in 16 bits or of products of real weights where the kernel suits them, else
// through floats; what is in floats already stays there, and 16-bit codes go through doubles.
#include "ops/filter/codes/code_sums.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ops/filter/codes/bytes.h"
#include "ops/filter/codes/codes.h"
#include "ops/filter/codes/found.h"
#include "ops/filter/codes/products.h"
#include "ops/filter/codes/whole.h"
#include "ops/filter/fir/fir.h"

namespace tessera::ops {
namespace {

constexpr int kLargestByte = 255, kLargestWord = 65535;

// How many samples of a channel above and left of each are no codes.
class Strangers {
 public:
  Strangers(base::Arena& scratch, const FloatTile& t, const FloatTile& codes, int floats, int rows,
            int largest, double whole)
      : channels_(t.channels),
        stride_(static_cast<size_t>(floats + t.channels)),
        counts_(scratch.Allocate<int>(stride_ * static_cast<size_t>(rows + 1))) {
    std::fill_n(counts_, stride_ * static_cast<size_t>(rows + 1), 0);
    for (int y = 0; y < rows; ++y) {
      for (int i = 0; i < floats; ++i) {
        const double code = static_cast<double>(t.in[y * t.in_stride + i]) * largest;
        const bool stranger = !(std::fabs(code - codes.in[y * codes.in_stride + i]) < whole);
        At(y + 1, i + channels_) = At(y + 1, i) + At(y, i + channels_) - At(y, i) + (stranger ? 1 : 0);
      }
    }
  }
  // Whether there are any under the window whose first sample this is.
  bool Under(const CodesWindow& w, int y, int i) {
    const int right = i + w.width * channels_, bottom = y + w.height;
    return At(bottom, right) - At(bottom, i) - At(y, right) + At(y, i) != 0;
  }

 private:
  int& At(int y, int i) { return counts_[static_cast<size_t>(y) * stride_ + static_cast<size_t>(i)]; }

  int channels_;
  size_t stride_;
  int* counts_;
};

// Of the results `codes.out`, which are right where a window sees codes alone, those that are go to
// `tile.out`. A sample of `tile` farther than `whole` from the code in `codes.in` is none.
void KeepWithoutStrangers(const CodesWindow& window, int largest, double whole, const FloatTile& tile,
                          const FloatTile& codes, base::Arena& scratch) {
  Strangers strangers(scratch, tile, codes, tile.samples + (window.width - 1) * tile.channels,
                      tile.rows + window.height - 1, largest, whole);
  for (int y = 0; y < tile.rows; ++y) {
    for (int i = 0; i < tile.samples; ++i) {
      if (!strangers.Under(window, y, i))
        tile.out[y * tile.out_stride + i] = codes.out[y * codes.out_stride + i];
    }
  }
}
// The sum in double whose first sample this is.
double ExactSum(const CodesWindow& w, const float* in, ptrdiff_t stride, int channels) {
  const bool separable = !w.row.empty();
  double sum = 0;
  for (int dx = 0; dx < w.width; ++dx, in += channels) {
    const double* const column = separable ? w.column(0) : w.column(dx);
    double down = 0;
    for (int dy = 0; dy < w.height; ++dy) down += column[dy] * in[dy * stride];
    sum += separable ? down * w.row[static_cast<size_t>(dx)] : down;
  }
  return sum;
}

class CodeSums final : public WindowSums {
 public:
  CodeSums(PixelType type, const CodeKernel& k, std::unique_ptr<const WindowSums> floats)
      : bytes_type_(type == PixelType::kUint8),
        exact_(k.row.empty() ? MakeCodesWindow(k.width, k.height, k.weights)
                             : MakeCodesWindow(k.column, k.row)),
        floats_(std::move(floats)) {
    if (k.weights.empty()) return;
    bytes_ = MakeBytesWindow(k.width, k.height, k.weights, k.by_columns, k.error);
    product_ = MakeProductWindow(k.width, k.height, k.weights);
    if (bytes_.divisor != 0 || bytes_.divisor_of_words != 0) whole_ = MakeDirectSums(bytes_.whole);
  }

  bool Accepts(PixelType type) const override {
    if (bytes_type_) return type == PixelType::kUint8 && (bytes_.usable || product_.usable);
    return type == PixelType::kUint16 && bytes_.divisor_of_words == 0 && product_.usable;
  }

  void Run(const FloatTile& tile, base::Arena& scratch) const override {
    const bool in_floats = bytes_type_ ? bytes_.usable : bytes_.divisor_of_words != 0;
    // Floats of words are off by up to 0.008 of a code.
    const double near = in_floats && !bytes_type_ ? 2 * kWholeCode : kWholeCode;
    const int rows = tile.rows + exact_.height - 1;
    const int samples = tile.samples + (exact_.width - 1) * tile.channels;
    // Blocks, padded columns and vectors beyond the last tap are read: there are zeros.
    const int stride = (samples + 2 * kCodeBlock) / kCodeBlock * kCodeBlock;
    FloatTile codes = tile;
    auto* const held = scratch.Allocate<float>(static_cast<size_t>(stride) * static_cast<size_t>(rows) + 16);
    codes.in = held, codes.in_stride = stride, codes.stream = false;
    bool all = true;
    for (int y = 0; y < rows; ++y) {
      const float* const from = tile.in + y * tile.in_stride;
      float* const to = held + ptrdiff_t{y} * stride;
      if (in_floats) {
        all = by_bytes_.to_codes(static_cast<float>(largest()), static_cast<float>(near), from, samples,
                                 stride, to) &&
              all;
      } else {
        all = by_codes_.to_codes(from, samples, largest(), to) && all;
        std::fill(to + samples, to + stride, 0.0f);
      }
    }
    std::fill_n(held + ptrdiff_t{rows} * stride, 16, 0.0f);
    if (!all) {
      floats_->Run(tile, scratch);
      codes.out = scratch.Allocate<float>(static_cast<size_t>(tile.samples) * static_cast<size_t>(tile.rows));
      codes.out_stride = tile.samples;
    }
    if (in_floats) {
      SumInFloats(codes, scratch);
    } else {
      auto* const sums = scratch.Allocate<double>(static_cast<size_t>(stride) * (CodesWindow::kPadding + 1));
      by_codes_.sum(exact_, largest(), codes, sums, stride);
    }
    if (all) return;
    KeepWithoutStrangers(exact_, largest(), in_floats ? 2 * kWholeCode : kWholeCode, tile, codes, scratch);
  }

  void Run(const ByteTile& tile, base::Arena& scratch) const override {
    if (bytes_.words.usable) return RunWhole(by_whole_, bytes_.words, tile, scratch);
    if (product_.usable) return RunProducts(by_products_, product_, tile, scratch);
    BytesThroughFloats(tile, scratch);
  }
  void Run(const WordTile& tile, base::Arena& scratch) const override {
    RunProducts(by_products_, product_, tile, scratch);
  }

 private:
  int largest() const { return bytes_type_ ? kLargestByte : kLargestWord; }

  // Floats hold the sums exactly, or are near to them and those near a tie are summed anew.
  void SumInFloats(const FloatTile& codes, base::Arena& scratch) const {
    const float divisor = bytes_type_ ? bytes_.divisor : bytes_.divisor_of_words;
    (divisor != 0 ? whole_ : floats_)->Run(codes, scratch);
    Found found(scratch, codes.samples);
    for (int y = 0; y < codes.rows; ++y) {
      float* const row = codes.out + y * codes.out_stride;
      if (divisor != 0) {
        by_bytes_.settle_whole(divisor, static_cast<float>(largest()), row, codes.samples);
        continue;
      }
      found.Clear();
      by_bytes_.settle_sums(bytes_.band, row, codes.samples, found);
      for (const int i : found) {
        const double exact =
            ExactSum(exact_, codes.in + y * codes.in_stride + i, codes.in_stride, codes.channels);
        row[i] = SettledSample(exact, kLargestByte);
      }
    }
  }

  void BytesThroughFloats(const ByteTile& tile, base::Arena& scratch) const {
    // Of small windows a few rows of a strip stay in L1 from bytes to bytes; of products the whole strip in
    // L2.
    const bool few = exact_.row.empty();
    constexpr int kFewRows = 8, kFewSamples = 768, kStripFloats = 1 << 15, kLeast = 128, kUnit = 16;
    const int rows = tile.rows + exact_.height - 1, margin = (exact_.width - 1) * tile.channels;
    const int wanted = few ? kFewSamples : std::max(kLeast, kStripFloats / rows);
    const int strip = std::min(wanted, tile.samples + kUnit - 1) / kUnit * kUnit;
    const int block = few ? kFewRows : tile.rows;
    const int stride = (strip + margin + 31) / 16 * 16;  // a vector beyond the last tap may be read
    auto* const codes = scratch.Allocate<float>(static_cast<size_t>(stride) * static_cast<size_t>(rows) + 16);
    auto* const sums = scratch.Allocate<float>(static_cast<size_t>(strip) * static_cast<size_t>(block) + 16);
    std::fill_n(codes + ptrdiff_t{rows} * stride, 16, 0.0f);
    Found found(scratch, strip);
    for (int x = 0; x < tile.samples; x += strip) {
      const int samples = std::min(strip, tile.samples - x);
      int converted = 0;
      for (int y0 = 0; y0 < tile.rows; y0 += block) {
        const int y1 = std::min(y0 + block, tile.rows);
        for (; converted < y1 + exact_.height - 1; ++converted) {
          by_bytes_.codes_of_bytes(tile.in + converted * tile.in_stride + x, samples + margin,
                                   codes + ptrdiff_t{converted} * stride);
        }
        const FloatTile floats{
            codes + ptrdiff_t{y0} * stride, stride, sums, strip, samples, y1 - y0, tile.channels, false};
        (bytes_.divisor != 0 ? whole_ : floats_)->Run(floats, scratch);
        for (int y = y0; y < y1; ++y) {
          uint8_t* const out = tile.out + y * tile.out_stride + x;
          const float* const row = sums + ptrdiff_t{y - y0} * strip;
          if (bytes_.divisor != 0) {
            by_bytes_.bytes_of_whole(bytes_.divisor, row, samples, out);
            continue;
          }
          found.Clear();
          by_bytes_.bytes_of_sums(bytes_.band, row, samples, out, found);
          for (const int i : found) {
            const double exact = ExactSum(exact_, codes + ptrdiff_t{y} * stride + i, stride, tile.channels);
            out[i] = static_cast<uint8_t>(
                std::clamp(std::nearbyint(SettledSample(exact, 1)), 0.0f, float{kLargestByte}));
          }
        }
      }
    }
  }

  bool bytes_type_;
  CodesWindow exact_;
  BytesWindow bytes_;
  ProductWindow product_;
  std::unique_ptr<const WindowSums> floats_, whole_;  // under the weights, and under whole ones
  CodesFunctions by_codes_ = ChooseCodes();
  BytesFunctions by_bytes_ = ChooseBytes();
  WholeFunction by_whole_ = ChooseWhole();
  ProductFunctions by_products_ = ChooseProducts();
};

}  // namespace

std::unique_ptr<const WindowSums> MakeCodeSums(PixelType type, const CodeKernel& kernel,
                                               std::unique_ptr<const WindowSums> floats) {
  return std::make_unique<const CodeSums>(type, kernel, std::move(floats));
}

CodesTest::CodesTest(PixelType type)
    : type_(type), bytes_(ChooseBytes().to_codes), words_(ChooseCodes().to_codes) {}

bool CodesTest::operator()(const float* samples, int count) const {
  return type_ == PixelType::kUint8
             ? bytes_(kLargestByte, static_cast<float>(kWholeCode), samples, count, count, nullptr)
             : words_(samples, count, kLargestWord, nullptr);
}

}  // namespace tessera::ops
