// The latest witness of a thread.
#include "base/commit_witness.h"

#include <utility>

namespace tessera::base {
namespace {

CommitWitness*& Latest() {
  thread_local CommitWitness* latest = nullptr;
  return latest;
}

}  // namespace

CommitWitness::CommitWitness(Look look) : look_(std::move(look)), before_(Latest()) { Latest() = this; }

CommitWitness::~CommitWitness() { Latest() = before_; }

void CommitWitness::Show(const std::string& temporary, const std::string& file) {
  if (Latest() != nullptr) Latest()->look_(temporary, file);
}

}  // namespace tessera::base
