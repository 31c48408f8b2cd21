// What gcc's -fsanitize-coverage=trace-pc,trace-cmp calls.
#include "fuzz/coverage.h"

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <cstring>

#define UNCHECKED __attribute__((no_sanitize("address", "undefined")))

extern "C" const char __executable_start;  // of the linker: places do not depend on where a program is loaded

namespace tessera::fuzz {
namespace {

// By place in the program, folded: how often since the last look, and which numbers of times were seen, a bit
// each.
constexpr size_t kPlaces = size_t{1} << 20;
std::array<uint8_t, kPlaces> g_count, g_seen;
std::array<uint32_t, kPlaces> g_touched;
std::atomic<uint32_t> g_touched_count = 0;
size_t g_blocks = 0;

struct Operand {
  uint64_t value;
  int bytes;
};
std::array<Operand, 256> g_operands;
std::atomic<uint32_t> g_next_operand = 0;

UNCHECKED inline void Touch(uintptr_t place) {
  const auto at = static_cast<uint32_t>((place ^ place >> 20) % kPlaces);
  uint8_t& count = g_count[at];
  if (count == 0) {
    const uint32_t next = g_touched_count.fetch_add(1, std::memory_order_relaxed);
    if (next < kPlaces) g_touched[next] = at;
  }
  if (count < 255) ++count;
}

UNCHECKED inline void Compared(uint64_t value, uint64_t with, int bytes) {
  if (value == with || value < 4) return;  // small ones are found without
  g_operands[g_next_operand.fetch_add(1, std::memory_order_relaxed) % g_operands.size()] = {value, bytes};
}

// 1, 2, 3, 4-7, 8-15, 16-31, 32-127, more.
uint8_t Bucket(int count) {
  const int bucket = count < 4     ? count - 1
                     : count < 8   ? 3
                     : count < 16  ? 4
                     : count < 32  ? 5
                     : count < 128 ? 6
                                   : 7;
  return static_cast<uint8_t>(1 << bucket);
}

}  // namespace

bool TookANewWay() {
  bool found = false;
  const size_t touched = std::min<size_t>(g_touched_count.exchange(0), kPlaces);
  for (size_t i = 0; i < touched; ++i) {
    const uint32_t at = g_touched[i];
    const int count = g_count[at];
    g_count[at] = 0;
    if (count == 0) continue;  // two threads began to count at once
    const uint8_t bucket = Bucket(count);
    if ((g_seen[at] & bucket) != 0) continue;
    g_blocks += g_seen[at] == 0;
    g_seen[at] |= bucket;
    found = true;
  }
  return found;
}

size_t BlocksSeen() { return g_blocks; }

std::string ComparedWith(random::Draw& draw) {
  const auto most = static_cast<int>(std::min<size_t>(g_next_operand.load(), g_operands.size()));
  if (most == 0) return "";
  const Operand operand = g_operands[static_cast<size_t>(draw.Below(most))];
  if (draw.Chance(0.3)) return std::to_string(static_cast<int64_t>(operand.value));
  char bytes[8];
  std::memcpy(bytes, &operand.value, sizeof bytes);  // the lowest first
  std::string text(bytes, static_cast<size_t>(operand.bytes));
  return draw.Chance(0.5) ? text : std::string(text.rbegin(), text.rend());
}

}  // namespace tessera::fuzz

extern "C" {
using namespace tessera::fuzz;
UNCHECKED void __sanitizer_cov_trace_pc() {
  Touch(reinterpret_cast<uintptr_t>(__builtin_return_address(0)) -
        reinterpret_cast<uintptr_t>(&__executable_start));
}
UNCHECKED void __sanitizer_cov_trace_cmp1(uint8_t, uint8_t) {}
UNCHECKED void __sanitizer_cov_trace_cmp2(uint16_t a, uint16_t b) { Compared(a, b, 2); }
UNCHECKED void __sanitizer_cov_trace_cmp4(uint32_t a, uint32_t b) { Compared(a, b, 4); }
UNCHECKED void __sanitizer_cov_trace_cmp8(uint64_t a, uint64_t b) { Compared(a, b, 8); }
UNCHECKED void __sanitizer_cov_trace_const_cmp1(uint8_t a, uint8_t b) { Compared(a, b, 1); }
UNCHECKED void __sanitizer_cov_trace_const_cmp2(uint16_t a, uint16_t b) { Compared(a, b, 2); }
UNCHECKED void __sanitizer_cov_trace_const_cmp4(uint32_t a, uint32_t b) { Compared(a, b, 4); }
UNCHECKED void __sanitizer_cov_trace_const_cmp8(uint64_t a, uint64_t b) { Compared(a, b, 8); }
UNCHECKED void __sanitizer_cov_trace_cmpf(float, float) {}
UNCHECKED void __sanitizer_cov_trace_cmpd(double, double) {}
UNCHECKED void __sanitizer_cov_trace_switch(uint64_t value, uint64_t* cases) {
  if (cases[0] > 0) Compared(cases[2 + value % cases[0]], value, static_cast<int>(cases[1] / 8));
}
}
