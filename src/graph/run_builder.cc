// The run builder: channels become planes; planes are numbered freely first and given registers afterwards.
#include "graph/run_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace tessera::graph {
namespace {

size_t Z(int i) { return static_cast<size_t>(i); }

// The channel of an input that a passing channel `c` of a result comes from: by name, else by index.
int PassedFrom(const ImageSpec& in, const ImageSpec& out, int c) {
  const int same = in.ChannelIndex(out.channels[Z(c)]);
  if (c < in.channel_count() && in.channels[Z(c)] == out.channels[Z(c)]) return c;
  if (same >= 0) return same;
  return c < in.channel_count() ? c : -1;
}

// The result's channel that a kColor op's fourth plane goes to; -1 for none.
int AlphaOut(const Op& op, const ImageSpec& in, const ImageSpec& out) {
  if (op.WritesAlpha()) return out.alpha >= 0 ? out.alpha : std::min(3, out.channel_count() - 1);
  return in.alpha >= 0 && out.alpha >= 0 ? out.alpha : -1;
}

bool IsColorChannel(int c, int alpha_out) { return c < 3 || c == alpha_out; }

class RunBuilder {
 public:
  RunBuilder(const PlannedGraph& graph, int root) : graph_(graph), root_(root) {}

  void Emit(Prepass& prepass, std::vector<std::string>& prepasses) {
    for (int i = 0; i <= root_; ++i) {
      if (graph_.owner[Z(i)] != root_) continue;
      switch (Data(i).op->Kind()) {
        case OpKind::kSource:
        case OpKind::kTile:
        case OpKind::kWhole:
          break;  // loaded where used
        case OpKind::kShuffle:
          Shuffle(i);
          break;
        case OpKind::kCrop:
          for (int c = 0; c < Channels(i); ++c) {
            if (graph_.needed[Z(i)][Z(c)]) planes_[{i, c}] = Plane(graph_.inputs[Z(i)][0], c);
          }
          break;
        case OpKind::kChannel:
          ChannelOp(i, ContextOf(Data(i), prepass, &prepasses));
          break;
        case OpKind::kColor:
          ColorOp(i, ContextOf(Data(i), prepass, &prepasses));
          break;
      }
    }
  }

  std::unique_ptr<PointRun> Finish(const std::vector<int>& channels) {
    for (const int c : channels) run_->result.push_back(Plane(root_, c));
    FindMoves();
    JoinSteps();
    FindFusions(channels);
    FindSamples(channels);
    AssignPlanes();
    return std::move(run_);
  }

 private:
  const NodeData& Data(int i) const { return *graph_.nodes[Z(i)].data(); }
  int Channels(int i) const { return Data(i).spec.channel_count(); }

  PlaneId NewPlane() { return next_++; }

  // The plane that holds a channel of a node; loads it when it is not of this run's making.
  PlaneId Plane(int node, int c) {
    const auto it = planes_.find({node, c});
    if (it != planes_.end()) return it->second;
    const bool from_tile = graph_.source[Z(node)] < 0;
    PlaneLoad load;
    load.from_tile = from_tile;
    load.index = from_tile ? graph_.buffer[Z(node)] : graph_.source[Z(node)];
    int held = 0;  // index of the channel in the tile, which has the needed ones only
    for (int k = 0; k < Channels(node); ++k) {
      if (!graph_.needed[Z(node)][Z(k)]) continue;
      if (k / 4 == c / 4) {
        load.channel[k % 4] = from_tile ? held : k;
        load.plane[k % 4] = planes_[{node, k}] = NewPlane();
      }
      ++held;
    }
    run_->items.push_back({true, static_cast<int>(run_->loads.size())});
    run_->loads.push_back(load);
    return planes_.at({node, c});
  }

  void Shuffle(int i) {
    std::vector<ImageSpec> specs;
    for (const Node& input : Data(i).inputs) specs.push_back(input.spec());
    const std::vector<ChannelRef> map = Data(i).op->ChannelMap(specs);
    for (int c = 0; c < Channels(i); ++c) {
      if (!graph_.needed[Z(i)][Z(c)]) continue;
      const ChannelRef& ref = map[Z(c)];
      planes_[{i, c}] =
          ref.input < 0 ? ConstantPlane(ref.value) : Plane(graph_.inputs[Z(i)][Z(ref.input)], ref.channel);
    }
  }

  PlaneId ConstantPlane(float value) {
    if (value == 0.0f && !std::signbit(value)) return kZeroPlane;
    if (value == 1.0f) return kOnePlane;
    const PlaneId plane = NewPlane();
    PointStep step;
    step.stage = std::make_unique<ConstantStage>(value);
    step.label = "constant";
    step.out = {plane, kDummyPlane, kDummyPlane, kDummyPlane};
    AddStep(std::move(step));
    constants_[plane] = value;
    return plane;
  }

