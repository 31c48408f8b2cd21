/// Evaluation of a graph: into memory, as a printed plan, or against the double-precision reference. @file
#ifndef TESSERA_RENDER_H_
#define TESSERA_RENDER_H_

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

class Context;

/// Options of one evaluation. Results never depend on threads or tile shape: bits are equal for any value.
struct RenderOptions {
  int threads = 0;                         ///< 0: every core
  size_t memory_budget = size_t{1} << 29;  ///< bytes that streaming buffers and arenas may take together
  int tile_width = 0;                      ///< 0: the planner's choice
  int tile_height = 0;                     ///< 0: the planner's choice
  bool optimize = true;                    ///< fold, drop and share; off for comparison
  bool shuffle_tiles = false;              ///< serial, in a shuffled order: for tests

  /// Names of rewrite rules (RewriteRules) that are not applied, or "all": for tests and for finding a fault.
  std::vector<std::string> rules_off = {};
  /// Called with the share done in [0,1], never a smaller one, several times a second from the beginning on,
  /// by one thread at a time but not always by the caller's; false cancels.
  std::function<bool(double)> progress = {};
  /// Whose memory pictures and tiles are made in, and who keeps what is prepared for the next evaluation;
  /// null: Context::Default(). Must outlive the evaluation, or the PreparedGraph. What a graph was made from,
  /// as volumes and tables, belongs to Context::Default().
  Context* context = nullptr;
};

/// Where the time of an evaluation went, in seconds. Of threads: prepare, decode, compute, encode and wait
/// add up to `threads` times `seconds`.
struct RunPhases {
  /// The decoding of one file.
  struct Decode {
    std::string file;    ///< its name
    double busy = 0;     ///< of threads that unpacked its pixels
    double elapsed = 0;  ///< of the clock, whoever helped
  };
  std::vector<Decode> decode;  ///< each file once, those without pixels in memory
  double prepare = 0;          ///< files opened, the plan made
  double compute = 0;          ///< whole-image operations count as all threads'
  double encode = 0;           ///< packing and writing
  double encode_elapsed = 0;   ///< of the clock, whoever helped
  double wait = 0;             ///< threads without work
  int threads = 0;             ///< that the evaluation may use
  double seconds = 0;          ///< of the clock

  /// What the others wait for: "prepare", "compute", "encode" or "decode FILE". Decoding and encoding have an
  /// order, so that they take the time of the clock that they take, whoever helps; computing is shared by all
  /// threads.
  std::string Limit() const;
  /// Those of another evaluation by the same threads, after this one.
  void Add(const RunPhases& other);
};

/// What an evaluation did, for --runstats and the benchmarks.
struct RunStats {
  /// One pass over the pixels.
  struct Pass {
    std::string name;    ///< "render", "stream", or an operation that takes a pass of its own
    double seconds = 0;  ///< of wall clock
    int64_t pixels = 0;  ///< produced
    int64_t bytes = 0;   ///< read from sources and written to the sink
  };
  std::vector<Pass> passes;        ///< in order
  std::vector<std::string> rules;  ///< names of the rewrite rules that were applied, each once
  std::vector<std::string> files;  ///< who decoded or encoded each file, why not somebody faster
  RunPhases phases;                ///< where the time went
};

/// Evaluates the graph into a new image of `type` (all of the node's data window).
/// Throws Error (memory refused, a source that cannot be read) or Cancelled.
Image Render(const Node& node, PixelType type = PixelType::kFloat, const RenderOptions& options = {},
             RunStats* stats = nullptr);

/// Evaluates out.roi, which must lie inside the node's data window, into the caller's pixels. `out` has as
/// many channels as the node, any type and strides, and may be a source of the graph where every operation
/// between is a point operation (in place).
void RenderInto(const Node& node, const ImageView& out, const RenderOptions& options = {},
                RunStats* stats = nullptr);

/// A rule that rewrites the bound list of steps of a run (loads, operations, stores) into a faster one.
struct RuleInfo {
  std::string name;  ///< for RenderOptions::rules_off
  std::string help;  ///< what becomes what, in a line

  /// May round integer results to the neighbouring code where they lie within a few roundings of floats (of
  /// 2^-24 times the largest sample) of the tie between both; else bits are equal.
  bool rounds = false;
};
/// Every rule, in the order of application.
const std::vector<RuleInfo>& RewriteRules();

/// The plan in words: passes, fused stages, tile shape, bytes moved. Nothing is evaluated.
std::string Explain(const Node& node, PixelType type = PixelType::kFloat, const RenderOptions& options = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_RENDER_H_
