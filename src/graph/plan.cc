// Planning: which channels are needed, which results must be resident, and the runs between them.
#include "graph/plan.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "base/border.h"
#include "graph/run_builder.h"
#include "graph/topology.h"

namespace tessera::graph {
namespace {

// A crop that reaches beyond its input: pixels out there are zero.
class GrowStage final : public TileStage {
 public:
  Roi InputRoi(int, const Roi& out) const override { return out; }
  Wrap InputBorder(int) const override { return Wrap::kBlack; }
  bool Accepts(PixelType) const override { return true; }
  void Run(const TileArgs& args) const override {
    const Roi& roi = args.out.roi;
    for (int y = roi.y0; y < roi.y1; ++y) {
      std::memcpy(args.out.At(roi.x0, y), args.in[0].At(roi.x0, y),
                  static_cast<size_t>(args.out.pixel_stride) * static_cast<size_t>(roi.width()));
    }
  }
};

class Planner {
 public:
  Planner(const Node& root, Prepass& prepass) : prepass_(prepass) {
    const auto follow = [](const NodeData& d, int k) { return !d.op->NeedsWhole(k); };
    graph_.nodes = TopologicalOrder(root, follow);
    for (size_t i = 0; i < graph_.nodes.size(); ++i) index_[graph_.nodes[i].data()] = static_cast<int>(i);
    for (const Node& node : graph_.nodes) {
      const NodeData& d = *node.data();
      std::vector<int>& in = graph_.inputs.emplace_back();
      for (size_t k = 0; k < d.inputs.size(); ++k) {
        in.push_back(follow(d, static_cast<int>(k)) ? index_.at(d.inputs[k].data()) : -1);
      }
    }
    FindNeededChannels();
    FindOwners();
  }

  void Fill(Plan& plan) {
    const int count = static_cast<int>(graph_.nodes.size());
    graph_.pixels.assign(Z(count), -1);
    graph_.first.assign(Z(count), 0);
    for (int i = 0; i < count; ++i) {
      if (Kind(i) == OpKind::kSource) AddSource(plan, i);
    }
    for (int i = 0; i < count; ++i) {
      if (!resident_[Z(i)]) continue;
      Buffer buffer{Data(i).spec.data_window, ChannelsOf(graph_.needed[Z(i)]), nullptr, {}};
      if (IsTile(i)) {
        buffer.tile = MakeTileStep(plan, i);
        buffer.tile->channels = buffer.channels;
      } else {
        buffer.points = BuildPoints(graph_, i, buffer.channels, prepass_, plan);
      }
      const BufferId made = Add(plan, std::move(buffer));
      if (graph_.pixels[Z(i)] < 0) graph_.pixels[Z(i)] = made;  // sources are read again
      made_[i] = made;
    }
    // The sink is fed by points; a window's tile gets some that only store.
    if (const int root = count - 1; IsTile(root)) AddCopy(plan, root, plan.buffers.back().channels);
  }

 private:
  const NodeData& Data(int i) const { return *graph_.nodes[Z(i)].data(); }
  OpKind Kind(int i) const { return Data(i).op->Kind(); }
  bool Grows(int i) const {
    return Kind(i) == OpKind::kCrop &&
           !Data(graph_.inputs[Z(i)][0]).spec.data_window.Contains(Data(i).spec.data_window);
  }
  bool IsTile(int i) const { return Kind(i) == OpKind::kTile || Grows(i); }

  void FindNeededChannels() {
    for (const Node& node : graph_.nodes) graph_.needed.emplace_back(node.spec().channels.size(), false);
    graph_.needed.back().assign(graph_.needed.back().size(), true);
    for (int i = static_cast<int>(graph_.nodes.size()) - 1; i >= 0; --i) {
      for (size_t k = 0; k < graph_.inputs[Z(i)].size(); ++k) {
        const int input = graph_.inputs[Z(i)][k];
        if (input < 0) continue;
        const std::vector<bool> needs = NeededOfInput(graph_, i, static_cast<int>(k));
        for (size_t c = 0; c < needs.size(); ++c) {
          if (needs[c]) graph_.needed[Z(input)][c] = true;
        }
      }
    }
  }

  // A point node belongs to the run of the one resident node that uses it; used by two runs it becomes
  // resident itself, so that it is computed once. Sources are simply read again.
  void FindOwners() {
    const size_t count = graph_.nodes.size();
    std::vector<std::set<int>> users(count);
    resident_.assign(count, false);
    graph_.owner.assign(count, -1);
    resident_[count - 1] = true;
    for (int i = static_cast<int>(count) - 1; i >= 0; --i) {
      if (IsTile(i)) {
        resident_[Z(i)] = true;
        for (const int input : graph_.inputs[Z(i)]) {
          if (input >= 0) resident_[Z(input)] = true;
        }
        continue;
      }
      if (users[Z(i)].size() > 1 && Kind(i) != OpKind::kSource) resident_[Z(i)] = true;
      graph_.owner[Z(i)] = resident_[Z(i)] || users[Z(i)].empty() ? i : *users[Z(i)].begin();
      for (const int input : graph_.inputs[Z(i)]) {
        if (input >= 0) users[Z(input)].insert(graph_.owner[Z(i)]);
      }
    }
  }

