// Binding: the plan with its layouts as plain steps, rewritten by the rules, planes given their places.
#include "graph/program.h"

#include <algorithm>
#include <limits>

#include "graph/rules.h"

namespace tessera::graph {
namespace {

// Linear scan: a plane dies after its last reader, and that reader's results may take its place.
void AssignPlanes(Points& points) {
  constexpr int kForever = std::numeric_limits<int>::max();
  std::vector<int> last(Z(points.planes), -1);
  for (size_t n = 0; n < points.ops.size(); ++n) {
    const auto* const op = std::get_if<ComputeOp>(&points.ops[n]);
    if (op == nullptr) continue;
    for (size_t k = 0; k < op->in.size(); ++k) {
      if (op->IsDirect(k)) continue;
      for (const PlaneId p : op->in[k]) last[Z(p)] = static_cast<int>(n);
    }
  }
  for (const PlaneId p : points.result) last[Z(p)] = kForever;

  std::vector<PlaneId> place(Z(points.planes), kDummyPlane), free;
  for (PlaneId p = 0; p < kFirstFreePlane; ++p) place[Z(p)] = p;
  int places = kFirstFreePlane;
  for (ConstantPlane& constant : points.constants) {  // filled once, for good
    last[Z(constant.plane)] = kForever;
    constant.plane = place[Z(constant.plane)] = places++;
  }
  const auto take = [&](PlaneId p) {
    if (p < kFirstFreePlane) return p;
    if (last[Z(p)] < 0) return kDummyPlane;  // nobody reads it
    if (free.empty()) free.push_back(places++);
    place[Z(p)] = free.back();
    free.pop_back();
    return place[Z(p)];
  };
  for (size_t n = 0; n < points.ops.size(); ++n) {
    if (auto* const load = std::get_if<LoadOp>(&points.ops[n])) {
      for (size_t p = 0; p < 4; ++p) {
        if (load->channel[p] >= 0) load->plane[p] = take(load->plane[p]);
      }
      continue;
    }
    auto& op = std::get<ComputeOp>(points.ops[n]);
    // Backwards, so that a result gets the place of the first input's same channel where that one dies.
    for (size_t k = op.in.size(); k-- > 0;) {
      for (size_t c = 4; c-- > 0;) {
        const PlaneId old = op.in[k][c];
        op.in[k][c] = place[Z(old)];
        if (old < kFirstFreePlane || last[Z(old)] != static_cast<int>(n)) continue;
        free.push_back(place[Z(old)]);
        last[Z(old)] = static_cast<int>(n) - 1;  // freed once, however often it is an input
      }
    }
    for (PlaneId& p : op.out) p = take(p);
  }
  for (PlaneId& p : points.result) p = place[Z(p)];
  points.planes = places;
}

Window WindowOf(const TileStep& step) {
  Window window;
  window.planned = &step;
  for (const TileStep::Input& in : step.in) window.in.push_back({in.buffer, in.buffer});
  return window;
}

// Steps whose pixels nobody reads: of a node of which all readers take parts.
void DropUnread(std::vector<Step>& steps) {
  std::vector<bool> read(Z(steps.back().made) + 1);
  read[Z(steps.back().made)] = true;
  for (size_t n = steps.size(); n-- > 0;) {
    if (!read[Z(steps[n].made)]) {
      steps.erase(steps.begin() + static_cast<ptrdiff_t>(n));
      continue;
    }
    for (const BufferId id : Readings(steps[n])) read[Z(id)] = true;
  }
}

}  // namespace

Layout Layout::Of(const ConstImageView& view) {
  Layout layout;
  layout.type = view.type;
  layout.channels = view.channels;
  layout.channel_stride = view.channel_stride;
  layout.pixel_stride = view.pixel_stride;
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(view.type));
  layout.aligned = reinterpret_cast<uintptr_t>(view.data) % PixelBytes(view.type) == 0 &&
                   view.channel_stride % bytes == 0 && view.pixel_stride % bytes == 0 &&
                   view.row_stride % bytes == 0;
  layout.ascending = view.row_stride >= view.pixel_stride * view.roi.width();
  return layout;
}

Layout Layout::Packed(PixelType type, int channels) {
  Layout layout;
  layout.type = type;
  layout.channels = channels;
  layout.channel_stride = static_cast<ptrdiff_t>(PixelBytes(type));
  layout.pixel_stride = layout.channel_stride * channels;
  return layout;
}

bool Layout::IsDense(PixelType of) const {
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  return type == of && aligned && channel_stride == bytes && pixel_stride == bytes * channels;
}

bool Layout::IsRgba() const {
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  return aligned && channel_stride == bytes && pixel_stride == 4 * bytes;
}