  void ChannelOp(int i, const ContextOf& context) {
    const std::vector<ImageSpec> specs = InputSpecs(i);
    for (int base = 0; base < Channels(i); base += 4) {
      PointStep step;
      std::array<int, 4> channels = {-1, -1, -1, -1};
      step.in.assign(specs.size(), {kZeroPlane, kZeroPlane, kZeroPlane, kZeroPlane});
      bool any = false;
      for (int p = 0; p < 4; ++p) {
        const int c = base + p;
        step.out[Z(p)] = kDummyPlane;
        if (c >= Channels(i) || !graph_.needed[Z(i)][Z(c)]) continue;
        any = true;
        channels[Z(p)] = c;
        for (size_t k = 0; k < specs.size(); ++k) {
          if (graph_.inputs[Z(i)][k] < 0) continue;
          step.in[k][Z(p)] = Plane(graph_.inputs[Z(i)][k], specs[k].channel_count() == 1 ? 0 : c);
        }
        step.out[Z(p)] = planes_[{i, c}] = NewPlane();
      }
      if (!any) continue;
      step.stage = Data(i).op->MakePointStage(context.For(channels));
      step.label = Data(i).op->Describe();
      AddStep(std::move(step));
    }
  }

  void ColorOp(int i, const ContextOf& context) {
    const Op& op = *Data(i).op;
    const ImageSpec& out = Data(i).spec;
    const std::vector<ImageSpec> specs = InputSpecs(i);
    const std::vector<bool>& needed = graph_.needed[Z(i)];
    const int alpha_out = AlphaOut(op, specs[0], out);
    bool any = false;
    for (int c = 0; c < out.channel_count(); ++c) {
      if (!needed[Z(c)]) continue;
      if (IsColorChannel(c, alpha_out) && (c < 3 || op.WritesAlpha())) {
        any = true;
      } else if (c != alpha_out) {
        planes_[{i, c}] = Plane(graph_.inputs[Z(i)][0], PassedFrom(specs[0], out, c));
      }
    }
    const bool pass_alpha = !op.WritesAlpha() && alpha_out >= 0 && needed[Z(alpha_out)];
    if (!any) {  // only alpha is wanted and the op does not touch it
      if (pass_alpha) planes_[{i, alpha_out}] = Plane(graph_.inputs[Z(i)][0], specs[0].alpha);
      return;
    }
    PointStep step;
    for (size_t k = 0; k < specs.size(); ++k) {
      std::array<PlaneId, 4> in = {kZeroPlane, kZeroPlane, kZeroPlane, kZeroPlane};
      if (graph_.inputs[Z(i)][k] < 0) {
        step.in.push_back(in);
        continue;
      }
      for (int p = 0; p < 3; ++p) in[Z(p)] = Plane(graph_.inputs[Z(i)][k], p);
      const bool alpha = specs[k].alpha >= 0 && (op.ReadsAlpha() || pass_alpha);
      in[3] = alpha ? Plane(graph_.inputs[Z(i)][k], specs[k].alpha) : kOnePlane;
      step.in.push_back(in);
    }
    for (int p = 0; p < 4; ++p) {
      const int c = p < 3 ? p : alpha_out;
      const bool wanted = c >= 0 && c < out.channel_count() && needed[Z(c)];
      step.out[Z(p)] = wanted ? planes_[{i, c}] = NewPlane() : kDummyPlane;
    }
    step.stage = op.MakePointStage(context.For({0, 1, 2, alpha_out}));
    step.label = op.Describe();
    AddStep(std::move(step));
  }

  std::vector<ImageSpec> InputSpecs(int i) const {
    std::vector<ImageSpec> specs;
    for (const Node& input : Data(i).inputs) specs.push_back(input.spec());
    return specs;
  }

  void AddStep(PointStep step) {
    run_->items.push_back({false, static_cast<int>(run_->steps.size())});
    run_->steps.push_back(std::move(step));
  }

  // How often every plane is read, the store included.
  std::vector<int> Readers() const {
    std::vector<int> readers(Z(next_), 0);
    for (const PointStep& step : run_->steps) {
      for (const auto& in : step.in) {
        for (const PlaneId p : in) ++readers[Z(p)];
      }
    }
    for (const PlaneId p : run_->result) ++readers[Z(p)];
    return readers;
  }

  // Where nothing is computed but constants the pixels' own bytes may be moved.
  void FindMoves() {
    if (run_->steps.size() + 2 != constants_.size()) return;
    for (const PlaneId plane : run_->result) {
      MovedChannel moved;
      if (const auto it = constants_.find(plane); it != constants_.end()) {
        moved.value = it->second;
      } else {
        for (size_t l = 0; l < run_->loads.size(); ++l) {
          const PlaneLoad& load = run_->loads[l];
          for (int p = 0; p < 4; ++p) {
            if (load.plane[p] == plane) moved = {static_cast<int>(l), load.channel[p], 0};
          }
        }
      }
      run_->moved.push_back(moved);
    }
  }

