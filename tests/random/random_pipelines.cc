// Random pipelines for as long as one likes: every way of evaluating a graph against the others.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "random/workers.h"
#include "tessera/render.h"

namespace tessera::random {
namespace {

constexpr char kUsage[] =
    "random_pipelines [--seconds N | --count N] [--seed S] [--from I] [--only OP] [--workers N]\n"
    "                 [--failures N] [--no-shrink] [--shake] [--coverage] [--require-coverage]\n"
    "Draws graphs from the registry and compares all ways of evaluating them; 60 seconds by default.\n"
    "--shake holds up threads at random moments, thousands of times a second.\n"
    "Case I of seed S alone: --seed S --from I --count 1.\n";

struct Options {
  Run run;
  bool coverage = false, require_coverage = false;
};

bool Parse(int argc, char** argv, Options& o) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--coverage") {
      o.coverage = true;
    } else if (word == "--require-coverage") {
      o.require_coverage = true;
    } else if (word == "--shake") {
      o.run.shake = true;
    } else if (word == "--no-shrink") {
      o.run.shrink = false;
    } else if (i + 1 == argc) {
      return false;
    } else {
      const char* const value = argv[++i];
      if (word == "--seconds") {
        o.run.seconds = std::atof(value);
      } else if (word == "--count") {
        o.run.count = std::atoll(value);
      } else if (word == "--seed") {
        o.run.seed = std::strtoull(value, nullptr, 10);
      } else if (word == "--from") {
        o.run.from = std::strtoull(value, nullptr, 10);
      } else if (word == "--workers") {
        o.run.workers = std::max(1, std::atoi(value));
      } else if (word == "--failures") {
        o.run.failures = std::max(1, std::atoi(value));
      } else if (word == "--only") {
        o.run.only = ops::FindOp(value);
        if (o.run.only == nullptr) return false;
      } else {
        return false;
      }
    }
  }
  return true;
}

long long Of(const Report& r, const char* kind, const std::string& name) {
  return static_cast<long long>(r.tally.Of(kind, name));
}

void PrintCoverage(const Report& r) {
  std::printf("%-20s %9s %9s %9s %9s %9s %9s\n", "row", "accepted", "refused", "too large", "compared",
              "reference", "undecided");
  for (const ops::OpInfo* op : RegistryRows()) {
    std::printf("%-20s %9lld %9lld %9lld %9lld %9lld %9lld\n", op->name.c_str(), Of(r, kAccepted, op->name),
                Of(r, kRefused, op->name), Of(r, kTooLarge, op->name), Of(r, kCompared, op->name),
                Of(r, kReferenced, op->name), Of(r, kUndecided, op->name));
  }
  for (const RuleInfo& rule : RewriteRules()) {
    std::printf("rule %-20s applied %lld, switched off alone %lld\n", rule.name.c_str(),
                Of(r, kApplied, rule.name), Of(r, kSwitchedOff, rule.name));
  }
  for (int k = 0; k < static_cast<int>(Check::kCount); ++k) {
    const std::string name = CheckName(static_cast<Check>(k));
    std::printf("comparison %-12s %lld\n", name.c_str(), Of(r, kChecked, name));
  }
  for (const char* kind : {kFiles, kCases}) {
    const auto names = r.tally.counts().find(kind);
    if (names == r.tally.counts().end()) continue;
    for (const auto& [name, count] : names->second)
      std::printf("%-5s %-20s %lld\n", kind, name.c_str(), static_cast<long long>(count));
  }
}

// How much was never seen.
int Missing(const Report& r) {
  int missing = 0;
  const auto need = [&](const char* kind, const std::string& name) {
    if (r.tally.Of(kind, name) > 0) return;
    std::printf("MISSING %s %s\n", kind, name.c_str());
    ++missing;
  };
  for (const ops::OpInfo* op : RegistryRows()) need(kCompared, op->name);
  for (const RuleInfo& rule : RewriteRules()) need(kApplied, rule.name), need(kSwitchedOff, rule.name);
  for (int k = 0; k < static_cast<int>(Check::kCount); ++k) need(kChecked, CheckName(static_cast<Check>(k)));
  for (const char* format : {"exr", "tif", "png", "sgi", "tga", "bmp", "ppm", "dpx", "tiled", "of parts",
                             "padded", "by OpenImageIO", "of unassociated alpha"})
    need(kFiles, format);
  need(kCases, "above 8 MB");
  // A rule that is hardly ever met is hardly ever compared.
  for (const RuleInfo& rule : RewriteRules()) {
    if (r.tally.Of(kApplied, rule.name) * 1000 < r.cases)
      std::printf("RARE rule %s\n", rule.name.c_str()), ++missing;
  }
  return missing;
}

int Main(Options o) {
  o.run.rows = RegistryRows();
  o.run.progress = isatty(2) != 0;
  std::printf("seed %llu\n", static_cast<unsigned long long>(o.run.seed));
  std::fflush(stdout);
  const Report r = RunCases(o.run);
  long long refused = 0, drawn = 0;
  for (const ops::OpInfo* op : o.run.rows) {
    refused += Of(r, kRefused, op->name) + Of(r, kTooLarge, op->name);
    drawn += Of(r, kAccepted, op->name);
  }
  std::printf("%lld cases in %.1f s, %.1f a second, %zu failed; %.1f %% of the drawn steps refused\n",
              static_cast<long long>(r.cases), r.seconds, static_cast<double>(r.cases) / r.seconds,
              r.failures.size(),
              100.0 * static_cast<double>(refused) / static_cast<double>(std::max(1LL, refused + drawn)));
  if (o.coverage) PrintCoverage(r);
  if (o.coverage || !o.require_coverage) {
    std::printf("the slowest:\n");
    for (const auto& [seconds, line] : r.slowest) std::printf("%7.3f s  case %s\n", seconds, line.c_str());
  }
  const int missing = o.require_coverage ? Missing(r) : 0;
  return r.failures.empty() && missing == 0 ? 0 : 1;
}

}  // namespace
}  // namespace tessera::random

int main(int argc, char** argv) {
  tessera::random::Options options;
  options.run.seed =
      static_cast<uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()) / 1000 % 1000000000;
  options.run.workers = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  if (!Parse(argc, argv, options)) {
    std::fputs(tessera::random::kUsage, stderr);
    return 2;
  }
  return tessera::random::Main(options);
}
