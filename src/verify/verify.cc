// Sampled tiles of a pipeline, engine against reference.
#include "tessera/verify.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <vector>

#include "ops/registry.h"
#include "tessera/error.h"
#include "verify/evaluate.h"
#include "verify/pixels.h"

namespace tessera {
namespace verify {

double HalfToDouble(uint16_t bits) {
  const int exponent = (bits >> 10) & 31, fraction = bits & 1023;
  double v;
  if (exponent == 31) {
    v = fraction != 0 ? std::numeric_limits<double>::quiet_NaN() : std::numeric_limits<double>::infinity();
  } else if (exponent == 0) {
    v = std::ldexp(fraction, -24);
  } else {
    v = std::ldexp(1024 + fraction, exponent - 25);
  }
  return (bits & 0x8000) != 0 ? -v : v;
}

void ReadExact(const graph::PixelSource& source, reference::ImageD& out) {
  if (out.roi.empty()) return;
  ConstImageView view;
  std::vector<std::byte> rows;
  if (const auto resident = source.View()) {
    view = *resident;
  } else {
    const ImageSpec& spec = source.spec();
    const Roi roi{spec.data_window.x0, out.roi.y0, spec.data_window.x1, out.roi.y1};
    rows.resize(static_cast<size_t>(roi.pixels()) * spec.channels.size() * PixelBytes(spec.type));
    const ImageView all(rows.data(), roi, spec.channel_count(), spec.type);
    source.Open(0, spec.channel_count())->Read(all);
    view = all;
  }
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    for (int x = out.roi.x0; x < out.roi.x1; ++x) {
      for (int c = 0; c < out.channels; ++c) {
        const std::byte* p = view.At(x, y, c);
        uint16_t word = 0;
        float real = 0;
        double& v = out.at(x, y, c);
        switch (view.type) {
          case PixelType::kUint8:
            v = std::to_integer<int>(*p) / 255.0;
            break;
          case PixelType::kUint16:
            std::memcpy(&word, p, 2);
            v = word / 65535.0;
            break;
          case PixelType::kHalf:
            std::memcpy(&word, p, 2);
            v = HalfToDouble(word);
            break;
          case PixelType::kFloat:
            std::memcpy(&real, p, 4);
            v = real;
            break;
        }
      }
    }
  }
}

int CodeOf(double value, int max_code) {
  if (!(value > 0)) return 0;  // NaN too
  if (value >= 1) return max_code;
  return static_cast<int>(std::nearbyint(value * max_code));
}

namespace {

// The error that an operation's row promises; an operation without a row promises two roundings.
double BoundOf(const std::string& op) {
  const ops::OpInfo* info = ops::FindOp(op);
  return info != nullptr ? info->bound_u : 2.0;
}

// Tiles spread over the window: its corners, its middle, then a fixed pseudo-random set, sorted by row.
std::vector<Roi> SampleTiles(const Roi& window, const VerifyOptions& options) {
  const int w = std::min(options.tile_size, window.width()), h = std::min(options.tile_size, window.height());
  const int64_t free_x = window.width() - w, free_y = window.height() - h;
  std::vector<Roi> tiles;
  const auto add = [&](int64_t dx, int64_t dy) {
    const Roi r{window.x0 + static_cast<int>(dx), window.y0 + static_cast<int>(dy),
                window.x0 + static_cast<int>(dx) + w, window.y0 + static_cast<int>(dy) + h};
    if (std::find(tiles.begin(), tiles.end(), r) == tiles.end()) tiles.push_back(r);
  };
  uint64_t state = 0x9E3779B97F4A7C15u;
  const auto random = [&](int64_t below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<int64_t>((state >> 33) % static_cast<uint64_t>(below + 1));
  };
  const int64_t corners[5][2] = {
      {0, 0}, {free_x, free_y}, {free_x / 2, free_y / 2}, {free_x, 0}, {0, free_y}};
  for (int i = 0; i < options.samples; ++i) {
    if (i < 5) {
      add(corners[i][0], corners[i][1]);
    } else {
      add(random(free_x), random(free_y));
    }
  }
  std::sort(tiles.begin(), tiles.end(),
            [](const Roi& a, const Roi& b) { return a.y0 != b.y0 ? a.y0 < b.y0 : a.x0 < b.x0; });
  return tiles;
}

// What one tile may take of all images on its way, as the default size does under windows of a thousand
// pixels a side, and how much is never evaluated: double pixels of that many fill some gigabytes.
constexpr double kTileWork = 1 << 20;
constexpr double kMostWork = 1 << 26;

// Smaller tiles and fewer of them where a pixel of the result comes from very many.
VerifyOptions Affordable(const Node& node, VerifyOptions options) {
  const Roi& window = node.spec().data_window;
  const auto work = [&](int size) {
    const int w = std::min(size, window.width()), h = std::min(size, window.height());
    const int x = window.x0 + (window.width() - w) / 2, y = window.y0 + (window.height() - h) / 2;
    return ReferenceEngine::Work(node, {x, y, x + w, y + h});
  };
  int& size = options.tile_size;
  size = std::min(size, std::max(window.width(), window.height()));
  double now = work(size);
  // Large tiles have the most pixels for their work, but there should be some of them.
  const double most = kTileWork * std::max(1, options.samples / 4);
  while (now > most && size > 1) {
    const double smaller = work(size / 2);
    if (smaller > 0.75 * now) break;  // what they come from hardly depends on their own size
    now = smaller, size /= 2;
  }
  if (now > kMostWork) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "found a result whose %d x %d pixels come from %.3g others, expected at most 2^26 for the "
                  "reference",
                  std::min(size, window.width()), std::min(size, window.height()), now);
    throw Error("verify", text);
  }
  options.samples =
      static_cast<int>(std::clamp(options.samples * kTileWork / now, 1.0, double(options.samples)));
  return options;
}

