// How errors of an operation's inputs pass through it: its response to inputs moved by their tolerances.
#ifndef TESSERA_VERIFY_PROPAGATE_H_
#define TESSERA_VERIFY_PROPAGATE_H_

#include <functional>
#include <span>
#include <vector>

#include "reference/reference.h"

namespace tessera::verify {

// A region in double and, per sample, the error that a float32 evaluation may have.
struct Evaluated {
  reference::ImageD value, tolerance;
  // Where a decision on the way may go the other way: how far the other result lies from this one, or
  // reference::kUnknownJump. Without samples where there is no such value.
  reference::ImageD jump;

  double JumpAt(int x, int y, int c) const { return jump.samples.empty() ? 0 : jump.at(x, y, c); }
  // Whether what may be decided otherwise matters beside what may be rounded otherwise.
  bool Undecided(int x, int y, int c) const {
    const double jump = JumpAt(x, y, c);  // of an infinite value the tolerance is infinite too
    return jump >= reference::kUnknownJump || jump > tolerance.at(x, y, c);
  }
};

// An operation with all but its inputs bound.
struct Operation {
  std::function<void(std::span<const reference::ImageD> in, reference::ImageD& out)> evaluate;
  // Whether a sample of the result comes from other pixels too.
  bool neighbours = false;
  // Whether a channel of the result comes from the same channel of the inputs alone.
  bool separate_channels = false;
};

// Adds to out.tolerance and out.jump, whose value is the operation's on in[k].value, what the errors of input
// k make of it. `linear`: the result is a weighted sum of that input's samples.
void PassErrors(const Operation& operation, std::span<const Evaluated> in, size_t k, bool linear,
                Evaluated& out);

}  // namespace tessera::verify

#endif  // TESSERA_VERIFY_PROPAGATE_H_
