// A band of rows goes through in strips of columns. Every row of a strip is summed in blocks of 2, 4, 8, ...
// pixels, of which each level takes those that make up its windows: so a row is read once for all levels.
// What a window has in the next strip or band is carried there as a sum, so that results do not depend on who
// works.
#include "ops/geometry/mip_boxes.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <utility>

#include "base/worker_arenas.h"
#include "ops/geometry/mip_boxes_kernel.h"

namespace tessera::ops {
namespace {

constexpr int kBand = 64;     // rows
constexpr int kHalvings = 6;  // of a band's

// Windows of an axis of a level that have sources in [s0, s1): [begin, end).
struct Touched {
  int begin = 0, end = 0;
};
Touched WindowsIn(const AxisTaps& taps, int s0, int s1) {
  const int n = static_cast<int>(taps.first.size());
  Touched t;
  t.begin = static_cast<int>(
      std::partition_point(
          taps.first.begin(), taps.first.end(),
          [&](const int& f) { return f + taps.count[static_cast<size_t>(&f - taps.first.data())] <= s0; }) -
      taps.first.begin());
  t.end = static_cast<int>(std::lower_bound(taps.first.begin(), taps.first.end(), s1) - taps.first.begin());
  t.end = std::clamp(t.end, t.begin, n);
  return t;
}

// Pixels [a, b) of a strip in as few blocks as there can be.
void AppendBlocks(int a, int b, std::vector<int>& blocks) {
  while (a < b) {
    int size = std::min(kStripBlocks, static_cast<int>(std::bit_width(static_cast<unsigned>(b - a))) - 1);
    if (a > 0) size = std::min(size, static_cast<int>(std::countr_zero(static_cast<unsigned>(a))));
    blocks.push_back(size == 0 ? ~a : BlockOffset(size) + (a >> size));
    a += 1 << size;
  }
}

StripWindows WindowsOfStrip(const AxisTaps& taps, int s0, int s1) {
  StripWindows w;
  const Touched touched = WindowsIn(taps, s0, s1);
  w.first = touched.begin;
  w.count = touched.end - touched.begin;
  if (w.count == 0) return w;
  w.begin.push_back(0);
  bool in_order = true;
  for (int i = touched.begin; i < touched.end; ++i) {
    const int first = taps.first[static_cast<size_t>(i)], end = first + taps.count[static_cast<size_t>(i)];
    if (i == touched.begin) w.begun = first < s0;
    if (i == touched.end - 1) w.continues = end > s1;
    AppendBlocks(std::max(first, s0) - s0, std::min(end, s1) - s0, w.blocks);
    w.begin.push_back(static_cast<int>(w.blocks.size()));
    in_order = in_order && static_cast<int>(w.blocks.size()) == i - touched.begin + 1 &&
               w.blocks.back() >= 0 && w.blocks.back() == w.blocks.front() + i - touched.begin;
  }
  if (in_order) w.place = w.blocks.front();
  return w;
}

// Whether window i is the 2^level sources from source0 + i 2^level on.
bool Divides(const AxisTaps& taps, int source0, int level) {
  for (size_t i = 0; i < taps.first.size(); ++i) {
    if (taps.first[i] != source0 + static_cast<int>(i << level) || taps.count[i] != 1 << level) return false;
  }
  return true;
}

// What is known of a level beforehand.
struct LevelPlan {
  Roi window;
  AxisTaps y;
  std::vector<StripWindows> strips;
  std::vector<double> weights;  // of the windows of a row; empty where all are the same
  double weight = 1;            // that one
  int largest = 0;

