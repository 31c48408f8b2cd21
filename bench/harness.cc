// The interleaved loop, the flags, and the bridge to Google Benchmark's registration and JSON output.
#include "harness.h"

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <sstream>

#include "tessera/error.h"
#include "tessera/targets.h"

namespace tessera::bench {
namespace {

constexpr char kUsage[] =
    "expected --sizes=WxH|large,... --types=float,half,uint16,uint8 --threads=N,... "
    "--targets=all|best|NAME,... --repetitions=N --seconds=S";
constexpr int kWarmUps = 2;
constexpr std::chrono::milliseconds kLeastTurn(4);

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

// A 16:9 frame of which one image of this type is ten times the last-level cache.
Options::Size LargeSize(PixelType type) {
  const long cache = sysconf(_SC_LEVEL3_CACHE_SIZE);
  const double bytes = 10.0 * static_cast<double>(cache > 0 ? cache : 32L << 20);
  const double pixels = bytes / (4.0 * static_cast<double>(PixelBytes(type)));
  const int unit = static_cast<int>(std::ceil(std::sqrt(pixels / (16 * 9)) / 8)) * 8;
  return {unit * 16, unit * 9};
}

// The frame of the group that is being measured; the next group reuses inputs of equal shape.
struct FrameCache {
  std::vector<Image> inputs;
  bool own_inputs = false;  // made by the task

  Frame Make(const Task& task, const Options::Size& size, PixelType type) {
    const ImageSpec spec(size.width, size.height, 4, type);
    if (!inputs.empty() &&
        (own_inputs || task.make_input != nullptr || inputs[0].spec().data_window != spec.data_window ||
         inputs[0].spec().type != type)) {
      inputs.clear();
    }
    while (static_cast<int>(inputs.size()) < task.inputs()) {
      inputs.push_back(task.make_input != nullptr
                           ? task.make_input(size.width, size.height, type, inputs.size())
                           : MakeInput(size.width, size.height, type, inputs.size() + 1));
    }
    own_inputs = task.make_input != nullptr;
    Frame frame{size.width, size.height, type, {}, {}};
    frame.inputs.assign(inputs.begin(), inputs.begin() + task.inputs());
    std::vector<Node> nodes;
    for (const Image& image : frame.inputs) nodes.push_back(FromImage(image));
    ImageSpec result = task.Build(nodes, spec).spec();
    result.type = type;
    frame.output = Image(result);
    return frame;
  }
};

// Everybody but this library and the copies; null where one has no call for a task.
constexpr std::unique_ptr<Contestant> (*kPeers[])(const Setting&) = {
    MakeOcio,           MakeOiio,     MakeOpenCv,        MakeLibm,          MakeOiioResample,
    MakeOpenCvResample, MakeVips,     MakeOpenCvFilter,  MakeOiioFilter,    MakePixman,
    MakeInPlace,        MakeReads,    MakeRecursiveBlur, MakeDecimatedBlur, MakeShortBlur,
    MakeMiddleBlur,     MakeLongBlur, MakeBoxesBlur};

struct Group {
  Task task;
  Options::Size size;
  PixelType type;
  int threads, repetitions;
  double seconds;
  std::vector<std::string> targets;
  bool with_unfolded;
  bool done = false;
  std::string failure;
  double pixel_bytes_moved = 0;  // per pixel of the frame, everything read and written by the task
  std::vector<Measured> results;
  double copy_ns = 0;

  double Nanoseconds(const Measured& m) const {
    return Median(m.seconds) * 1e9 / (static_cast<double>(size.width) * size.height);
  }

