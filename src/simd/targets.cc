// The instruction sets that kernels were compiled for, and how to force one; implements tessera/targets.h.
#include "tessera/targets.h"

#include <hwy/highway.h>

#include "tessera/error.h"

namespace tessera {
namespace {

// The set detected for this CPU, before anything was forced. The compiler's baseline is always there;
// Highway's own library may have been built with another portable fallback than ours.
int64_t DetectedTargets() {
  static const int64_t detected = (hwy::SupportedTargets() | HWY_STATIC_TARGET) & HWY_TARGETS;
  return detected;
}

}  // namespace

std::vector<std::string> SimdTargets() {
  std::vector<std::string> names;
  for (int64_t targets = DetectedTargets(); targets != 0; targets &= targets - 1) {
    names.push_back(hwy::TargetName(targets & -targets));
  }
  return names;
}

std::string SimdTarget() {
  const int64_t detected = DetectedTargets();
  const int64_t current = (hwy::SupportedTargets() | HWY_STATIC_TARGET) & detected;
  return hwy::TargetName(current & -current);
}

void SetSimdTarget(const std::string& name) {
  const int64_t detected = DetectedTargets();
  int64_t chosen = name == "auto" ? detected : 0;
  std::string known;
  for (int64_t targets = detected; targets != 0; targets &= targets - 1) {
    const int64_t target = targets & -targets;
    if (name == hwy::TargetName(target)) chosen = target;
    known += std::string(known.empty() ? "" : ", ") + hwy::TargetName(target);
  }
  if (chosen == 0)
    throw Error("simd target '" + name + "'", "not available here; expected auto or one of " + known);
  hwy::SetSupportedTargetsForTest(name == "auto" ? 0 : chosen);
  hwy::GetChosenTarget().Update(chosen);
}

}  // namespace tessera