  int width() const { return window.width(); }
  double RowWeight(int row) const { return 1.0 / y.count[static_cast<size_t>(row)]; }
};

// The first and the last row that a band has a part of, where other bands have the rest: sums of all windows.
struct Carry {
  int row[2] = {-1, -1};
  std::vector<double> sums[2];
};

class MipBoxStage final : public graph::WholeStage {
 public:
  MipBoxStage(std::vector<MipLevel> levels, const Roi& source, int largest) {
    for (MipLevel& level : levels) {
      LevelPlan plan;
      plan.window = level.window;
      const AxisTaps& x = level.x;
      for (int s = source.x0; s < source.x1; s += kStrip) {
        plan.strips.push_back(WindowsOfStrip(x, s, std::min(s + kStrip, source.x1)));
      }
      plan.weight = 1.0 / x.count.front();
      if (std::adjacent_find(x.count.begin(), x.count.end(), std::not_equal_to<>()) != x.count.end()) {
        plan.weight = 1;
        for (const int n : x.count) plan.weights.push_back(1.0 / n);
      }
      plan.largest = x.halves && level.y.halves ? largest : 0;
      const int number = static_cast<int>(levels_.size()) + 1;
      if (halvings_ == number - 1 && number <= kHalvings && Divides(x, source.x0, number) &&
          Divides(level.y, source.y0, number)) {
        halvings_ = number;
      }
      plan.y = std::move(level.y);
      levels_.push_back(std::move(plan));
    }
  }

  void Run(std::span<const ConstImageView> in, const ImageView& out,
           const graph::Workers& workers) const override {
    const Roi& source = in[0].roi;
    if (source.empty()) return;
    const int bands = (source.height() + kBand - 1) / kBand;
    std::vector<std::vector<Carry>> carries(static_cast<size_t>(bands));
    base::WorkerArenas arenas(workers);
    workers.For(bands, [&](int64_t band, int worker) {
      base::Arena& arena = arenas[worker];
      arena.Reset();
      const int y0 = source.y0 + static_cast<int>(band) * kBand, y1 = std::min(y0 + kBand, source.y1);
      Band(*this, in[0], out, y0, y1, arena, carries[static_cast<size_t>(band)]).Run();
      Clear(out, source, y0, band + 1 == bands ? out.roi.y1 : y1);
    });
    workers.For(static_cast<int64_t>(levels_.size()),
                [&](int64_t level, int) { Join(static_cast<size_t>(level), carries, out); });
  }

 private:
  // The work on one band.
  class Band {
   public:
    Band(const MipBoxStage& stage, const ConstImageView& in, const ImageView& out, int y0, int y1,
         base::Arena& arena, std::vector<Carry>& carries)
        : stage_(stage), in_(in), out_(out), y0_(y0), y1_(y1), channels_(in.channels), carries_(carries) {
      const auto samples = static_cast<size_t>(channels_);
      blocks_ = arena.Allocate<double>(kStrip * samples);
      rows_ = arena.Allocate<double>(kStrip * samples);
      for (int k = 0; k < stage.halvings_; ++k) {
        for (double*& row : halves_[k]) row = arena.Allocate<double>((kStrip >> (k + 1)) * samples);
      }
      for (const LevelPlan& plan : stage.levels_) {
        int strip_windows = 0;
        for (const StripWindows& w : plan.strips) strip_windows = std::max(strip_windows, w.count);
        State s;
        Carry carry;
        if (static_cast<int>(states_.size()) >= stage.halvings_) {
          s.rows = WindowsIn(plan.y, y0, y1);
          for (double*& sums : s.sums)
            sums = arena.Allocate<double>(static_cast<size_t>(strip_windows) * samples);
          s.pending = arena.Allocate<double>(static_cast<size_t>(s.rows.end - s.rows.begin) * samples);
          for (int row = s.rows.begin; row < s.rows.end; ++row) {
            ends_.push_back(std::clamp(plan.y.first[static_cast<size_t>(row)], y0, y1));
            ends_.push_back(std::clamp(End(plan, row), y0, y1));
            if (plan.y.first[static_cast<size_t>(row)] >= y0 && End(plan, row) <= y1) continue;
            const int slot = carry.row[0] < 0 ? 0 : 1;
            carry.row[slot] = row;
            carry.sums[slot].assign(static_cast<size_t>(plan.width()) * samples, 0.0);
          }
        }
        states_.push_back(s);
        carries_.push_back(std::move(carry));
      }
      ends_.push_back(y1);
      std::sort(ends_.begin(), ends_.end());
      ends_.erase(std::unique(ends_.begin(), ends_.end()), ends_.end());
    }

