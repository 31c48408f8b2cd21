// The rewrites themselves: each looks at one step and the layouts of what it reads and writes.
#include <algorithm>
#include <array>

#include "graph/rules.h"

namespace tessera::graph {
namespace {

constexpr std::array<int, 4> kRgba = {0, 1, 2, 3};

Points* PointsAt(Program& program, size_t step) { return std::get_if<Points>(&program.steps[step].how); }

// Planes that nobody else reads.
bool AreReadOnce(const std::array<PlaneId, 4>& planes, const std::vector<int>& readers) {
  return std::all_of(planes.begin(), planes.end(),
                     [&](PlaneId p) { return p >= kFirstFreePlane && readers[static_cast<size_t>(p)] == 1; });
}

// The load of whole RGBA pixels whose planes are this input of an op and nobody else's; ops.size() for none.
size_t RgbaLoadOf(const Program& program, const Points& points, const ComputeOp& op, size_t input,
                  const std::vector<int>& readers) {
  size_t found = points.ops.size();
  if (op.IsDirect(input) || !AreReadOnce(op.in[input], readers)) return found;
  for (size_t n = 0; n < points.ops.size(); ++n) {
    const auto* const load = std::get_if<LoadOp>(&points.ops[n]);
    if (load != nullptr && load->plane == op.in[input] && load->channel == kRgba &&
        program.layout(load->from).IsRgba()) {
      found = n;
    }
  }
  return found;
}

// Whether this op's planes are the step's whole result, as RGBA pixels, and read by nobody else.
bool IsRgbaResult(const Program& program, const Step& step, const Points& points, const ComputeOp& op,
                  const std::vector<int>& readers) {
  return points.result.size() == 4 && program.layout(step.to).IsRgba() && AreReadOnce(op.out, readers) &&
         std::equal(op.out.begin(), op.out.end(), points.result.begin());
}

// Takes loads out of the list and lets the op read their pixels itself. The op's place in the list changes.
void ReadDirectly(Points& points, size_t op_index, const std::vector<size_t>& loads) {
  auto& op = std::get<ComputeOp>(points.ops[op_index]);
  for (size_t k = 0; k < loads.size(); ++k) op.direct[k] = std::get<LoadOp>(points.ops[loads[k]]).from;
  std::vector<size_t> gone = loads;
  std::sort(gone.rbegin(), gone.rend());
  for (const size_t n : gone) points.ops.erase(points.ops.begin() + static_cast<ptrdiff_t>(n));
}

// Every buffer a step reads is replaced.
void ReadInstead(Program& program, BufferId tile, BufferId pixels) {
  for (Step& step : program.steps) {
    if (auto* const points = std::get_if<Points>(&step.how)) {
      for (BlockOp& op : points->ops) {
        auto* const load = std::get_if<LoadOp>(&op);
        if (load != nullptr && load->from == tile) load->from = pixels;
      }
    } else if (auto* const window = std::get_if<Window>(&step.how)) {
      for (Window::Input& in : window->in) {
        if (in.pixels == tile) in.pixels = pixels;
      }
    }
  }
}

void Remove(Program& program, size_t step) {
  program.steps.erase(program.steps.begin() + static_cast<ptrdiff_t>(step));
}

size_t StepThatMakes(const Program& program, BufferId buffer) {
  const auto it = std::find_if(program.steps.begin(), program.steps.end(),
                               [&](const Step& step) { return step.made == buffer; });
  return static_cast<size_t>(it - program.steps.begin());
}

}  // namespace

// Pairs only: longer chains would not find their coefficients in registers.
bool JoinOps(Program& program, size_t step) {
  Points* const points = PointsAt(program, step);
  if (points == nullptr) return false;
  const std::vector<int> readers = PlaneReaders(*points);
  bool any = false;
  for (size_t n = 0; n + 1 < points->ops.size(); ++n) {
    auto* const first = std::get_if<ComputeOp>(&points->ops[n]);
    const auto* const next = std::get_if<ComputeOp>(&points->ops[n + 1]);
    if (first == nullptr || next == nullptr || next->in.size() != 1 || next->in[0] != first->out ||
        !AreReadOnce(first->out, readers)) {
      continue;
    }
    auto both = first->stage->Then(*next->stage);
    if (both == nullptr) continue;
    first->stage = both.get();
    first->out = next->out;
    first->label += ", " + next->label;
    program.stages.push_back(std::move(both));
    points->ops.erase(points->ops.begin() + static_cast<ptrdiff_t>(n) + 1);
    any = true;
  }
  return any;
}

// The list must be: copies of sources into tiles, the tile stage that reads them, the store of its tile.
bool WindowOfSamples(Program& program, size_t step) {
  auto* const window = std::get_if<Window>(&program.steps[step].how);
  const Layout& result = program.layout(program.result());
  if (window == nullptr || step + 2 != program.steps.size() || result.type == PixelType::kFloat ||
      !result.IsDense(result.type) || !window->planned->stage->Accepts(result.type) ||
      OnlyCopies(program, program.steps.back()) != program.steps[step].to) {
    return false;
  }
  std::vector<BufferId> sources;
  for (const Window::Input& in : window->in) {
    if (in.pixels < 0 || program.IsSource(in.pixels)) return false;
    const BufferId from = OnlyCopies(program, program.steps[StepThatMakes(program, in.pixels)]);
    if (from < 0 || !program.IsSource(from) || !program.layout(from).IsDense(result.type) ||
        !program.layout(from).ascending) {
      return false;
    }
    sources.push_back(from);
  }
  for (size_t k = 0; k < step; ++k) {  // nothing else is computed
    const bool is_read = std::any_of(window->in.begin(), window->in.end(), [&](const Window::Input& in) {
      return in.pixels == program.steps[k].made;
    });
    if (!is_read) return false;
  }
  for (size_t k = 0; k < sources.size(); ++k) window->in[k].pixels = sources[k];
  window->type = result.type;
  Step alone = std::move(program.steps[step]);
  alone.to = program.result();
  program.steps.clear();
  program.steps.push_back(std::move(alone));
  return true;
}

bool SourceAsTile(Program& program, size_t step) {
  const BufferId from = OnlyCopies(program, program.steps[step]);
  if (from < 0 || !program.IsSource(from) || program.steps[step].to == program.result() ||
      !program.layout(from).IsDense(PixelType::kFloat) || !program.layout(from).ascending) {
    return false;
  }
  ReadInstead(program, program.steps[step].made, from);
  Remove(program, step);
  return true;
}

bool TileInResult(Program& program, size_t step) {
  const BufferId tile = OnlyCopies(program, program.steps[step]);
  if (tile < 0 || program.IsSource(tile) || program.steps[step].to != program.result() ||
      !program.layout(program.result()).IsDense(PixelType::kFloat)) {
    return false;
  }
  const size_t maker = StepThatMakes(program, tile);
  if (maker + 1 != step || !std::holds_alternative<Window>(program.steps[maker].how)) return false;
  program.steps[maker].to = program.result();
  Remove(program, step);
  return true;
}

bool AsSamples(Program& program, size_t step) {
  Points* const points = PointsAt(program, step);
  if (points == nullptr) return false;
  const Layout& result = program.layout(program.steps[step].to);
  const size_t count = points->result.size();
  const auto is_fit = [&](const Layout& layout) {
    return layout.IsDense(result.type) && layout.channels == static_cast<int>(count);
  };
  const auto is_op = [](const BlockOp& op) { return std::holds_alternative<ComputeOp>(op); };
  if (count == 0 || count > 4 || !is_fit(result) ||
      std::count_if(points->ops.begin(), points->ops.end(), is_op) != 1) {
    return false;
  }
  const auto& op = std::get<ComputeOp>(*std::find_if(points->ops.begin(), points->ops.end(), is_op));
  if (!std::equal(points->result.begin(), points->result.end(), op.out.begin())) return false;
  Samples samples;
  for (const auto& in : op.in) {
    for (const BlockOp& other : points->ops) {
      const auto* const load = std::get_if<LoadOp>(&other);
      if (load == nullptr || !is_fit(program.layout(load->from)) ||
          !std::equal(in.begin(), in.begin() + static_cast<ptrdiff_t>(count), load->plane.begin()) ||
          !std::equal(kRgba.begin(), kRgba.begin() + static_cast<ptrdiff_t>(count), load->channel.begin())) {
        continue;
      }
      samples.in.push_back(load->from);
      break;
    }
  }
  if (samples.in.empty() || samples.in.size() != op.in.size() || samples.in.size() > ComputeOp::kMostDirect) {
    return false;
  }
  auto stage = op.stage->OfSamples(static_cast<int>(count));
  if (stage == nullptr || !stage->AnyLength()) return false;
  const bool fits = samples.in.size() == 1
                        ? stage->CanFuse(true, result.type) && stage->CanFuse(false, result.type)
                        : stage->CanFuseAll(result.type);
  if (!fits) return false;
  samples.stage = stage.get();
  samples.label = op.label;
  program.stages.push_back(std::move(stage));
  program.steps[step].how = std::move(samples);
  return true;
}

bool AllInOp(Program& program, size_t step) {
  Points* const points = PointsAt(program, step);
  if (points == nullptr) return false;
  const PixelType type = program.layout(program.steps[step].to).type;
  const std::vector<int> readers = PlaneReaders(*points);
  for (size_t n = 0; n < points->ops.size(); ++n) {
    auto* const op = std::get_if<ComputeOp>(&points->ops[n]);
    if (op == nullptr || op->in.size() < 2 || op->in.size() > ComputeOp::kMostDirect ||
        !op->stage->CanFuseAll(type) || !IsRgbaResult(program, program.steps[step], *points, *op, readers)) {
      continue;
    }
    std::vector<size_t> loads;
    for (size_t k = 0; k < op->in.size(); ++k) {
      const size_t load = RgbaLoadOf(program, *points, *op, k, readers);
      if (load == points->ops.size() ||
          program.layout(std::get<LoadOp>(points->ops[load]).from).type != type) {
        break;
      }
      loads.push_back(load);
    }
    if (loads.size() != op->in.size()) continue;
    op->to_result = true;
    points->result.clear();
    ReadDirectly(*points, n, loads);
    return true;
  }
  return false;
}

bool LoadInOp(Program& program, size_t step) {
  Points* const points = PointsAt(program, step);
  if (points == nullptr) return false;
  bool any = false;
  for (size_t n = 0; n < points->ops.size(); ++n) {
    const auto* const op = std::get_if<ComputeOp>(&points->ops[n]);
    if (op == nullptr || op->in.empty()) continue;
    const size_t load = RgbaLoadOf(program, *points, *op, 0, PlaneReaders(*points));
    if (load == points->ops.size()) continue;
    if (!op->stage->CanFuse(true, program.layout(std::get<LoadOp>(points->ops[load]).from).type)) continue;
    ReadDirectly(*points, n, {load});
    --n;  // the load stood before
    any = true;
  }
  return any;
}

bool StoreInOp(Program& program, size_t step) {
  Points* const points = PointsAt(program, step);
  if (points == nullptr) return false;
  const std::vector<int> readers = PlaneReaders(*points);
  for (BlockOp& each : points->ops) {
    auto* const op = std::get_if<ComputeOp>(&each);
    if (op == nullptr || op->to_result ||
        !op->stage->CanFuse(false, program.layout(program.steps[step].to).type) ||
        !IsRgbaResult(program, program.steps[step], *points, *op, readers)) {
      continue;
    }
    op->to_result = true;
    points->result.clear();
    return true;
  }
  return false;
}

bool WholeRows(Program& program, size_t step) {
  Points* const points = PointsAt(program, step);
  if (points == nullptr || points->ops.size() != 1) return false;
  const auto* const op = std::get_if<ComputeOp>(&points->ops[0]);
  if (op == nullptr || !op->to_result || op->in.empty() || !op->stage->AnyLength()) return false;
  for (size_t k = 0; k < op->in.size(); ++k) {
    if (!op->IsDirect(k)) return false;
  }
  points->whole_rows = true;
  return true;
}

bool OnCodes(Program& program, size_t step) {
  const PixelType type = program.layout(program.steps[step].to).type;
  if (type != PixelType::kUint8 && type != PixelType::kUint16) return false;
  if (auto* const samples = std::get_if<Samples>(&program.steps[step].how)) {
    return samples->codes = samples->stage->UsesCodes();
  }
  Points* const points = PointsAt(program, step);
  if (points == nullptr || points->ops.size() != 1) return false;
  auto* const op = std::get_if<ComputeOp>(&points->ops[0]);
  if (op == nullptr || !op->stage->UsesCodes() || !op->to_result || op->in.size() != 1 || !op->IsDirect(0) ||
      program.layout(op->direct[0]).type != type) {
    return false;
  }
  return op->codes = true;
}

}  // namespace tessera::graph
