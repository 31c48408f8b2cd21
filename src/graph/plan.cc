// Planning: which channels are needed, which results must be resident, and the runs between them.
#include "graph/plan.h"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "graph/border.h"
#include "graph/optimize.h"
#include "graph/run_builder.h"
#include "graph/topology.h"

namespace tessera::graph {
namespace {

// A crop that reaches beyond its input: pixels out there are zero.
class GrowStage final : public TileStage {
 public:
  Roi InputRoi(int, const Roi& out) const override { return out; }
  Border InputBorder(int) const override { return Border::kBlack; }
  void Run(std::span<const base::Tile* const> in, base::Tile& out, base::Arena&) const override {
    for (int c = 0; c < out.channels(); ++c) {
      for (int y = out.roi().y0; y < out.roi().y1; ++y) {
        const float* from = in[0]->Row(c, y) + (out.roi().x0 - in[0]->roi().x0);
        std::copy_n(from, out.roi().width(), out.Row(c, y));
      }
    }
  }
};

class Planner {
 public:
  Planner(const Node& root, const StatisticFunction& statistic) : statistic_(statistic) {
    graph_.nodes = TopologicalOrder(root);
    for (size_t i = 0; i < graph_.nodes.size(); ++i) index_[graph_.nodes[i].data()] = static_cast<int>(i);
    for (const Node& node : graph_.nodes) {
      std::vector<int>& in = graph_.inputs.emplace_back();
      for (const Node& input : node.data()->inputs) in.push_back(index_.at(input.data()));
    }
    FindNeededChannels();
    FindOwners();
  }

  void Fill(Plan& plan) {
    const int count = static_cast<int>(graph_.nodes.size());
    graph_.buffer.assign(static_cast<size_t>(count), -1);
    graph_.source.assign(static_cast<size_t>(count), -1);
    for (int i = 0; i < count; ++i) {
      if (Kind(i) == OpKind::kSource) AddSource(plan, i);
    }
    for (int i = 0; i < count; ++i) {
      if (!resident_[Z(i)]) continue;
      Buffer buffer;
      buffer.window = Data(i).spec.data_window;
      for (int c = 0; c < Data(i).spec.channel_count(); ++c) {
        if (graph_.needed[Z(i)][Z(c)]) buffer.channels.push_back(c);
      }
      if (IsTile(i)) {
        buffer.tile = MakeTileStep(plan, i);
      } else {
        buffer.run = BuildRun(graph_, i, buffer.channels, StatisticsOf(plan));
      }
      graph_.buffer[Z(i)] = static_cast<int>(plan.buffers.size());
      plan.buffers.push_back(std::move(buffer));
    }
    const int root = count - 1;
    if (IsTile(root)) {  // the sink is fed by a point run; a window's tile gets one that only stores
      Buffer last;
      last.window = plan.buffers.back().window;
      last.channels = plan.buffers.back().channels;
      last.run = BuildCopyRun(graph_, root, last.channels);
      plan.buffers.push_back(std::move(last));
    }
  }

