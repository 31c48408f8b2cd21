/// Graphs that are asked for regions again and again, as by a viewer. @file
#ifndef TESSERA_PREPARED_GRAPH_H_
#define TESSERA_PREPARED_GRAPH_H_

#include <functional>
#include <memory>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/render.h"

TESSERA_API_BEGIN
namespace tessera {

/// A graph made ready to be asked for regions again and again: what it needs to know of whole images is
/// computed once and kept, and so is the plan for every layout of results that it has been asked for. The
/// sources' pixels must not change. Several threads may ask at once.
class PreparedGraph {
 public:
  /// Computes what regions will need beforehand. Throws Error or Cancelled.
  explicit PreparedGraph(const Node& node, const RenderOptions& options = {}, RunStats* stats = nullptr);
  ~PreparedGraph();
  PreparedGraph(const PreparedGraph&) = delete;
  PreparedGraph& operator=(const PreparedGraph&) = delete;

  /// What the whole result is.
  const ImageSpec& spec() const;
  /// As tessera::RenderInto for the same graph and options, with the same bits. `progress` stands for theirs:
  /// it is called with the share done, never a smaller one, several times a second from the beginning on, by
  /// one thread at a time but not always by the caller's; false cancels.
  void RenderInto(const ImageView& out, const std::function<bool(double)>& progress = {}) const;

 private:
  struct Kept;
  std::unique_ptr<Kept> kept_;
};

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_PREPARED_GRAPH_H_
