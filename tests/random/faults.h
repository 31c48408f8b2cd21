// Operations with a fault each, to see whether random pipelines find it.
#ifndef TESSERA_TESTS_RANDOM_FAULTS_H_
#define TESSERA_TESTS_RANDOM_FAULTS_H_

#include <vector>

#include "ops/registry.h"
#include "random/generate.h"

namespace tessera::random {

struct Fault {
  ops::OpInfo op;               // a row without arguments of one operand, named after its fault
  std::vector<Check> found_by;  // any of these may be the first to see it
};
// With references of what the operations ought to be.
const std::vector<Fault>& Faults();
// The same operation without a fault.
const ops::OpInfo& Faultless();

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_FAULTS_H_
