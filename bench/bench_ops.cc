// Every operation of the registry, with its typical arguments, against every peer that has it.

#include "harness.h"
#include "ops/registry.h"

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](const Options& options) {
    for (const tessera::ops::OpInfo& op : tessera::ops::Registry()) {
      if (op.examples.empty()) continue;
      RegisterTask("ops", MakeTask(op.name, {{op.name, op.examples.front()}}), options,
                   /*with_unfolded=*/false);
    }
  });
}
