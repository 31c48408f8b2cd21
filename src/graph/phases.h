// Where the time of a file's making went.
#ifndef TESSERA_GRAPH_PHASES_H_
#define TESSERA_GRAPH_PHASES_H_

#include <string>
#include <vector>

#include "graph/source.h"
#include "tessera/export.h"
#include "tessera/render.h"

TESSERA_API_BEGIN
namespace tessera::graph {

// Where threads' time went, in seconds: everything but `elapsed` adds up to `threads` times `seconds`.
struct Phases {
  struct Decode {
    std::string file;
    double busy = 0;     // of threads that unpacked its pixels
    double elapsed = 0;  // of the clock, whoever helped
  };
  std::vector<Decode> decode;  // each file once, those without pixels in memory
  double prepare = 0;          // files opened, the plan made
  double compute = 0;          // whole-image operations count as all threads'
  double encode = 0;           // packing and writing
  double encode_elapsed = 0;   // of the clock, whoever helped
  double wait = 0;             // threads without work
  int threads = 0;             // that the evaluation may use
  double seconds = 0;          // of the clock

  // A line for each phase: seconds of threads, their share, the file (`output` for encoding); then which one
  // the others wait for. Decoding and encoding have an order, so that they take the time of the clock that
  // they take, whoever helps; computing is shared by all threads.
  std::vector<std::string> Lines(const std::string& output) const;
};

// RenderToSink of render.h that adds to `phases`, where they are asked for.
void RenderToSink(const Node& node, PixelType type, RowSink& sink, const RenderOptions& options,
                  RunStats* stats, Phases* phases);

}  // namespace tessera::graph
TESSERA_API_END

#endif  // TESSERA_GRAPH_PHASES_H_
