// --max-memory for several frames that are under way at once.
#ifndef TESSERA_CLI_MEMORY_GATE_H_
#define TESSERA_CLI_MEMORY_GATE_H_

#include <mutex>
#include <shared_mutex>
#include <vector>

#include "tessera/node.h"
#include "tessera/render.h"

namespace tessera::cli {

// Each of `frames` evaluations takes its share of a stated budget. One that would be computed by another
// method within its share, and so with other bits, is given the whole budget, alone.
class MemoryGate {
 public:
  explicit MemoryGate(int frames) : frames_(frames) {}

  // While one lives, an evaluation of the images may take render.memory_budget, which is changed to what it
  // has.
  class Share {
   public:
    Share(MemoryGate& gate, const std::vector<Node>& images, RenderOptions& render);

   private:
    std::shared_lock<std::shared_mutex> shared_;
    std::unique_lock<std::shared_mutex> alone_;
  };

 private:
  int frames_;
  std::shared_mutex mutex_;
};

}  // namespace tessera::cli

#endif  // TESSERA_CLI_MEMORY_GATE_H_
