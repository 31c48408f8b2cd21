// The flags of every benchmark program, and its main.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "harness.h"
#include "tessera/error.h"
#include "tessera/targets.h"

namespace tessera::bench {
namespace {

constexpr char kUsage[] =
    "expected --sizes=WxH|large,... --types=float,half,uint16,uint8 --threads=N,... "
    "--targets=all|best|NAME,... --repetitions=N --seconds=S --alone";

std::vector<std::string> Split(const std::string& list) {
  std::vector<std::string> words;
  std::stringstream stream(list);
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

int Positive(const std::string& flag, const std::string& text) {
  char* end = nullptr;
  const long value = std::strtol(text.c_str(), &end, 10);
  if (*end || value < 1 || value > 1 << 20)
    throw Error(flag, "found '" + text + "', expected a positive integer");
  return static_cast<int>(value);
}

std::string CpuModel() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

// Takes our flags out of argv; throws Error on a malformed value.
Options ParseOptions(int* argc, char** argv) {
  Options options;
  int kept = 1;
  for (int i = 1; i < *argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = argument.find('=');
    const std::string flag = argument.substr(0, equals);
    const std::vector<std::string> words =
        Split(equals == std::string::npos ? "" : argument.substr(equals + 1));
    const auto is = [&](const char* name) {
      if (flag != name) return false;
      if (words.empty()) throw Error(flag, std::string("found no value, ") + kUsage);
      return true;
    };
    if (is("--sizes")) {
      options.sizes.clear();
      for (const std::string& word : words) {
        const size_t x = word.find('x');
        if (word == "large") {
          options.sizes.push_back({});
        } else if (x == std::string::npos) {
          throw Error(flag, "found '" + word + "', expected WIDTHxHEIGHT or large");
        } else {
          options.sizes.push_back({Positive(flag, word.substr(0, x)), Positive(flag, word.substr(x + 1))});
        }
      }
    } else if (is("--types")) {
      options.types.clear();
      for (const std::string& word : words) {
        bool known = false;
        for (PixelType t : {PixelType::kFloat, PixelType::kHalf, PixelType::kUint16, PixelType::kUint8}) {
          if (word == PixelTypeName(t)) options.types.push_back(t), known = true;
        }
        if (!known) throw Error(flag, "found '" + word + "', expected float, half, uint16 or uint8");
      }
    } else if (is("--threads")) {
      options.threads.clear();
      for (const std::string& word : words) options.threads.push_back(Positive(flag, word));
    } else if (is("--targets")) {
      options.targets = words;
      if (words.front() == "all") options.targets.clear();
      if (words.front() == "best") options.targets = {SimdTargets().front()};
    } else if (is("--repetitions")) {
      options.repetitions = Positive(flag, words.front());
    } else if (argument == "--alone") {
      options.alone = true;
    } else if (is("--seconds")) {
      options.seconds = Positive(flag, words.front());
    } else {
      argv[kept++] = argv[i];
    }
  }
  *argc = kept;
  const std::vector<std::string> known = SimdTargets();
  if (options.targets.empty()) options.targets = known;
  for (const std::string& target : options.targets) {
    if (std::find(known.begin(), known.end(), target) == known.end()) {
      throw Error("--targets", "found '" + target + "', expected a compiled target that this processor runs");
    }
  }
  return options;
}

// Runs what was registered; the exit code.
int RunRegistered(int* argc, char** argv) {
  benchmark::AddCustomContext("cpu", CpuModel());
  for (const auto& [name, version] : PeerVersions()) benchmark::AddCustomContext(name, version);
  benchmark::Initialize(argc, argv);
  if (benchmark::ReportUnrecognizedArguments(*argc, argv)) return 2;
  const size_t count = benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return count > 0 ? 0 : 1;
}

}  // namespace

namespace {

// Every buffer in large pages, peers' as well as ours: the C library's allocator takes advice by a variable
// that it reads once, so the program starts again with it. Where it cannot, it goes on without.
void UseLargePages([[maybe_unused]] char** argv) {
#if defined(__linux__)
  constexpr char kVariable[] = "GLIBC_TUNABLES", kAdvice[] = "glibc.malloc.hugetlb=1";
  const char* const set = std::getenv(kVariable);
  if (set != nullptr && std::strstr(set, "glibc.malloc.hugetlb") != nullptr) return;
  setenv(kVariable, set == nullptr || *set == '\0' ? kAdvice : (std::string(set) + ":" + kAdvice).c_str(), 1);
  execv("/proc/self/exe", argv);
#endif
}

}  // namespace

int RunSuite(int argc, char** argv, const std::function<void(Options)>& register_all) {
  UseLargePages(argv);
  try {
    register_all(ParseOptions(&argc, argv));
    return RunRegistered(&argc, argv);
  } catch (const std::exception& error) {
    const std::string program = std::filesystem::path(argv[0]).filename();
    std::fprintf(stderr, "%s: error: %s\n", program.c_str(), error.what());
    return 2;
  }
}

}  // namespace tessera::bench
