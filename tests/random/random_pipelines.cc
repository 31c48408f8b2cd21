// Random pipelines as long as one likes: prints its seed, what was found, shrunk, and how fast it was.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "random/compare.h"
#include "random/shrink.h"

namespace tessera::random {
namespace {

struct Options {
  double seconds = 60;
  int64_t count = -1;
  uint64_t seed = 0, from = 0;
  std::string only;
  bool coverage = false, fixed_seed = false;
  int failures = 10;
};

double Seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int Run(const Options& o) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(o.seed));
  std::fflush(stdout);
  const std::string folder =
      (std::filesystem::temp_directory_path() / ("random_pipelines." + std::to_string(getpid()))).string();
  std::filesystem::create_directories(folder);
  Generator generator(RegistryRows(), folder);
  Comparer comparer(folder);
  const ops::OpInfo* only = o.only.empty() ? nullptr : ops::FindOp(o.only);
  const double start = Seconds();
  int64_t cases = 0, failures = 0;
  std::vector<std::pair<double, std::string>> slowest;
  for (uint64_t i = o.from; o.count >= 0 ? cases < o.count : Seconds() - start < o.seconds; ++i) {
    const double before = Seconds();
    const Case c = generator.Make(o.seed, i, only);
    if (std::getenv("RANDOM_TRACE") != nullptr) std::fprintf(stderr, "%s\n", InWords(c).c_str());
    const auto finding = comparer.Run(c);
    const double took = Seconds() - before;
    ++cases;
    slowest.emplace_back(took, std::to_string(i) + " " + CommandLine(c));
    std::sort(slowest.rbegin(), slowest.rend());
    if (slowest.size() > 10) slowest.pop_back();
    if (!finding) continue;
    ++failures;
    Comparer again(folder);
    const Fails fails = [&](const Case& candidate) {
      try {
        const auto f = again.Run(candidate);
        return f && f->check == finding->check;
      } catch (const std::exception&) {
        return false;
      }
    };
    Case shrunk = c;
    shrunk.checks = Bit(finding->check);
    shrunk = Shrunk(shrunk, fails);
    const auto last = again.Run(shrunk);
    std::printf("FAILED %s: %s\n  was: %s\n%s\n", CheckName(finding->check),
                last ? last->what.c_str() : "(not again)", finding->what.c_str(), InWords(shrunk).c_str());
    std::fflush(stdout);
    if (failures >= o.failures) break;
  }
  const double took = Seconds() - start;
  std::filesystem::remove_all(folder);
  std::printf("%lld cases in %.1f s, %.1f cases/s, %lld failed\n", static_cast<long long>(cases), took,
              static_cast<double>(cases) / took, static_cast<long long>(failures));
  for (const auto& [seconds, line] : slowest) std::printf("%7.3f s  %s\n", seconds, line.c_str());
  if (o.coverage) {
    for (const ops::OpInfo* op : generator.rows()) {
      const auto it = generator.drawn().find(op->name);
      const Drawn d = it != generator.drawn().end() ? it->second : Drawn();
      std::printf("%-20s accepted %lld refused %lld too large %lld compared %lld referenced %lld\n",
                  op->name.c_str(), static_cast<long long>(d.accepted), static_cast<long long>(d.refused),
                  static_cast<long long>(d.too_large), static_cast<long long>(comparer.tally().rows[op->name]),
                  static_cast<long long>(comparer.tally().referenced[op->name]));
    }
  }
  return failures > 0 ? 1 : 0;
}

}  // namespace
}  // namespace tessera::random

int main(int argc, char** argv) {
  tessera::random::Options o;
  o.seed = static_cast<uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()) % 1000000000;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&]() -> std::string { return i + 1 < argc ? argv[++i] : ""; };
    if (word == "--seconds") o.seconds = std::atof(value().c_str());
    else if (word == "--count") o.count = std::atoll(value().c_str());
    else if (word == "--seed") o.seed = std::strtoull(value().c_str(), nullptr, 10);
    else if (word == "--from") o.from = std::strtoull(value().c_str(), nullptr, 10);
    else if (word == "--only") o.only = value();
    else if (word == "--coverage") o.coverage = true;
    else if (word == "--failures") o.failures = std::atoi(value().c_str());
  }
  return tessera::random::Run(o);
}