Program::Program(const Plan& plan, std::span<const Layout> sources, const Layout& result,
                 const RuleSet& rules)
    : plan_(&plan), layouts_(sources.begin(), sources.end()) {
  for (const Buffer& buffer : plan.buffers) {
    Step step;
    step.made = step.to = static_cast<BufferId>(layouts_.size());
    if (buffer.tile) {
      step.how = WindowOf(*buffer.tile);
    } else {
      step.how = buffer.points;
    }
    steps.push_back(std::move(step));
    layouts_.push_back(Layout::Packed(PixelType::kFloat, static_cast<int>(buffer.channels.size())));
  }
  layouts_.back() = result;
  DropUnread(steps);
  rules.Apply(*this);
  for (Step& step : steps) {
    if (auto* const points = std::get_if<Points>(&step.how)) AssignPlanes(*points);
  }
}

bool Program::IsOneWindow() const {
  if (steps.size() != 1) return false;
  const auto* const window = std::get_if<Window>(&steps[0].how);
  return window != nullptr && std::all_of(window->in.begin(), window->in.end(), [&](const Window::Input& in) {
           return in.pixels < 0 || IsSource(in.pixels);
         });
}

std::vector<int> Program::TilePlaces() const {
  std::vector<int> place(layouts_.size(), -1), free;
  std::vector<size_t> last(layouts_.size());
  for (size_t n = 0; n < steps.size(); ++n) {
    last[Z(steps[n].to)] = n;
    for (const BufferId id : Readings(steps[n])) last[Z(id)] = n;
  }
  int places = 0;
  for (size_t n = 0; n < steps.size(); ++n) {
    const BufferId to = steps[n].to;
    if (to != result() && place[Z(to)] < 0) {
      if (free.empty()) free.push_back(places++);
      place[Z(to)] = free.back();
      free.pop_back();
    }
    // Not before its own result has a place: rows are read after others are written.
    const auto release = [&](BufferId id) {
      if (place[Z(id)] < 0 || last[Z(id)] != n) return;
      free.push_back(place[Z(id)]);
      last[Z(id)] = steps.size();  // freed once, however often it is read
    };
    for (const BufferId id : Readings(steps[n])) release(id);
    release(to);
  }
  return place;
}

std::vector<std::string> Program::AppliedRules() const {
  std::vector<std::string> names;
  for (const Step& step : steps) {
    for (const std::string& name : step.rules) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

BufferId OnlyCopies(const Program& program, const Step& step) {
  const auto* const points = std::get_if<Points>(&step.how);
  if (points == nullptr || points->result.empty()) return -1;
  BufferId from = -1;
  for (size_t c = 0; c < points->result.size(); ++c) {
    if (c / 4 >= points->ops.size()) return -1;
    const auto* const load = std::get_if<LoadOp>(&points->ops[c / 4]);
    if (load == nullptr || (c > 0 && load->from != from)) return -1;
    if (load->channel[c % 4] != static_cast<int>(c) || load->plane[c % 4] != points->result[c]) return -1;
    from = load->from;
  }
  const bool all = program.layout(from).channels == static_cast<int>(points->result.size()) &&
                   points->ops.size() == (points->result.size() + 3) / 4;
  return all ? from : -1;
}

std::vector<BufferId> Readings(const Step& step) {
  std::vector<BufferId> read;
  if (const auto* const points = std::get_if<Points>(&step.how)) {
    for (const BlockOp& op : points->ops) {
      if (const auto* const load = std::get_if<LoadOp>(&op)) {
        read.push_back(load->from);
      } else {
        const auto& direct = std::get<ComputeOp>(op).direct;
        read.insert(read.end(), direct.begin(), direct.end());
      }
    }
  } else if (const auto* const window = std::get_if<Window>(&step.how)) {
    for (const Window::Input& in : window->in) read.push_back(in.pixels);
  } else if (const auto* const samples = std::get_if<Samples>(&step.how)) {
    read = samples->in;
  } else {
    read = std::get<ByteMoves>(step.how).in;
  }
  read.erase(std::remove_if(read.begin(), read.end(), [](BufferId id) { return id < 0; }), read.end());
  return read;
}

std::vector<int> PlaneReaders(const Points& points) {
  std::vector<int> readers(Z(points.planes), 0);
  for (const BlockOp& op : points.ops) {
    const auto* const compute = std::get_if<ComputeOp>(&op);
    if (compute == nullptr) continue;
    for (const auto& in : compute->in) {
      for (const PlaneId p : in) ++readers[Z(p)];
    }
  }
  for (const PlaneId p : points.result) ++readers[Z(p)];
  return readers;
}

}  // namespace tessera::graph
