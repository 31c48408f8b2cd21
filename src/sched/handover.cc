// See handover.h.
#include "sched/handover.h"

namespace tessera::sched {

void Handover::Leave() { passed_.fetch_add(1, std::memory_order_release); }
void Handover::Find() const { (void)passed_.load(std::memory_order_acquire); }

}  // namespace tessera::sched
