// Verify on random graphs over random bytes: what the library computes is within its bounds.
#include "tessera/verify.h"

#include "fuzz/graphs.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() { return GraphSeeds(); }
std::vector<std::string> Words() { return HardValues(); }
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  fuzz::Try([&] {
    const auto graph = fuzz::GraphOf(in);
    if (!graph || (graph->drawn.checks & random::Bit(random::Check::kVerify)) == 0) return;
    VerifyOptions options;
    options.samples = 1;
    options.seconds = 0.1;
    options.render.threads = 1;
    const VerifyReport report = Verify(graph->built.result(), graph->drawn.type, options);
    fuzz::Require(!report.Summary().empty(), "a report of nothing");
    fuzz::Require(report.samples >= report.undecided, "more undecided values than values");
  });
  return 0;
}