class Comparison {
 public:
  explicit Comparison(VerifyReport& report) : r_(report) {}

  void Values(int x, int y, int c, double got, double want, double tolerance) {
    ++r_.samples;
    if (std::isnan(got) || std::isnan(want) || std::isinf(got) || std::isinf(want)) {
      const bool same = (std::isnan(got) && std::isnan(want)) || got == want;
      // Beyond float's range the float result is infinite where the double one is not.
      const bool overflow = std::isinf(got) && std::fabs(want) > std::numeric_limits<float>::max();
      // An infinity that arose on the way may have met another one.
      if (!same && !overflow) {
        ++r_.nan_mismatches;
        Outside(x, y, c, std::numeric_limits<double>::infinity());
      }
      return;
    }
    const double error = std::fabs(got - want);
    squares_ += error * error;
    // The reference itself is exact to double's precision only.
    const double allowed = tolerance + 1e-14 * std::fabs(want) + 0x1p-149;
    r_.bound = std::max(r_.bound, allowed);
    r_.max_error = std::max(r_.max_error, error);
    if (error > allowed) Outside(x, y, c, error / allowed);
  }

  // `at_tie`: the bound reaches a rounding tie, so one code either way is right.
  void Codes(int x, int y, int c, int got, double want, double tolerance, int max_code) {
    const int code = CodeOf(want, max_code);
    if (got == code) return;
    ++r_.codes_wrong;
    r_.max_code_error = std::max(r_.max_code_error, std::abs(got - code));
    const double position = std::clamp(want, 0.0, 1.0) * max_code;
    const double tie_distance = std::fabs(std::fabs(position - code) - 0.5);
    // ACCURACY: off by one code only within 2^-12 of a tie, or as far as the float error reaches.
    const double allowed = 0x1p-12 + tolerance * max_code;
    if (std::abs(got - code) > 1 || tie_distance > allowed) {
      Outside(x, y, c, std::fabs(position - got) / (0.5 + allowed));
    }
  }