  // Two steps in a row become one where the second alone takes the first's planes and their stages can be
  // joined. Pairs only: longer chains would not find their coefficients in registers.
  void JoinSteps() {
    const std::vector<int> readers = Readers();
    std::vector<PointRun::Item> items;
    std::vector<PointStep> steps;
    bool joined = false;  // the step last kept is a pair
    for (PointRun::Item item : run_->items) {
      if (item.is_load) {
        items.push_back(item);
        joined = false;
        continue;
      }
      PointStep step = std::move(run_->steps[Z(item.index)]);
      if (!items.empty() && !items.back().is_load && !joined) {
        PointStep& first = steps.back();
        const bool alone = step.in.size() == 1 && step.in[0] == first.out &&
                           std::all_of(first.out.begin(), first.out.end(),
                                       [&](PlaneId p) { return p >= kFirstFreePlane && readers[Z(p)] == 1; });
        if (auto both = alone ? first.stage->Then(*step.stage) : nullptr) {
          first.stage = std::move(both);
          first.out = step.out;
          first.label += ", " + step.label;
          joined = true;
          continue;
        }
      }
      joined = false;
      item.index = static_cast<int>(steps.size());
      items.push_back(item);
      steps.push_back(std::move(step));
    }
    run_->items = std::move(items);
    run_->steps = std::move(steps);
  }

  // A first step that alone reads all of an RGBA load (of two, where it has two inputs), and a last one whose
  // planes alone are stored, may work on the pixels themselves.
  void FindFusions(const std::vector<int>& channels) {
    const std::vector<int> readers = Readers();
    const auto alone = [&](const std::array<PlaneId, 4>& planes) {
      return std::all_of(planes.begin(), planes.end(),
                         [&](PlaneId p) { return p >= kFirstFreePlane && readers[Z(p)] == 1; });
    };
    for (PointStep& step : run_->steps) {
      for (size_t k = 0; k < step.in.size() && step.in.size() <= step.fused_load.size(); ++k) {
        if (!alone(step.in[k])) continue;
        for (size_t l = 0; l < run_->loads.size(); ++l) {
          const PlaneLoad& load = run_->loads[l];
          if (std::equal(step.in[k].begin(), step.in[k].end(), load.plane) &&
              std::equal(load.channel, load.channel + 4, std::array{0, 1, 2, 3}.begin())) {
            step.fused_load[k] = static_cast<int>(l);
          }
        }
      }
      step.fused_store =
          channels == std::vector<int>{0, 1, 2, 3} && alone(step.out) &&
          std::equal(step.out.begin(), step.out.end(), run_->result.begin(), run_->result.end());
    }
  }

  // A single step on all of one to four channels may take rows of samples instead.
  void FindSamples(const std::vector<int>& channels) {
    const size_t count = channels.size();
    if (run_->steps.size() != 1 || count == 0 || count > 4) return;
    for (size_t c = 0; c < count; ++c) {
      if (channels[c] != static_cast<int>(c)) return;
    }
    const PointStep& step = run_->steps[0];
    if (!std::equal(run_->result.begin(), run_->result.end(), step.out.begin())) return;
    std::vector<int> found;
    for (const auto& in : step.in) {
      for (size_t l = 0; l < run_->loads.size() && found.size() < step.in.size(); ++l) {
        const PlaneLoad& load = run_->loads[l];
        bool serves = true;
        for (size_t c = 0; c < count; ++c) {
          serves = serves && load.channel[c] == static_cast<int>(c) && load.plane[c] == in[c];
        }
        if (serves) {
          found.push_back(static_cast<int>(l));
          break;
        }
      }
    }
    if (found.size() != step.in.size() || found.size() > step.fused_load.size()) return;
    run_->samples = step.stage->OfSamples(static_cast<int>(count));
    run_->sample_loads = std::move(found);
  }