 private:
  static size_t Z(int i) { return static_cast<size_t>(i); }
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
        const std::vector<bool> needs = NeededOfInput(graph_, i, static_cast<int>(k));
        for (size_t c = 0; c < needs.size(); ++c) {
          if (needs[c]) graph_.needed[Z(input)][c] = true;
        }
      }
    }
  }

  // A point node belongs to the run of the one resident node that uses it; used by two runs it becomes resident
  // itself, so that it is computed once. Sources are simply read again.
  void FindOwners() {
    const size_t count = graph_.nodes.size();
    std::vector<std::set<int>> users(count);
    resident_.assign(count, false);
    graph_.owner.assign(count, -1);
    resident_[count - 1] = true;
    for (int i = static_cast<int>(count) - 1; i >= 0; --i) {
      if (IsTile(i)) {
        resident_[Z(i)] = true;
        for (const int input : graph_.inputs[Z(i)]) resident_[Z(input)] = true;
        continue;
      }
      if (users[Z(i)].size() > 1 && Kind(i) != OpKind::kSource) resident_[Z(i)] = true;
      graph_.owner[Z(i)] = resident_[Z(i)] || users[Z(i)].empty() ? i : *users[Z(i)].begin();
      for (const int input : graph_.inputs[Z(i)]) users[Z(input)].insert(graph_.owner[Z(i)]);
    }
  }

  void AddSource(Plan& plan, int i) {
    const auto& op = static_cast<const SourceOp&>(*Data(i).op);
    PlannedSource s{&op.source(), graph_.nodes[Z(i)], graph_.needed[Z(i)], 0, 0};
    const auto first = std::find(s.needed.begin(), s.needed.end(), true);
    const auto last = std::find(s.needed.rbegin(), s.needed.rend(), true);
    if (first != s.needed.end()) {
      s.first = static_cast<int>(first - s.needed.begin());
      s.last = static_cast<int>(s.needed.rend() - last);
    }
    graph_.source[Z(i)] = static_cast<int>(plan.sources.size());
    plan.sources.push_back(std::move(s));
  }

  std::function<std::vector<double>(int)> StatisticsOf(Plan& plan) {
    return [this, &plan](int i) {
      std::vector<double> values;
      for (const StatisticRequest& r : Data(i).op->Statistics()) {
        values.push_back(statistic_(Data(i).inputs[Z(r.input)], r));
        plan.statistics.push_back("mean of input " + std::to_string(r.input) + " of " + Data(i).op->Name());
      }
      return values;
    };
  }

  std::unique_ptr<TileStep> MakeTileStep(Plan& plan, int i) {
    auto step = std::make_unique<TileStep>();
    step->label = Data(i).op->Describe();
    std::vector<ImageSpec> specs;
    for (const int input : graph_.inputs[Z(i)]) {
      step->in.push_back(graph_.buffer[Z(input)]);
      step->window.push_back(Data(input).spec.data_window);
      specs.push_back(Data(input).spec);
    }
    if (Grows(i)) {
      step->stage = std::make_unique<GrowStage>();
    } else {
      const std::vector<double> statistics = StatisticsOf(plan)(i);
      step->stage = Data(i).op->MakeTileStage({specs, Data(i).spec, {-1, -1, -1, -1}, statistics});
    }
    return step;
  }

  const StatisticFunction& statistic_;
  PlannedGraph graph_;
  std::unordered_map<const NodeData*, int> index_;
  std::vector<bool> resident_;
};

}  // namespace

Plan MakePlan(const Node& root, bool optimize, const StatisticFunction& statistic) {
  Plan plan;
  plan.spec = root.spec();
  for (const Node& node : TopologicalOrder(root)) plan.operations += node.data()->op->Kind() != OpKind::kSource;
  plan.root = optimize ? Optimize(root) : root;
  Planner(plan.root, statistic).Fill(plan);
  return plan;
}

Regions RequiredRegions(const Plan& plan, const Roi& out) {
  Regions r;
  r.buffers.resize(plan.buffers.size());
  r.sources.resize(plan.sources.size());
  r.buffers.back() = out;
  for (size_t i = plan.buffers.size(); i-- > 0;) {
    const Buffer& buffer = plan.buffers[i];
    if (buffer.run) {
      for (const PlaneLoad& load : buffer.run->loads) {
        const auto k = static_cast<size_t>(load.index);
        if (load.from_tile) {
          r.buffers[k] = Union(r.buffers[k], r.buffers[i]);
        } else {
          r.sources[k] = Union(r.sources[k], r.buffers[i]);
        }
      }
    } else {
      for (size_t k = 0; k < buffer.tile->in.size(); ++k) {
        const auto input = static_cast<size_t>(buffer.tile->in[k]);
        const int n = static_cast<int>(k);
        r.buffers[input] = Union(r.buffers[input], BorderSource(buffer.tile->stage->InputRoi(n, r.buffers[i]),
                                                                buffer.tile->window[k],
                                                                buffer.tile->stage->InputBorder(n)));
      }
    }
  }
  return r;
}

}  // namespace tessera::graph
