// Numbers that are a pure function of a seed and an index: the same on every machine and library.
#ifndef TESSERA_TESTS_RANDOM_DRAW_H_
#define TESSERA_TESTS_RANDOM_DRAW_H_

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace tessera::random {

class Draw {
 public:
  Draw(uint64_t seed, uint64_t index) : state_(Mix(seed) ^ Mix(~index)) {}

  uint64_t Next() { return Mix(state_ += 0x9E3779B97F4A7C15u); }
  int Below(int n) { return static_cast<int>((Next() >> 32) * static_cast<uint64_t>(n) >> 32); }
  int Between(int low, int high) { return low + Below(high - low + 1); }
  double Unit() { return static_cast<double>(Next() >> 11) * 0x1p-53; }
  double Real(double low, double high) { return low + (high - low) * Unit(); }
  bool Chance(double p) { return Unit() < p; }
  template <typename T>
  const T& Of(const std::vector<T>& values) {
    return values[static_cast<size_t>(Below(static_cast<int>(values.size())))];
  }
  template <typename T>
  T Of(std::initializer_list<T> values) {
    return values.begin()[Below(static_cast<int>(values.size()))];
  }
  // An index, as often as its weight says.
  int Weighted(std::initializer_list<double> weights) {
    double sum = 0;
    for (const double w : weights) sum += w;
    double at = Unit() * sum;
    int i = 0;
    for (const double w : weights) {
      if (at < w) return i;
      at -= w, ++i;
    }
    return i - 1;
  }

 private:
  static uint64_t Mix(uint64_t z) {  // splitmix64
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
  }
  uint64_t state_;
};

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_DRAW_H_
