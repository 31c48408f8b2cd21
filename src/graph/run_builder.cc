// The run builder: channels become planes, which are numbered freely.
#include "graph/run_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace tessera::graph {
namespace {

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

  void Emit(Prepass& prepass, Plan& plan) {
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
          ChannelOp(i, StageContexts(Data(i), prepass, &plan.prepasses), plan);
          break;
        case OpKind::kColor:
          ColorOp(i, StageContexts(Data(i), prepass, &plan.prepasses), plan);
          break;
      }
    }
  }

  Points Finish(const std::vector<int>& channels) {
    for (const int c : channels) points_.result.push_back(Plane(root_, c));
    return std::move(points_);
  }

 private:
  const NodeData& Data(int i) const { return *graph_.nodes[Z(i)].data(); }
  int Channels(int i) const { return Data(i).spec.channel_count(); }

  PlaneId NewPlane() { return points_.planes++; }

  // The plane that holds a channel of a node; loads it when it is not of this run's making.
  PlaneId Plane(int node, int c) {
    const auto it = planes_.find({node, c});
    if (it != planes_.end()) return it->second;
    LoadOp load{graph_.pixels[Z(node)]};
    const bool is_source = Data(node).op->Kind() == OpKind::kSource;
    // A tile has the needed channels only, a source those of the range that it is read of.
    int held = is_source ? -graph_.first[Z(node)] : 0;
    for (int k = 0; k < Channels(node); ++k) {
      const bool is_needed = graph_.needed[Z(node)][Z(k)];
      if (is_needed && k / 4 == c / 4) {
        load.channel[Z(k % 4)] = held;
        load.plane[Z(k % 4)] = planes_[{node, k}] = NewPlane();
      }
      held += is_source || is_needed;
    }
    points_.ops.emplace_back(load);
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
    points_.constants.push_back({NewPlane(), value});
    return points_.constants.back().plane;
  }

  void ChannelOp(int i, const StageContexts& context, Plan& plan) {
    const std::vector<ImageSpec> specs = InputSpecs(i);
    for (int base = 0; base < Channels(i); base += 4) {
      ComputeOp step;
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
          const int input = graph_.inputs[Z(i)][k];
          if (input < 0) continue;
          if (specs[k].channel_count() > 1) {
            step.in[k][Z(p)] = Plane(input, c);
          } else {  // for every channel, whichever are wanted
            step.in[k].fill(Plane(input, 0));
          }
        }
        step.out[Z(p)] = planes_[{i, c}] = NewPlane();
      }
      if (!any) continue;
      AddStep(std::move(step), i, context.For(channels), plan);
    }
  }

  void ColorOp(int i, const StageContexts& context, Plan& plan) {
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
    ComputeOp step;
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
    AddStep(std::move(step), i, context.For({0, 1, 2, alpha_out}), plan);
  }

  std::vector<ImageSpec> InputSpecs(int i) const {
    std::vector<ImageSpec> specs;
    for (const Node& input : Data(i).inputs) specs.push_back(input.spec());
    return specs;
  }

  void AddStep(ComputeOp step, int i, const StageContext& context, Plan& plan) {
    plan.stages.push_back(Data(i).op->MakePointStage(context));
    step.stage = plan.stages.back().get();
    step.label = Data(i).op->Describe();
    points_.ops.emplace_back(std::move(step));
  }

  const PlannedGraph& graph_;
  const int root_;
  Points points_;
  std::map<std::pair<int, int>, PlaneId> planes_;  // of node and channel
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

Points BuildPoints(const PlannedGraph& graph, int root, const std::vector<int>& channels, Prepass& prepass,
                   Plan& plan) {
  RunBuilder builder(graph, root);
  builder.Emit(prepass, plan);
  return builder.Finish(channels);
}

Points BuildCopy(const PlannedGraph& graph, int node, const std::vector<int>& channels) {
  return RunBuilder(graph, node).Finish(channels);
}

}  // namespace tessera::graph
