/// Graphs as data: operations by their names in the registry, and a whole graph as JSON. @file
///
/// The JSON is one object. Version 1, which every later version reads:
///
///     {
///       "tessera_graph": 1,
///       "inputs": ["plate"],
///       "nodes": [
///         {"input": "plate"},
///         {"file": "shot.exr", "part": "P"},
///         {"operation": "blur", "parameters": {"sigma": [3], "method": "direct"}, "inputs": [0]},
///         {"operation": "ramp", "window": [0, 0, 640, 480], "channels": 3},
///         {"operation": "over", "inputs": [2, 3]}
///       ],
///       "result": 4
///     }
///
/// A node's "inputs" are numbers of nodes before it, lowest first, so that a node with several readers stands
/// there once and no graph is a circle. Parameters that are not named have their defaults; a number is a
/// number, a flag true or false, a list of numbers an array, everything else text. A file has a "subimage"
/// (its number) or a "part" (its name) where it is not the first. A generator has the window of its pixels,
/// [x0, y0, x1, y1], its display window as "display" where that is another, and channels: how many, or their
/// names, then with "alpha", the number of that channel, and its "type" where that is not "float". "inputs"
/// of the graph are the names of its open inputs in their order. There is nothing else in it, no code, and
/// whatever else is found is refused.
#ifndef TESSERA_GRAPH_JSON_H_
#define TESSERA_GRAPH_JSON_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// An operation of the registry on images, lowest first. `line` is what `tessera --help` explains: positional
/// arguments, then name=value, blank-separated ("9x9 kernel=box"). What is made by name can be written as
/// JSON; nodes that functions such as Blur make do not know what they were called with. Throws Error as the
/// command line does: an unknown name (with the nearest), a value out of its range, another number of images.
Node Apply(const std::string& operation, const std::vector<Node>& images, const std::string& line = "");
/// The same for a generator, whose pixels, channels and windows are those of `spec`.
Node Generate(const std::string& operation, const ImageSpec& spec, const std::string& line = "");
/// The image as the open input of that name, where a graph that it is in is written. Throws Error for "".
Node AsInput(const Node& image, const std::string& name);

/// A graph as text, and the images that it leaves open.
struct GraphJson {
  std::string text;                                  ///< the JSON, a line per node, ends with a newline
  std::vector<std::pair<std::string, Node>> inputs;  ///< its open inputs, in their order
};
/// The graph that ends in `result`. Files are written by the names that they were read by. Pixels in memory
/// are open inputs: of AsInput's name, or "image", "image2", ... Throws Error where a node was made by
/// neither Apply, Generate nor Read, where text of a parameter is no UTF-8, and for two images of one name.
GraphJson ToJson(const Node& result);

/// The names of a graph's open inputs, in their order. Throws DataError for what is no graph.
std::vector<std::string> GraphInputs(const std::string& json);
/// The graph's result, with the bits of the one that was written, of these images for its open inputs. Throws
/// DataError that names the node and the parameter for what is no graph of version 1 (text of more than 64
/// MiB, more than 65,536 nodes), for an open input without an image, an image for none, and what Read and
/// Apply throw. Files are opened as Context::Default()'s policy lets them, and every image of the graph, not
/// the result alone, is held against its limits.
Node FromJson(const std::string& json, const std::map<std::string, Node>& images = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_GRAPH_JSON_H_
