/// Graphs that are asked for regions again and again, as by a viewer, or of whose sources only parts are
/// here, as on one of many machines. @file
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
  /// The pixels of a source (made by FromImage, FromView, FromPart or Read) that RenderInto reads for the
  /// region `out` of the result, in the source's coordinates: the smallest rectangle with all of them,
  /// borders considered; empty for none. Those read beforehand, whole, are not among them. Throws Error for a
  /// region beyond the result's, or where the graph does not read the source.
  Roi RequiredRegion(const Node& source, const Roi& out) const;

 private:
  struct Kept;
  std::unique_ptr<Kept> kept_;
};

/// A node of an image of which only a part is in memory: `spec` is all of it, `part` covers a rectangle of
/// its data window, none maybe, and is borrowed as in FromView. What a graph on it makes has the bits of the
/// graph on the whole image. Where an evaluation needs pixels that are not there (see
/// PreparedGraph::RequiredRegion) it throws DataError, and so it does for an operation that needs the whole
/// image, naming it. Throws Error for a part that is none.
Node FromPart(const ConstImageView& part, const ImageSpec& spec);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_PREPARED_GRAPH_H_