  void AddSource(Plan& plan, int i) {
    const auto& op = static_cast<const SourceOp&>(*Data(i).op);
    PlannedSource s{&op.source(), graph_.nodes[Z(i)], graph_.needed[Z(i)], 0, 0};
    const auto first = std::find(s.needed.begin(), s.needed.end(), true);
    const auto last = std::find(s.needed.rbegin(), s.needed.rend(), true);
    if (op.source().View()) {
      s.last = static_cast<int>(s.needed.size());
    } else if (first != s.needed.end()) {
      s.first = static_cast<int>(first - s.needed.begin());
      s.last = static_cast<int>(s.needed.rend() - last);
    }
    graph_.pixels[Z(i)] = static_cast<BufferId>(plan.sources.size());
    graph_.first[Z(i)] = s.first;
    plan.sources.push_back(std::move(s));
  }

  static std::vector<int> ChannelsOf(const std::vector<bool>& needed) {
    std::vector<int> channels;
    for (size_t c = 0; c < needed.size(); ++c) {
      if (needed[c]) channels.push_back(static_cast<int>(c));
    }
    return channels;
  }

  static BufferId Add(Plan& plan, Buffer buffer) {
    plan.buffers.push_back(std::move(buffer));
    return plan.result();
  }
  BufferId AddCopy(Plan& plan, int node, const std::vector<int>& channels) {
    return Add(plan, {Data(node).spec.data_window, channels, nullptr, BuildCopy(graph_, node, channels)});
  }

  // The buffer that holds just these channels of a resident node: others may have asked for more of them.
  BufferId BufferOf(Plan& plan, int node, const std::vector<int>& channels) {
    const BufferId whole = made_.at(node);
    if (plan.buffer(whole).channels == channels) return whole;
    const auto [it, fresh] = parts_.try_emplace({node, channels}, -1);
    if (fresh) it->second = AddCopy(plan, node, channels);
    return it->second;
  }

  std::unique_ptr<TileStep> MakeTileStep(Plan& plan, int i) {
    auto step = std::make_unique<TileStep>();
    step->label = Data(i).op->Describe();
    for (size_t k = 0; k < Data(i).inputs.size(); ++k) {
      const Node& input = Data(i).inputs[k];
      TileStep::Input in;
      in.window = input.spec().data_window;
      if (graph_.inputs[Z(i)][k] >= 0) {
        in.channels = ChannelsOf(NeededOfInput(graph_, i, static_cast<int>(k)));
        in.buffer = BufferOf(plan, graph_.inputs[Z(i)][k], in.channels);
      } else {
        in.whole = prepass_.Whole(input);
        in.channels.resize(input.spec().channels.size());
        std::iota(in.channels.begin(), in.channels.end(), 0);
      }
      step->in.push_back(in);
    }
    if (Grows(i)) {
      step->stage = std::make_unique<GrowStage>();
    } else {
      const StageContexts context(Data(i), prepass_, &plan.prepasses);
      step->stage = Data(i).op->MakeTileStage(context.For({-1, -1, -1, -1}));
    }
    return step;
  }

  Prepass& prepass_;
  PlannedGraph graph_;
  std::unordered_map<const NodeData*, int> index_;
  std::vector<bool> resident_;
  std::map<int, BufferId> made_;                                // by node
  std::map<std::pair<int, std::vector<int>>, BufferId> parts_;  // of nodes' channels
};

}  // namespace

StageContexts::StageContexts(const NodeData& data, Prepass& prepass, std::vector<std::string>* prepasses)
    : data_(data), workers_(prepass.workers()) {
  for (size_t k = 0; k < data.inputs.size(); ++k) {
    const int input = static_cast<int>(k);
    specs_.push_back(data.inputs[k].spec());
    const bool whole = data.op->Kind() == OpKind::kWhole || data.op->NeedsWhole(input);
    whole_.push_back(whole ? prepass.Whole(data.inputs[k]) : ConstImageView());
    if (whole && prepasses != nullptr) {
      prepasses->push_back("all of input " + std::to_string(input) + " of " + data.op->Name());
    }
  }
}

StageContext StageContexts::For(const std::array<int, 4>& channels) const {
  return {specs_, data_.spec, {channels[0], channels[1], channels[2], channels[3]}, whole_, workers_};
}

Plan MakePlan(const Node& root, int operations, Prepass& prepass) {
  Plan plan;
  plan.spec = root.spec();
  plan.operations = operations;
  plan.root = root;
  Planner(plan.root, prepass).Fill(plan);
  return plan;
}

void FindRequiredRegions(const Plan& plan, const Roi& out, std::vector<Roi>& regions) {
  regions.assign(Z(plan.result()) + 1, Roi());
  regions.back() = out;
  for (BufferId id = plan.result(); !plan.IsSource(id) && id >= 0; --id) {
    const Buffer& buffer = plan.buffer(id);
    const Roi region = regions[Z(id)];
    const auto want = [&](BufferId from, const Roi& r) { regions[Z(from)] = Union(regions[Z(from)], r); };
    if (!buffer.tile) {
      for (const BlockOp& op : buffer.points.ops) {
        if (const auto* const load = std::get_if<LoadOp>(&op)) want(load->from, region);
      }
      continue;
    }
    const TileStage& stage = *buffer.tile->stage;
    for (size_t k = 0; k < buffer.tile->in.size() && !region.empty(); ++k) {
      const TileStep::Input& in = buffer.tile->in[k];
      const int n = static_cast<int>(k);
      if (in.buffer >= 0)
        want(in.buffer, base::BorderSource(stage.InputRoi(n, region), in.window, stage.InputBorder(n)));
    }
  }
}

}  // namespace tessera::graph
