// Operations on whole images: before planning they become sources of their results.
#ifndef TESSERA_GRAPH_WHOLE_H_
#define TESSERA_GRAPH_WHOLE_H_

#include <functional>
#include <memory>

#include "graph/little_memory.h"
#include "graph/source.h"
#include "tessera/export.h"
#include "tessera/render.h"

TESSERA_API_BEGIN
namespace tessera::graph {

// `root`, or its inputs alone, with every kWhole node replaced by the source that compute(node) gives, inner
// nodes first: the inputs of the node it is called with hold no kWhole node.
Node ResolveWhole(const Node& root, bool with_root, const std::function<Node(const Node&)>& compute);

// The graph as it is computed within `budget` bytes: where its whole images do not fit, with
// methods that need none. `short_of_memory`: whether they do not fit.
Node WithinBudget(const Node& root, size_t budget, bool& short_of_memory);
// Whether a node is computed by the same methods, and so to the same bits, within another budget.
bool HasSameMethods(const Node& node, const RenderOptions& options, size_t other_budget);

// A source of the rows that a stage gives.
Node SourceOfRows(std::shared_ptr<const RowsStage> stage, const ImageSpec& spec, Context& context);

// Rows for a stage.
class RowsSink final : public RowSink {
 public:
  explicit RowsSink(RowsStage& stage) : stage_(stage) {}
  void Write(const ConstImageView& rows) override { stage_.Take(rows); }

 private:
  RowsStage& stage_;
};

ImageSpec AsFloats(ImageSpec spec);

}  // namespace tessera::graph
TESSERA_API_END

#endif  // TESSERA_GRAPH_WHOLE_H_
