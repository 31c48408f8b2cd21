// Every operation of the registry, with its typical arguments, against every peer that has it.
#include <cstdio>
#include <exception>

#include "harness.h"
#include "ops/registry.h"

int main(int argc, char** argv) {
  using namespace tessera::bench;
  try {
    const Options options = ParseOptions(&argc, argv);
    for (const tessera::ops::OpInfo& op : tessera::ops::Registry()) {
      if (op.examples.empty()) continue;
      RegisterTask("ops", MakeTask(op.name, {{op.name, op.examples.front()}}), options,
                   /*with_unfolded=*/false);
    }
    return RunRegistered(&argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_ops: error: %s\n", error.what());
    return 1;
  }
}
