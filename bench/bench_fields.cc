// What distance fields take: of solids, beside the whole solid asked at every voxel, and whether all codes
// are those; of a volume; drawn out. Medians of five, one thread, as making them is.
//   bench_fields [--side N]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include "tessera/volume.h"

namespace tessera::bench {
namespace {

constexpr double kRange = 0.25;

double Seconds(int turns, const std::function<void()>& work) {
  std::vector<double> times;
  for (int t = 0; t < turns; ++t) {
    const auto start = std::chrono::steady_clock::now();
    work();
    times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::nth_element(times.begin(), times.begin() + turns / 2, times.end());
  return times[static_cast<size_t>(turns / 2)];
}

void MeasureSolid(const std::string& words, PixelType type, int side) {
  const Solid solid = Solid::Parse(words);
  const VolumeSpec spec = VolumeSpec::Centred({side, side, side}, type);
  Volume field;
  const double blocks = Seconds(5, [&] { field = DistanceField(solid, spec, kRange); });
  Volume whole;
  const double plain =
      Seconds(1, [&] { whole = Volume(field.spec(), [&](const Vector3& p) { return solid.Distance(p); }); });
  int64_t other = 0;
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) other += field.At(i, j, k) != whole.At(i, j, k);
    }
  }
  const double voxels = std::pow(side, 3);
  std::printf("%-10s %-7s %10.2f %16.1f %10.1f %14lld\n", words.c_str(), PixelTypeName(type),
              1e9 * blocks / voxels, 1e9 * plain / voxels, plain / blocks, static_cast<long long>(other));
  std::fflush(stdout);
}

void MeasureOthers(int side) {
  const double voxels = std::pow(side, 3);
  const Volume field =
      DistanceField(Solid::Parse("body"), VolumeSpec::Centred({side, side, side}, PixelType::kFloat));
  const auto line = [&](const char* name, const std::function<void()>& work) {
    std::printf("%-18s %10.2f\n", name, 1e9 * Seconds(5, work) / voxels);
    std::fflush(stdout);
  };
  line("of a volume", [&] { DistanceField(field, DistanceFieldParams{.iso = 0, .inside_below = true}); });
  DrawnParams drawn;
  drawn.slope = [](double, double) { return 0.3; };
  line("drawn out", [&] { Drawn(field, drawn); });
}

int Main(const std::vector<std::string>& words) {
  int side = 256;
  if (words.size() == 2 && words[0] == "--side") {
    side = std::atoi(words[1].c_str());
  } else if (!words.empty()) {
    std::cerr << "bench_fields: found " << words[0] << ", expected --side N\n";
    return 2;
  }
  std::printf("%d^3, range %g, ns a voxel\n%-18s %10s %16s %10s %14s\n", side, kRange, "", "field",
              "every voxel", "ratio", "other codes");
  for (const char* const solid : {"body", "knot"}) {
    for (const PixelType type :
         {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
      MeasureSolid(solid, type, side);
    }
  }
  MeasureOthers(side);
  return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) { return tessera::bench::Main({argv + 1, argv + argc}); }
