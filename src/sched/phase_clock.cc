// The phase that a thread is in.
#include "sched/phase_clock.h"

namespace tessera::sched {
namespace {

thread_local InPhase* innermost = nullptr;

int64_t Nanoseconds(std::chrono::steady_clock::duration d) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(d).count();
}

}  // namespace

void InPhase::Begin() {
  since_ = begun_ = std::chrono::steady_clock::now();
  outer_ = innermost;
  if (outer_ != nullptr) outer_->Stop(begun_);
  innermost = this;
}

void InPhase::End() {
  const Time now = std::chrono::steady_clock::now();
  Stop(now);
  if (step_) clock_->spent_[phase_].elapsed += Nanoseconds(now - begun_);
  if (outer_ != nullptr) outer_->since_ = now;
  innermost = outer_;
}

void InPhase::Stop(Time now) { clock_->spent_[phase_].busy += Nanoseconds(now - since_); }

PhaseHelpers::PhaseHelpers() : step_(innermost) {
  if (step_ == nullptr) return;
  step_->Stop(std::chrono::steady_clock::now());
  innermost = nullptr;
}

PhaseHelpers::~PhaseHelpers() {
  if (step_ == nullptr) return;
  step_->since_ = std::chrono::steady_clock::now();
  innermost = step_;
}

}  // namespace tessera::sched