    void Run() {
      const Roi& source = in_.roi;
      const bool others = stage_.halvings_ < static_cast<int>(states_.size());
      for (int s = source.x0, strip = 0; s < source.x1; s += kStrip, ++strip) {
        const int pixels = std::min(kStrip, source.x1 - s);
        for (State& state : states_) state.row = state.rows.begin;
        const bool halved = stage_.halvings_ > 0;
        if (halved) {
          for (int y = y0_; y < y1_; y += 2) Halve(s, y, pixels);
          if (!others) continue;
        }
        auto end = std::upper_bound(ends_.begin(), ends_.end(), y0_);
        for (int y = y0_, begin = y0_; y < y1_; ++y) {
          stage_.functions_.accumulate(Source(s, y), pixels * channels_, y == begin, rows_,
                                       halved ? nullptr : Copy(s, y));
          if (y + 1 != *end) continue;
          stage_.functions_.sum_blocks(rows_, pixels, channels_, blocks_);
          for (size_t k = static_cast<size_t>(stage_.halvings_); k < states_.size(); ++k) {
            AddRows(k, static_cast<size_t>(strip), begin, *end);
          }
          begin = *end++;
        }
      }
    }

   private:
    struct State {
      Touched rows;               // of the level, that have sources in this band
      int row = 0;                // the first that is not finished in this strip
      double* sums[2] = {};       // of it and the one after, which may share a source row
      double* pending = nullptr;  // of every row, the window that goes on in the next strip
    };

    static int End(const LevelPlan& plan, int row) {
      return plan.y.first[static_cast<size_t>(row)] + plan.y.count[static_cast<size_t>(row)];
    }
    const float* Source(int x, int y) const { return reinterpret_cast<const float*>(in_.At(x, y)); }
    float* Copy(int x, int y) const { return reinterpret_cast<float*>(out_.At(x, y)); }

    // Rows y and y + 1 of a strip into the first level, two of its rows into the second, and so on.
    void Halve(int s, int y, int pixels) {
      const int x = s - in_.roi.x0, row = y - in_.roi.y0;
      for (int k = 0; k < stage_.halvings_; ++k) {
        const int at = row >> (k + 1);  // of the level
        double* const sums = halves_[k][at % 2];
        const int count = pixels >> (k + 1);
        if (k == 0) {
          stage_.functions_.halve(Source(s, y), Source(s, y + 1), count, channels_, Copy(s, y),
                                  Copy(s, y + 1), sums);
        } else {
          stage_.functions_.halve_sums(halves_[k - 1][0], halves_[k - 1][1], count, channels_, sums);
        }
        stage_.RoundRow(stage_.levels_[static_cast<size_t>(k)], at, x >> (k + 1), count, sums, out_);
        if (at % 2 == 0) return;
      }
    }

    // The sum of rows [begin, end), which every window of a level holds all or none of.
    void AddRows(size_t level, size_t strip, int begin, int end) {
      const LevelPlan& plan = stage_.levels_[level];
      const StripWindows& windows = plan.strips[strip];
      State& state = states_[level];
      for (int r = state.row; r < state.rows.end && plan.y.first[static_cast<size_t>(r)] <= begin; ++r) {
        double* const sums = state.sums[r % 2];
        if (windows.count > 0) {
          const bool set = begin == std::max(y0_, plan.y.first[static_cast<size_t>(r)]);
          stage_.functions_.add(windows, rows_, blocks_, channels_, set, sums);
        }
        if (end == std::min(End(plan, r), y1_)) {
          if (windows.count > 0) Finish(level, windows, r, sums);
          state.row = r + 1;
        }
      }
    }

    // A row's sums within a strip: to the next strip, to the next band, or rounded into the level.
    void Finish(size_t level, const StripWindows& windows, int row, double* sums) {
      const LevelPlan& plan = stage_.levels_[level];
      const State& state = states_[level];
      double* const pending = state.pending + ptrdiff_t{channels_} * (row - state.rows.begin);
      if (windows.begun) {
        for (int c = 0; c < channels_; ++c) sums[c] += pending[c];
      }
      int count = windows.count;
      if (windows.continues) {
        --count;
        std::copy_n(sums + ptrdiff_t{count} * channels_, channels_, pending);
      }
      if (count == 0) return;
      Carry& carry = carries_[level];
      for (int slot = 0; slot < 2; ++slot) {
        if (carry.row[slot] != row) continue;
        std::copy_n(sums, ptrdiff_t{count} * channels_,
                    carry.sums[slot].data() + ptrdiff_t{windows.first} * channels_);
        return;
      }
      stage_.RoundRow(plan, row, windows.first, count, sums, out_);
    }

