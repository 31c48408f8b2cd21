// Shares of memory that leave the bits as they are.
#include "cli/memory_gate.h"

#include <algorithm>

#include "graph/whole.h"

namespace tessera::cli {

MemoryGate::Share::Share(MemoryGate& gate, const std::vector<Node>& images, RenderOptions& render) {
  const size_t unstated = RenderOptions().memory_budget;
  if (gate.frames_ < 2 || render.memory_budget == unstated) return;
  size_t share = render.memory_budget / static_cast<size_t>(gate.frames_);
  if (share == unstated) --share;  // which would be taken for none
  if (std::all_of(images.begin(), images.end(),
                  [&](const Node& image) { return graph::HasSameMethods(image, render, share); })) {
    shared_ = std::shared_lock(gate.mutex_);
    render.memory_budget = share;
  } else {
    alone_ = std::unique_lock(gate.mutex_);
  }
}

}  // namespace tessera::cli
