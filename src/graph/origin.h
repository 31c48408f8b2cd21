// How a node was asked for, kept beside it for whoever writes the graph down. The engine never looks at it.
#ifndef TESSERA_GRAPH_ORIGIN_H_
#define TESSERA_GRAPH_ORIGIN_H_

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera::graph {

struct Origin {
  enum class Kind : uint8_t {
    kOperation,  // a row of the registry on `inputs`
    kFile,       // pixels of a file
    kPixels,     // somebody's pixels
  };
  Kind kind = Kind::kOperation;
  std::string name;  // of the row; of the file; that the pixels were given, "" for none
  // What was asked for, by name and as text: parameters of the row; of a file "subimage", "part", "formats".
  std::vector<std::pair<std::string, std::string>> values = {};
  std::vector<Node> inputs = {};           // of the row, lowest first
  std::optional<ImageSpec> output = {};    // what a generator was asked for
  std::shared_ptr<const void> owner = {};  // of the pixels; lives as long as the node
};

// The same operation on the same inputs as a node that knows its origin.
Node WithOrigin(const Node& node, Origin origin);
// Null for a node that nobody gave one.
const Origin* OriginOf(const Node& node);

}  // namespace tessera::graph
TESSERA_API_END

#endif  // TESSERA_GRAPH_ORIGIN_H_
