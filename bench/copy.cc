// Copies with and without the cache; intrinsics here, because the yardstick must not depend on the library.
#include "copy.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace tessera::bench {
namespace {

constexpr size_t kLine = 64;

#if defined(__x86_64__)
void StreamLines(const std::byte* from, std::byte* to, size_t lines) {
  for (size_t i = 0; i < lines; ++i, from += kLine, to += kLine) {
    const auto* in = reinterpret_cast<const __m128i*>(from);
    auto* out = reinterpret_cast<__m128i*>(to);
    const __m128i a = _mm_loadu_si128(in), b = _mm_loadu_si128(in + 1);
    const __m128i c = _mm_loadu_si128(in + 2), d = _mm_loadu_si128(in + 3);
    _mm_stream_si128(out, a);
    _mm_stream_si128(out + 1, b);
    _mm_stream_si128(out + 2, c);
    _mm_stream_si128(out + 3, d);
  }
  _mm_sfence();
}

// The same with one store per line, where the processor has 512-bit registers.
__attribute__((target("avx512f"))) void StreamLines512(const std::byte* from, std::byte* to, size_t lines) {
  for (size_t i = 0; i < lines; ++i, from += kLine, to += kLine) {
    _mm512_stream_si512(reinterpret_cast<__m512i*>(to), _mm512_loadu_si512(from));
  }
  _mm_sfence();
}
#endif

}  // namespace

void CopyPlain(const std::byte* from, std::byte* to, size_t bytes) { std::memcpy(to, from, bytes); }

void CopyStreaming(const std::byte* from, std::byte* to, size_t bytes) {
#if defined(__x86_64__)
  const size_t head = std::min(bytes, (kLine - reinterpret_cast<uintptr_t>(to) % kLine) % kLine);
  const size_t lines = (bytes - head) / kLine;
  std::memcpy(to, from, head);
  if (__builtin_cpu_supports("avx512f")) {
    StreamLines512(from + head, to + head, lines);
  } else {
    StreamLines(from + head, to + head, lines);
  }
  const size_t done = head + lines * kLine;
  std::memcpy(to + done, from + done, bytes - done);
#else
  std::memcpy(to, from, bytes);
#endif
}

}  // namespace tessera::bench