    const MipBoxStage& stage_;
    const ConstImageView in_;
    const ImageView out_;
    const int y0_, y1_, channels_;
    double* blocks_;
    double* rows_;                       // their sum
    double* halves_[kHalvings][2] = {};  // of the first levels, the sums of two rows
    std::vector<State> states_;
    std::vector<int> ends_;  // rows where a window of the other levels begins or ends
    std::vector<Carry>& carries_;
  };

  void RoundRow(const LevelPlan& plan, int row, int first, int count, const double* sums,
                const ImageView& out) const {
    auto* const to = reinterpret_cast<float*>(out.At(plan.window.x0 + first, plan.window.y0 + row));
    functions_.round(sums, plan.weights.empty() ? nullptr : plan.weights.data() + first,
                     plan.weight * plan.RowWeight(row), count, out.channels, plan.largest, to);
  }

  // Rows that several bands have parts of.
  void Join(size_t level, const std::vector<std::vector<Carry>>& carries, const ImageView& out) const {
    const LevelPlan& plan = levels_[level];
    std::vector<double> sums;
    int row = -1;
    const auto finish = [&] {
      if (row >= 0) RoundRow(plan, row, 0, plan.width(), sums.data(), out);
    };
    for (const std::vector<Carry>& band : carries) {
      const Carry& carry = band[level];
      for (int slot = 0; slot < 2; ++slot) {
        if (carry.row[slot] < 0) continue;
        if (carry.row[slot] == row) {
          for (size_t i = 0; i < sums.size(); ++i) sums[i] += carry.sums[slot][i];
          continue;
        }
        finish();
        row = carry.row[slot];
        sums = carry.sums[slot];
      }
    }
    finish();
  }

  // What neither the source nor a level covers. A column of many levels ends below the source.
  void Clear(const ImageView& out, const Roi& source, int y0, int y1) const {
    const auto clear = [&](int x0, int x1, int y) {
      if (x0 >= x1) return;
      std::fill_n(reinterpret_cast<float*>(out.At(x0, y)), ptrdiff_t{x1 - x0} * out.channels, 0.0f);
    };
    for (int y = y0; y < y1; ++y) {
      if (y >= source.y1) clear(source.x0, source.x1, y);
      int x = source.x1;
      for (const LevelPlan& plan : levels_) {
        if (y >= plan.window.y0 && y < plan.window.y1) x = plan.window.x1;
      }
      clear(x, out.roi.x1, y);
    }
  }

  std::vector<LevelPlan> levels_;
  int halvings_ = 0;  // how many levels are halves of the one before
  MipBoxFunctions functions_ = ChooseMipBoxes();
};

}  // namespace

bool IsOfBoxes(const AxisTaps& taps) {
  for (size_t i = 0; i < taps.first.size(); ++i) {
    const double mean = 1.0 / taps.count[i];
    const double* const w = &taps.weights[static_cast<size_t>(taps.offset[i])];
    const auto near = [&](double v) { return v > mean * (1 - 0x1p-48) && v < mean * (1 + 0x1p-48); };
    if (taps.count[i] <= 0 || !std::all_of(w, w + taps.count[i], near)) return false;
    if (i > 0 && (taps.first[i] < taps.first[i - 1] ||
                  taps.first[i] + taps.count[i] <= taps.first[i - 1] + taps.count[i - 1])) {
      return false;
    }
  }
  return !taps.first.empty();
}

std::unique_ptr<graph::WholeStage> MakeMipBoxes(std::vector<MipLevel> levels, const Roi& source,
                                                int largest) {
  return std::make_unique<MipBoxStage>(std::move(levels), source, largest);
}

}  // namespace tessera::ops