  void Finish() {
    if (r_.samples > 0) r_.rms_error = std::sqrt(squares_ / static_cast<double>(r_.samples));
  }

 private:
  // `excess`: the error in units of what is allowed.
  void Outside(int x, int y, int c, double excess) {
    ++r_.out_of_bound;
    r_.within_bound = false;
    if (excess <= excess_) return;
    excess_ = excess;
    r_.worst_x = x, r_.worst_y = y, r_.worst_channel = c;
  }
  VerifyReport& r_;
  double excess_ = 0;
  double squares_ = 0;
};

int CodeAt(const ImageView& view, int x, int y, int c) {
  const std::byte* p = view.At(x, y, c);
  if (view.type == PixelType::kUint8) return std::to_integer<int>(*p);
  uint16_t word;
  std::memcpy(&word, p, 2);
  return word;
}

}  // namespace
}  // namespace verify

std::string VerifyReport::Summary() const {
  char text[256];
  int n = std::snprintf(text, sizeof text, "max error %.3g, rms %.3g over %lld values (bound %.3g)",
                        max_error, rms_error, static_cast<long long>(samples), bound);
  std::string s(text, static_cast<size_t>(n));
  if (codes_wrong > 0) {
    s += ", " + std::to_string(codes_wrong) + " codes off by up to " + std::to_string(max_code_error);
  }
  if (nan_mismatches > 0) s += ", " + std::to_string(nan_mismatches) + " non-finite mismatches";
  s += within_bound
           ? ": within bound"
           : ": " + std::to_string(out_of_bound) + " OUT OF BOUND, worst at x=" + std::to_string(worst_x) +
                 " y=" + std::to_string(worst_y) + " channel " + std::to_string(worst_channel);
  for (const std::string& remark : remarks) s += "; " + remark;
  return s;
}

VerifyReport Verify(const Node& node, PixelType type, const VerifyOptions& asked) {
  VerifyReport report;
  const ImageSpec& spec = node.spec();
  const VerifyOptions options = spec.data_window.empty() ? asked : verify::Affordable(node, asked);
  verify::Comparison comparison(report);
  verify::ReferenceEngine engine(&verify::BoundOf);
  const bool integer = type == PixelType::kUint8 || type == PixelType::kUint16;
  for (const Roi& tile : verify::SampleTiles(spec.data_window, options)) {
    if (tile.empty()) continue;
    const verify::Evaluated want = engine.Evaluate(node, tile);
    ImageSpec part = spec;
    part.data_window = tile;
    part.type = PixelType::kFloat;
    const Image values{part};
    RenderInto(node, values.view(), options.render);
    Image codes;
    if (integer) {
      part.type = type;
      codes = Image(part);
      RenderInto(node, codes.view(), options.render);
    }
    for (int y = tile.y0; y < tile.y1; ++y) {
      for (int x = tile.x0; x < tile.x1; ++x) {
        for (int c = 0; c < spec.channel_count(); ++c) {
          const double tolerance = want.tolerance.at(x, y, c);
          comparison.Values(x, y, c, values.at<float>(x, y, c), want.value.at(x, y, c), tolerance);
          if (integer) {
            comparison.Codes(x, y, c, verify::CodeAt(codes.view(), x, y, c), want.value.at(x, y, c),
                             tolerance, type == PixelType::kUint8 ? 255 : 65535);
          }
        }
      }
    }
  }
  comparison.Finish();
  report.remarks.assign(engine.remarks().begin(), engine.remarks().end());
  if (options.samples < asked.samples ||
      options.tile_size < std::min(asked.tile_size, std::max(spec.width(), spec.height()))) {
    const std::string side = std::to_string(options.tile_size);
    report.remarks.push_back("sampled in " + std::to_string(options.samples) + " tiles of " + side + "x" +
                             side + " pixels, which come from very many others");
  }
  return report;
}

}  // namespace tessera
