// What an operation is to the engine: parameters, validation, output spec, algebra, a factory of its stage.
// No pixels and no instruction set here; see stage.h for how an operation is computed.
#ifndef TESSERA_GRAPH_OP_H_
#define TESSERA_GRAPH_OP_H_

#include <any>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/stage.h"
#include "tessera/error.h"
#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera::graph {

// How an operation's channels depend on its inputs' channels.
enum class OpKind {
  kSource,   // pixels in memory or in a file (source.h)
  kChannel,  // point operation; channel c of the result needs channel c of every input (add, clamp, checker)
  kColor,    // point operation on the first three channels and alpha together (matrix); others pass through.
             // MakeNode refuses an image whose alpha is one of those three
  kShuffle,  // renames, selects or appends channels; no arithmetic (ChannelMap)
  kCrop,     // changes windows only; new pixels, if any, are zero
  kTile,     // needs a neighbourhood or any other region of its inputs, or makes pixels in rows (TileStage)
  kWhole,    // computes the whole result from whole inputs (WholeStage); costs memory for all of them
};

// Where a channel of a kShuffle's result comes from: channel `channel` of input `input`, or, when input is
// -1, the constant `value`.
struct ChannelRef {
  int input = 0, channel = 0;
  float value = 0;
};

// What a stage's factory may know: the inputs' specs, the result's, and, for kChannel, which channels the
// four planes hold (-1 for unused); for kColor the planes are R, G, B, A.
struct StageContext {
  std::span<const ImageSpec> inputs;
  const ImageSpec& output;
  int channels[4];
  // One per input: the whole data window as dense float pixels where the op NeedsWhole(k) or is kWhole, else
  // no data. The pixels stay as long as the stage.
  std::span<const ConstImageView> whole;
  const Workers& workers;  // for costly preparation, and memory
};

class Op {
 public:
  virtual ~Op() = default;
  // Registry name, as on the command line without dashes ("ccmatrix").
  virtual std::string Name() const = 0;
  virtual OpKind Kind() const = 0;
  // The parameters struct (by value in the any), for the reference engine and for tests.
  virtual const std::any& Parameters() const = 0;
  // Validates the inputs and returns what the result is. Throws Error. Called when the node is built.
  virtual ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const = 0;
  // Parameters in a few words for --explain ("x2.5", "3x3").
  virtual std::string Describe() const { return Name(); }

  // True when the result is input 0, bit for bit.
  virtual bool IsIdentity() const { return false; }
  // This operation followed by `next` (single input both) as one operation of equal or lower cost, or null.
  virtual std::shared_ptr<const Op> Compose(const Op& next) const {
    (void)next;
    return nullptr;
  }
  // Whether input `k` must be in memory whole before the stage is made (a table, a warp's source). A point
  // stage sees zero planes for it, a tile stage the whole image.
  virtual bool NeedsWhole(int k) const {
    (void)k;
    return false;
  }
  // kChannel, kColor: the point stage on four planes.
  virtual std::unique_ptr<PointStage> MakePointStage(const StageContext&) const { return nullptr; }
  // kColor: whether alpha is read / written. A stage that does not write alpha passes plane 3 on, bit for
  // bit. One that does gives its fourth plane to the result's alpha channel or, when it has none, to channel
  // 3.
  virtual bool ReadsAlpha() const { return false; }
  virtual bool WritesAlpha() const { return false; }
  // kTile.
  virtual std::unique_ptr<TileStage> MakeTileStage(const StageContext&) const { return nullptr; }
  // kWhole.
  virtual std::unique_ptr<WholeStage> MakeWholeStage(const StageContext&) const { return nullptr; }
  // kTile: channels of `input` needed for the channels of the result (true = needed); default all.
  virtual std::vector<bool> NeededChannels(int input, const std::vector<bool>& result,
                                           const ImageSpec& in) const {
    (void)input, (void)result;
    return std::vector<bool>(in.channels.size(), true);
  }
  // kShuffle: one entry per channel of the result.
  virtual std::vector<ChannelRef> ChannelMap(std::span<const ImageSpec> inputs) const {
    (void)inputs;
    return {};
  }
};

// Base of an op with a parameter struct P: stores it and answers Parameters(); `params()` is the typed
// access.
template <typename P>
class OpWith : public Op {
 public:
  explicit OpWith(P params) : any_(std::move(params)), params_(std::any_cast<P>(&any_)) {}
  const std::any& Parameters() const final { return any_; }
  const P& params() const { return *params_; }

 private:
  std::any any_;
  const P* params_;
};

struct NodeData {
  std::shared_ptr<const Op> op;
  std::vector<Node> inputs;
  ImageSpec spec;

  ~NodeData();  // releases a long chain without recursion
};

// Builds a node: validates through the op's OutputSpec and shares it.
Node MakeNode(std::shared_ptr<const Op> op, std::vector<Node> inputs);

// Throws Error naming both sizes unless all data windows are equal.
void RequireSameWindow(const std::string& op, std::span<const ImageSpec> inputs);
// Throws Error listing the channels present unless there are at least three.
void RequireColor(const std::string& op, const ImageSpec& input);

}  // namespace tessera::graph
TESSERA_API_END

#endif  // TESSERA_GRAPH_OP_H_
