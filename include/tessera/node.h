/// A lazy image: an operation and its inputs. Nothing is computed until Render, Write or Verify. @file
#ifndef TESSERA_NODE_H_
#define TESSERA_NODE_H_

#include <memory>

#include "tessera/export.h"
#include "tessera/image.h"

TESSERA_API_BEGIN
namespace tessera {

namespace graph {
struct NodeData;
}

/// Immutable and cheap to copy; sharing a node between two consumers computes it once per tile.
class Node {
 public:
  Node() = default;
  /// The library's own.
  explicit Node(std::shared_ptr<const graph::NodeData> data) : data_(std::move(data)) {}

  /// False for an empty node.
  explicit operator bool() const { return data_ != nullptr; }
  /// What the result will be: windows, channels, metadata. Throws Error on an empty node.
  const ImageSpec& spec() const;
  /// The library's own.
  const graph::NodeData* data() const { return data_.get(); }
  /// The library's own.
  const std::shared_ptr<const graph::NodeData>& shared() const { return data_; }

 private:
  std::shared_ptr<const graph::NodeData> data_;
};

/// A node that reads pixels already in memory. The Image form shares ownership; the view form borrows: the
/// pixels must live, unchanged, until every evaluation of the graph has ended. No copy is made.
Node FromImage(const Image& image);
/// Somebody's pixels, borrowed; see FromImage.
Node FromView(const ConstImageView& pixels, const ImageSpec& spec);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_NODE_H_