  // Linear scan: a plane dies after its last reader, and that reader's results may take its place.
  void AssignPlanes() {
    constexpr int kForever = std::numeric_limits<int>::max();
    std::vector<int> last(Z(next_), -1);
    for (size_t n = 0; n < run_->items.size(); ++n) {
      if (run_->items[n].is_load) continue;
      for (const auto& in : run_->steps[Z(run_->items[n].index)].in) {
        for (const PlaneId p : in) last[Z(p)] = static_cast<int>(n);
      }
    }
    for (const PlaneId p : run_->result) last[Z(p)] = kForever;

    std::vector<PlaneId> physical(Z(next_), -1), free;
    for (PlaneId p = 0; p < kFirstFreePlane; ++p) physical[Z(p)] = p;
    const auto take = [&](PlaneId p) {
      if (p < kFirstFreePlane) return p;
      if (last[Z(p)] < 0) return kDummyPlane;  // nobody reads it
      if (free.empty()) free.push_back(run_->planes++);
      physical[Z(p)] = free.back();
      free.pop_back();
      return physical[Z(p)];
    };
    for (size_t n = 0; n < run_->items.size(); ++n) {
      const PointRun::Item& item = run_->items[n];
      if (item.is_load) {
        PlaneLoad& load = run_->loads[Z(item.index)];
        for (int p = 0; p < 4; ++p) {
          if (load.channel[p] >= 0) load.plane[p] = take(load.plane[p]);
        }
        continue;
      }
      PointStep& step = run_->steps[Z(item.index)];
      // Backwards, so that a result gets the place of the first input's same channel where that one dies.
      for (size_t k = step.in.size(); k-- > 0;) {
        for (size_t c = 4; c-- > 0;) {
          PlaneId& p = step.in[k][c];
          const bool dies = p >= kFirstFreePlane && last[Z(p)] == static_cast<int>(n);
          const PlaneId old = p;
          p = physical[Z(old)];
          if (dies) {
            free.push_back(p);
            last[Z(old)] = static_cast<int>(n) - 1;  // freed once, however often it is an input
          }
        }
      }
      for (PlaneId& p : step.out) p = take(p);
    }
    for (PlaneId& p : run_->result) p = physical[Z(p)];
  }

  class ConstantStage final : public PointStage {
   public:
    explicit ConstantStage(float value) : value_(value) {}
    void Run(const PointArgs& a) const override { std::fill_n(a.out[0], a.count, value_); }

   private:
    float value_;
  };

  const PlannedGraph& graph_;
  const int root_;
  std::unique_ptr<PointRun> run_ = std::make_unique<PointRun>();
  std::map<std::pair<int, int>, PlaneId> planes_;
  std::map<PlaneId, float> constants_ = {{kZeroPlane, 0.0f}, {kOnePlane, 1.0f}};
  PlaneId next_ = kFirstFreePlane;
};

}  // namespace

std::vector<bool> NeededOfInput(const PlannedGraph& graph, int i, int k) {
  const NodeData& d = *graph.nodes[Z(i)].data();
  const ImageSpec& in = d.inputs[Z(k)].spec();
  const std::vector<bool>& needed = graph.needed[Z(i)];
  std::vector<bool> result(in.channels.size(), false);
  std::vector<ImageSpec> specs;
  switch (d.op->Kind()) {
    case OpKind::kSource:
    case OpKind::kWhole:
      break;
    case OpKind::kTile:
      return d.op->NeededChannels(k, needed, in);
    case OpKind::kShuffle: {
      for (const Node& input : d.inputs) specs.push_back(input.spec());
      const std::vector<ChannelRef> map = d.op->ChannelMap(specs);
      for (size_t c = 0; c < needed.size(); ++c) {
        if (needed[c] && map[c].input == k) result[Z(map[c].channel)] = true;
      }
      break;
    }
    case OpKind::kCrop:
      return needed;
    case OpKind::kChannel:
      if (in.channel_count() == 1) return {true};
      for (size_t c = 0; c < needed.size(); ++c) result[c] = needed[c];
      break;
    case OpKind::kColor: {
      const int alpha_out = AlphaOut(*d.op, in, d.spec);
      bool color = false, alpha = false;
      for (int c = 0; c < d.spec.channel_count(); ++c) {
        if (!needed[Z(c)]) continue;
        if (c < 3 || (c == alpha_out && d.op->WritesAlpha())) {
          color = true;
        } else if (c == alpha_out) {
          alpha = true;
        } else if (k == 0 && PassedFrom(in, d.spec, c) >= 0) {
          result[Z(PassedFrom(in, d.spec, c))] = true;
        }
      }
      if (color) result[0] = result[1] = result[2] = true;
      if (in.alpha >= 0 && (alpha || (color && d.op->ReadsAlpha()))) result[Z(in.alpha)] = true;
      break;
    }
  }
  return result;
}

std::unique_ptr<PointRun> BuildRun(const PlannedGraph& graph, int root, const std::vector<int>& channels,
                                   Prepass& prepass, std::vector<std::string>& prepasses) {
  RunBuilder builder(graph, root);
  builder.Emit(prepass, prepasses);
  return builder.Finish(channels);
}

std::unique_ptr<PointRun> BuildCopyRun(const PlannedGraph& graph, int node,
                                       const std::vector<int>& channels) {
  return RunBuilder(graph, node).Finish(channels);
}

}  // namespace tessera::graph
