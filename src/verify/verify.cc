// Sampled tiles of a pipeline's result, as it was stored, against the reference.
#include "tessera/verify.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "tessera/error.h"
#include "verify/compare.h"
#include "verify/evaluate.h"
#include "verify/pixels.h"

namespace tessera {
namespace verify {
namespace {

// The error that an operation's row promises; an operation without a row promises two roundings.
double BoundOf(const std::string& op) {
  const ops::OpInfo* info = ops::FindOp(op);
  return info != nullptr ? info->bound_u : 2.0;
}

// Tiles of a grid over the window: its middle, its corners, then others by a fixed chance, none of them
// twice.
std::vector<Roi> SampleTiles(const Roi& window, const VerifyOptions& options) {
  const int64_t side = options.tile_size;
  const int64_t columns = (window.width() + side - 1) / side, rows = (window.height() + side - 1) / side;
  const int64_t wanted = std::min<int64_t>(options.samples, columns * rows);
  std::set<int64_t> taken;
  std::vector<Roi> tiles;
  const auto add = [&](int64_t column, int64_t row) {
    if (static_cast<int64_t>(tiles.size()) == wanted || !taken.insert(row * columns + column).second) return;
    const auto x = static_cast<int>(window.x0 + column * side), y = static_cast<int>(window.y0 + row * side);
    const auto w = static_cast<int>(std::min<int64_t>(side, window.x1 - x));
    const auto h = static_cast<int>(std::min<int64_t>(side, window.y1 - y));
    tiles.push_back({x, y, x + w, y + h});
  };
  add((columns - 1) / 2, (rows - 1) / 2);  // a whole one
  add(0, 0), add(columns - 1, rows - 1), add(columns - 1, 0), add(0, rows - 1);
  uint64_t state = 0x9E3779B97F4A7C15u;
  const auto random = [&](int64_t below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<int64_t>((state >> 33) % static_cast<uint64_t>(below));
  };
  if (2 * wanted >= columns * rows) {  // chance would find the last ones late
    const int64_t first = random(columns * rows);
    for (int64_t i = 0; i < columns * rows; ++i) {
      const int64_t at = (first + i) % (columns * rows);
      add(at % columns, at / columns);
    }
  }
  while (static_cast<int64_t>(tiles.size()) < wanted) {
    const int64_t row = random(rows);
    add(random(columns), row);
  }
  return tiles;
}

// What one tile may take of all images on its way, as the default size does under windows of a thousand
// pixels a side, and how much is never evaluated: double pixels of that many fill some gigabytes.
constexpr double kTileWork = 1 << 20;
constexpr double kMostWork = 1 << 26;

// Smaller tiles and fewer of them where a pixel of the result comes from very many.
VerifyOptions Affordable(const Node& node, const Roi& window, VerifyOptions options) {
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

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// The reference of tiles, as many as the time allows.
class Sampler {
 public:
  Sampler(const Node& node, const Roi& window, const VerifyOptions& asked)
      : node_(node),
        window_(window),
        asked_(asked),
        budget_(std::max(asked.seconds, 10 * asked.run_seconds)),
        start_(Now()),
        options_(Affordable(node, window, asked)),
        engine_(&BoundOf) {
    const int full = options_.tile_size;
    ChooseSize();
    // Of smaller ones there may be more, while there is time.
    const double times = std::min(64.0, std::pow(double(full) / options_.tile_size, 2));
    options_.samples = static_cast<int>(std::min(65536.0, options_.samples * times));
    tiles_ = SampleTiles(window_, options_);
  }

  // The next tiles that there is time for, at most `count`; none at the end.
  std::vector<std::pair<Roi, Evaluated>> Next(size_t count) {
    std::vector<std::pair<Roi, Evaluated>> batch;
    while (next_ < tiles_.size() && batch.size() < count) {
      const double begin = Now();
      if (next_ > 0 && begin - start_ + longest_ > budget_) {
        next_ = tiles_.size();
        break;
      }
      const Roi& tile = tiles_[next_++];
      try {
        // Between tiles there is no hurry: one that was begun may take half as long again as all.
        engine_.SetDeadline(Deadline(1.5));
        batch.emplace_back(tile, tile == tried_ ? std::move(tried_result_) : engine_.Evaluate(node_, tile));
      } catch (const ReferenceEngine::OutOfTime&) {
        next_ = tiles_.size();
        break;
      }
      longest_ = std::max(longest_, Now() - begin);
      ++evaluated_;
    }
    return batch;
  }

  bool Shrunk() const {
    return evaluated_ < tiles_.size() || options_.samples < asked_.samples ||
           options_.tile_size < std::min(asked_.tile_size, std::max(window_.width(), window_.height()));
  }
  std::string HowMuch() const {
    const std::string side = std::to_string(options_.tile_size);
    return "sampled in " + std::to_string(evaluated_) + " tiles of " + side + "x" + side + " pixels";
  }
  const ReferenceEngine& engine() const { return engine_; }

 private:
  std::chrono::steady_clock::time_point Deadline(double share) const {
    return After(std::max(0.0, start_ + share * budget_ - Now()));
  }
  static std::chrono::steady_clock::time_point After(double seconds) {
    return std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                  std::chrono::duration<double>(std::min(seconds, 1e6)));
  }

  // Tries tiles of growing size in the middle, and takes the largest of which several can be afforded.
  void ChooseSize() {
    const int full = options_.tile_size;
    for (int size = std::min(8, full);; size = std::min(4 * size, full)) {
      options_.tile_size = size;
      const Roi tile = SampleTiles(window_, options_)[0];
      if (tile == tried_) return;
      const double begin = Now();
      // The first has longer than there is, so that there is something to compare.
      engine_.SetDeadline(tried_.empty() ? After(asked_.first_seconds) : Deadline(0.7));
      try {
        tried_result_ = engine_.Evaluate(node_, tile);
      } catch (const ReferenceEngine::OutOfTime&) {
        if (tried_.empty()) {
          throw Error("verify", "found a result whose reference takes more than " +
                                    std::to_string(std::lround(asked_.first_seconds)) + " seconds for " +
                                    std::to_string(tile.pixels()) + " pixels, expected a smaller image");
        }
        options_.tile_size = std::max(tried_.width(), tried_.height());
        return;
      }
      tried_ = tile;
      longest_ = Now() - begin;
      if (size == full) return;
      // At worst the time grows as the pixels do.
      const double next = longest_ * (size * 4 <= full ? 16.0 : std::pow(double(full) / size, 2));
      if (next * std::min(options_.samples, 4) > budget_ - (Now() - start_)) return;
    }
  }

  const Node& node_;
  const Roi window_;
  const VerifyOptions asked_;
  const double budget_, start_;
  VerifyOptions options_;
  ReferenceEngine engine_;
  std::vector<Roi> tiles_;
  Roi tried_;
  Evaluated tried_result_;
  size_t next_ = 0, evaluated_ = 0;
  double longest_ = 0;
};

// The tiles' stored pixels: every row is asked for once, in ascending order.
std::vector<Image> Gather(const StoredPixels& stored, const std::vector<std::pair<Roi, Evaluated>>& tiles) {
  ImageSpec spec(1, 1, static_cast<int>(stored.channels.size()), stored.type);
  std::vector<Image> parts;
  int top = stored.window.y1, bottom = stored.window.y0;
  for (const auto& [tile, unused] : tiles) {
    spec.data_window = spec.display_window = tile;
    parts.emplace_back(spec);
    top = std::min(top, tile.y0), bottom = std::max(bottom, tile.y1);
  }
  constexpr int kRows = 64;
  spec.data_window = {stored.window.x0, 0, stored.window.x1, kRows};
  const Image band = Image::Uninitialized(spec);
  const size_t pixel = PixelBytes(stored.type) * stored.channels.size();
  for (int y0 = top; y0 < bottom;) {
    // To the next row that a tile has, and on to a row that none has.
    const auto wanted = [&](int y) {
      return std::any_of(tiles.begin(), tiles.end(),
                         [&](const auto& t) { return t.first.y0 <= y && y < t.first.y1; });
    };
    if (!wanted(y0)) {
      ++y0;
      continue;
    }
    int y1 = y0 + 1;
    while (y1 < bottom && y1 - y0 < kRows && wanted(y1)) ++y1;
    ImageView rows = band.view();
    rows.roi.y0 = y0, rows.roi.y1 = y1;
    stored.read(rows);
    for (const Image& part : parts) {
      const Roi both = Intersection(part.spec().data_window, rows.roi);
      for (int y = both.y0; y < both.y1; ++y) {
        std::memcpy(part.view().At(both.x0, y), rows.At(both.x0, y), pixel * both.width());
      }
    }
    y0 = y1;
  }
  return parts;
}

// The pixels of a node as an evaluation gives them, a band of rows at a time.
StoredPixels Evaluations(const Node& node, PixelType type, const RenderOptions& options) {
  StoredPixels stored;
  stored.window = node.spec().data_window;
  stored.type = type;
  stored.channels.resize(node.spec().channels.size());
  std::iota(stored.channels.begin(), stored.channels.end(), 0);
  stored.read = [node, options](const ImageView& rows) { RenderInto(node, rows, options); };
  return stored;
}

// "1 code", "2 codes".
std::string Counted(int64_t n, const std::string& what, const std::string& plural = "s") {
  return std::to_string(n) + " " + what + (n == 1 ? "" : plural);
}

}  // namespace
}  // namespace verify

std::string VerifyReport::Summary() const {
  using verify::Counted;
  char text[256];
  const auto add = [&](std::string& s, const char* format, auto... values) {
    std::snprintf(text, sizeof text, format, values...);
    s += text;
  };
  std::string s;
  add(s, "max error %.3g, rms %.3g over %lld values, %.3g %% of the pixels", max_error, rms_error,
      static_cast<long long>(samples), 100 * share);
  add(s, " (bound %.3g where it is closest, %.3g %% of it used", bound, 100 * closest);
  if (median_ratio > 0) add(s, ", %.2g %% in the middle", 100 / median_ratio);
  add(s, "; largest bound %.3g)", largest_bound);
  if (codes_at_tie > 0) s += ", " + Counted(codes_at_tie, "code") + " at a tie rounded the other way";
  if (codes_wrong > 0) {
    s += ", " + Counted(codes_wrong, "code") + " WRONG by up to " + std::to_string(max_code_error);
  }
  if (nan_mismatches > 0) s += ", " + Counted(nan_mismatches, "non-finite mismatch", "es");
  if (undecided > 0 && samples > 0) {
    const double part = static_cast<double>(undecided) / static_cast<double>(samples);
    add(s, ", %.2g %% undecided", 100 * part);
    if (part > 0.01) s += " (more than 1 %: that many values hang on decisions within their own error)";
  }
  s += within_bound
           ? ": within bound"
           : ": " + std::to_string(out_of_bound) + " OUT OF BOUND, worst at x=" + std::to_string(worst_x) +
                 " y=" + std::to_string(worst_y) + " channel " + std::to_string(worst_channel);
  for (const std::string& remark : remarks) s += "; " + remark;
  return s;
}

VerifyReport VerifyStored(const Node& node, const StoredPixels& stored, const VerifyOptions& options) {
  VerifyReport report;
  const Roi window = Intersection(stored.window, node.spec().data_window);
  report.remarks = stored.remarks;
  if (window.empty()) return report;
  verify::Comparison comparison(stored, report);
  verify::Sampler sampler(node, window, options);
  double seen = 0;
  for (auto batch = sampler.Next(256); !batch.empty(); batch = sampler.Next(256)) {
    const std::vector<Image> pixels = verify::Gather(stored, batch);
    for (size_t i = 0; i < batch.size(); ++i) {
      comparison.Tile(pixels[i].view(), batch[i].second);
      seen += static_cast<double>(batch[i].first.pixels());
    }
  }
  comparison.Finish();
  report.share = seen / static_cast<double>(window.pixels());
  const auto& remarks = sampler.engine().remarks();
  report.remarks.insert(report.remarks.end(), remarks.begin(), remarks.end());
  if (sampler.Shrunk()) report.remarks.push_back(sampler.HowMuch() + " to save time");
  return report;
}

VerifyReport VerifyStored(const Node& node, const ConstImageView& stored, const VerifyOptions& options) {
  const ImageSpec& spec = node.spec();
  if (stored.channels != spec.channel_count() || !spec.data_window.Contains(stored.roi)) {
    throw Error("verify", "found pixels of " + std::to_string(stored.channels) + " channels, " +
                              std::to_string(stored.roi.width()) + " x " +
                              std::to_string(stored.roi.height()) + ", expected " +
                              std::to_string(spec.channel_count()) +
                              " channels and a part of the result's window");
  }
  StoredPixels pixels = verify::Evaluations(node, stored.type, {});
  pixels.window = stored.roi;
  const size_t sample = PixelBytes(stored.type);
  pixels.read = [&stored, sample](const ImageView& rows) {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      for (int x = rows.roi.x0; x < rows.roi.x1; ++x) {
        for (int c = 0; c < rows.channels; ++c) std::memcpy(rows.At(x, y, c), stored.At(x, y, c), sample);
      }
    }
  };
  return VerifyStored(node, pixels, options);
}

VerifyReport Verify(const Node& node, PixelType type, const VerifyOptions& asked) {
  const ImageSpec& spec = node.spec();
  VerifyOptions options = asked;
  if (!spec.data_window.empty()) verify::Affordable(node, spec.data_window, asked);  // refuses before the run
  // Images that do not fit are evaluated where they are looked at, in rows as wide as they are.
  constexpr double kMostBytes = 1 << 30;
  if (static_cast<double>(spec.data_window.pixels()) * static_cast<double>(spec.channels.size()) *
          static_cast<double>(PixelBytes(type)) >
      kMostBytes) {
    return VerifyStored(node, verify::Evaluations(node, type, asked.render), options);
  }
  const double start = verify::Now();
  const Image result = Render(node, type, asked.render);
  options.run_seconds = verify::Now() - start;
  return VerifyStored(node, result.view(), options);
}

}  // namespace tessera
