// What an operation on whole images can do without, where memory is short.
#ifndef TESSERA_GRAPH_LITTLE_MEMORY_H_
#define TESSERA_GRAPH_LITTLE_MEMORY_H_

#include <memory>
#include <string>

#include "graph/op.h"
#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::graph {

// A whole operation on one input that takes it row by row and gives its result row by row, so that neither is
// in memory. One evaluation's own.
class RowsStage {
 public:
  virtual ~RowsStage() = default;
  // Full rows from the top to the bottom, float, interleaved and dense.
  virtual void Take(const ConstImageView& rows) = 0;
  // After the last. False where these pixels have to be seen whole after all, by the WholeStage.
  virtual bool End(const Workers& workers) = 0;
  // Full rows of the result, of the same layout.
  virtual void Give(const ImageView& rows) const = 0;
};

// A base, beside Op, of operations that are asked where whole images do not fit into the memory budget, or
// that do better without at any size.
class LittleMemory {
 public:
  virtual ~LittleMemory() = default;
  // With the same bits in place of the whole stage; null: none.
  virtual std::unique_ptr<RowsStage> MakeRowsStage(const ImageSpec& input, Context& context) const {
    (void)input, (void)context;
    return nullptr;
  }
  // Whether that stage is the better one at any size; the result is small and in memory all the same.
  virtual bool PrefersRows() const { return false; }
  // The same operation within the same bound by a method that needs no whole image, where the method was left
  // to the library; null: as it is.
  virtual std::shared_ptr<const Op> InLittleMemory() const { return nullptr; }
  // The parameter that asks for a method whose result's parts need parts of the image alone, as on a line
  // ("method=direct"); empty for none.
  virtual std::string InParts() const { return ""; }
};
inline const LittleMemory* AsLittleMemory(const Op& op) { return dynamic_cast<const LittleMemory*>(&op); }
inline bool PrefersRows(const Op& op) {
  const LittleMemory* const little = AsLittleMemory(op);
  return little != nullptr && little->PrefersRows();
}

}  // namespace tessera::graph
TESSERA_API_END

#endif  // TESSERA_GRAPH_LITTLE_MEMORY_H_
