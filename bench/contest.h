// Several ways to one result, measured together and reported as a group: methods of this library against the
// exact one, tables of several sizes, peers with calls of their own.
#ifndef TESSERA_BENCH_CONTEST_H_
#define TESSERA_BENCH_CONTEST_H_

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "harness.h"

namespace tessera::bench {

struct Contest {
  struct Way {
    std::string name;  // stands behind "tessera TARGET"
    Node node;
    double paper_frames_per_second = 0;  // what the source gives for it; 0: nothing
  };
  struct Peer {
    std::string name;
    std::function<void()> run;  // writes `output`
    bool judged = true;         // false: it makes another picture, so that it has no error
  };

  Image output;  // its size and type are the frame's
  std::vector<Way> ways;
  std::vector<Peer> peers;
  Node truth;  // null: the first way; evaluated in double, operation by operation
  // Judges the output instead of `truth`, where the truth is no graph.
  std::function<Errors()> judge;
  // What a perfect method reads and writes; 0: the output, and as much again.
  double bytes_moved = 0;
  int oracle_bands = 4, oracle_rows = 2;
};

// Who takes part is known before pixels are made.
struct ContestNames {
  std::string suite, task, pixels;
  int width = 0, height = 0, threads = 1;
  std::vector<std::string> ways, peers;
};

// Registers SUITE/TASK/PIXELS/WxH/threads:N/CONTESTANT for a streaming copy of `bytes_moved`, every way on
// every target of the options, and the peers. `make` is called when the first of them is asked for.
void RegisterContest(const ContestNames& names, const Options& options, std::function<Contest()> make);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_CONTEST_H_