  void MeasureOnce() {
    if (done) return;
    done = true;
    static FrameCache cache;
    const Frame frame = cache.Make(task, size, type);
    const Setting setting{task, frame, threads};
    std::vector<std::unique_ptr<Contestant>> contestants;
    contestants.push_back(MakeCopy(setting, false));
    contestants.push_back(MakeCopy(setting, true));
    for (const std::string& target : targets) contestants.push_back(MakeTessera(setting, target));
    if (with_unfolded) contestants.push_back(MakeTessera(setting, targets.front(), false));
    for (const auto make : kPeers) {
      if (auto peer = make(setting)) contestants.push_back(std::move(peer));
    }
    std::vector<Node> nodes;
    for (const Image& image : frame.inputs) nodes.push_back(FromImage(image));
    const Oracle oracle(task.Build(nodes, frame.output.spec()));
    results = Measure(std::move(contestants), frame, oracle, repetitions, seconds);

    copy_ns = INFINITY;
    for (const Measured& m : results) {
      if (m.is_copy) copy_ns = std::min(copy_ns, Nanoseconds(m));
    }
    const double sample = static_cast<double>(PixelBytes(type));
    pixel_bytes_moved = 4 * sample * static_cast<double>(frame.inputs.size()) +
                        sample * frame.output.spec().channel_count() *
                            static_cast<double>(frame.output.spec().data_window.pixels()) /
                            static_cast<double>(frame.pixels());
  }
};

void Report(benchmark::State& state, Group& group, const std::string& contestant) {
  try {
    group.MeasureOnce();
  } catch (const std::exception& error) {
    group.failure = error.what();
  }
  const auto found = std::find_if(group.results.begin(), group.results.end(),
                                  [&](const Measured& m) { return m.name == contestant; });
  if (found == group.results.end()) {
    state.SkipWithError(group.failure.empty() ? "has no call for this task" : group.failure.c_str());
    return;
  }
  const Measured& m = *found;
  for (auto _ : state) state.SetIterationTime(Median(m.seconds));
  const double ns = group.Nanoseconds(m);
  const double copy_bytes = 8.0 * static_cast<double>(PixelBytes(group.type));
  state.counters["ns_per_pixel"] = ns;
  state.counters["ns_per_pixel_min"] =
      ns * *std::min_element(m.seconds.begin(), m.seconds.end()) / Median(m.seconds);
  state.counters["ns_per_pixel_max"] =
      ns * *std::max_element(m.seconds.begin(), m.seconds.end()) / Median(m.seconds);
  state.counters["times_copy"] = ns / group.copy_ns;
  state.counters["repetitions"] = static_cast<double>(m.seconds.size());
  if (m.is_copy) return;
  state.counters["copy_share"] = (group.pixel_bytes_moved / ns) / (copy_bytes / group.copy_ns);
  state.counters["max_error"] = m.errors.max;
  state.counters["rms_error"] = m.errors.rms;
  state.counters["values_checked"] = static_cast<double>(m.errors.values);
  state.counters["not_finite"] = static_cast<double>(m.errors.not_finite);
  if (group.type == PixelType::kUint8 || group.type == PixelType::kUint16) {
    state.counters["wrong_codes"] = static_cast<double>(m.errors.wrong_codes);
    state.counters["max_code_error"] = m.errors.max_code_error;
  }
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

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return n % 2 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

// Seconds of a run, the mean of as many as a turn has room for. A single short one would mostly tell what its
// predecessor left in the caches.
static double Turn(Contestant& contestant) {
  using Seconds = std::chrono::duration<double>;
  contestant.Prepare();
  const auto start = std::chrono::steady_clock::now();
  for (int runs = 1;; ++runs) {
    contestant.Run();
    const Seconds spent = std::chrono::steady_clock::now() - start;
    if (spent >= kLeastTurn) return spent.count() / runs;
  }
}

std::vector<Measured> Measure(std::vector<std::unique_ptr<Contestant>> contestants, const Frame& frame,
                              const Oracle& oracle, int repetitions, double seconds) {
  std::vector<Measured> results(contestants.size());
  const ImageView out = frame.output.view();
  const size_t bytes = static_cast<size_t>(out.row_stride) * out.roi.height();
  for (size_t i = 0; i < contestants.size(); ++i) {
    results[i].name = contestants[i]->Name();
    results[i].is_copy = contestants[i]->IsCopy();
    // A contestant that writes nothing must not be judged by its predecessor's pixels.
    std::memset(out.data, 0x5a, bytes);
    for (int k = 0; k < kWarmUps; ++k) {
      contestants[i]->Prepare();
      contestants[i]->Run();
    }
    if (!results[i].is_copy) results[i].errors = oracle.Compare(out);
  }
  std::vector<size_t> order(contestants.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937 random(20240607);
  for (int k = 0; k < repetitions; ++k) {
    std::shuffle(order.begin(), order.end(), random);
    for (size_t i : order) {
      const std::vector<double>& spent = results[i].seconds;
      if (seconds > 0 && k >= kFewestRepetitions &&
          std::accumulate(spent.begin(), spent.end(), 0.0) > seconds)
        continue;
      results[i].seconds.push_back(Turn(*contestants[i]));
    }
  }
  return results;
}

void RegisterTask(const std::string& suite, const Task& task, const Options& options, bool with_unfolded) {
  for (const Options::Size& chosen : options.sizes) {
    for (PixelType type : options.types) {
      const Options::Size size = chosen.width ? chosen : LargeSize(type);
      for (int threads : options.threads) {
        auto group = std::make_shared<Group>();
        group->task = task, group->size = size, group->type = type;
        group->threads = threads, group->repetitions = options.repetitions, group->seconds = options.seconds;
        group->targets = options.targets, group->with_unfolded = with_unfolded;
        // Which peers take part is known before pixels are: a small frame asks them.
        FrameCache tiny;
        const Frame frame = tiny.Make(task, {64, 64}, type);
        const Setting setting{task, frame, threads};
        std::vector<std::string> names = {"copy memcpy", "copy streaming"};
        for (const std::string& target : options.targets) names.push_back("tessera " + target);
        if (with_unfolded) names.push_back("tessera " + options.targets.front() + " unfolded");
        for (const auto make : kPeers) {
          if (auto peer = make(setting)) names.push_back(peer->Name());
        }
        std::ostringstream prefix;
        prefix << suite << '/' << task.name << '/' << PixelTypeName(type) << '/' << size.width << 'x'
               << size.height << "/threads:" << threads << '/';
        for (const std::string& name : names) {
          benchmark::RegisterBenchmark(
              (prefix.str() + name).c_str(),
              [group, name](benchmark::State& state) { Report(state, *group, name); })
              ->Iterations(1)
              ->UseManualTime()
              ->Unit(benchmark::kMillisecond);
        }
      }
    }
  }
}

int RunSuite(int argc, char** argv, const std::function<void(Options)>& register_all) {
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
