// Tables against OpenColorIO, OpenCV and Little CMS, and speed against error for every filter, size and
// storage, so that a user sees which table to take for which error.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <map>
#include <memory>

#include "call.h"
#include "harness.h"
#include "lookup_peers.h"
#include "lookup_pictures.h"
#include "tessera/ops/generate.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera::bench {
namespace {

// Contestants that share pixels. `exact`, when set, is what the table was made from: errors are then the
// methods' own; otherwise they are distances from the same interpolation in double.
struct LookupCase {
  std::string task;
  Image input, output;
  std::vector<std::pair<std::string, Node>>
      nodes;  // method's suffix and what it evaluates; the first is the oracle
  std::vector<std::pair<std::string, std::function<void()>>> peers;
  TableFunction exact;
};

Errors CompareWithFunction(const LookupCase& c) {
  Errors errors;
  double sum = 0, at[4], want[4];
  const Roi& r = c.output.spec().data_window;
  const int in_channels = c.input.spec().channel_count(),
            channels = std::min(3, c.output.spec().channel_count());
  for (int y = r.y0; y < r.y1; y += 37) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int k = 0; k < std::min(4, in_channels); ++k)
        at[k] = Decode(c.input.view().At(x, y, k), c.input.spec().type);
      c.exact(at, want);
      for (int k = 0; k < channels; ++k) {
        const double error = std::fabs(Decode(c.output.view().At(x, y, k), c.output.spec().type) - want[k]);
        errors.max = std::max(errors.max, error);
        sum += error * error;
        ++errors.values;
      }
    }
  }
  errors.rms = std::sqrt(sum / static_cast<double>(errors.values));
  return errors;
}

// Everybody of a case, measured once.
struct Group {
  std::function<LookupCase()> make;
  Options options;
  bool done = false;
  std::vector<Measured> results;
  double pixels = 0, copy_ns = 0, peer_ns = 0;  // of the fastest peer; 0: there is none

  void MeasureOnce() {
    if (done) return;
    done = true;
    const LookupCase c = make();
    const ImageView out = c.output.view();
    pixels = static_cast<double>(c.output.spec().data_window.pixels());
    std::vector<std::unique_ptr<Contestant>> contestants;
    const size_t bytes = static_cast<size_t>(out.row_stride) * static_cast<size_t>(out.roi.height());
    // What must be read and written: an input of another size is read into the result as often as it fits.
    const std::vector<std::byte> from(bytes);
    contestants.push_back(std::make_unique<Call>(
        "copy memcpy", [&] { std::memcpy(out.data, from.data(), bytes); }, "", true));
    for (const std::string& target : options.targets) {
      for (const auto& [suffix, node] : c.nodes) {
        contestants.push_back(std::make_unique<Call>(
            "tessera " + target + suffix, [&node = node, out] { RenderInto(node, out, {.threads = 1}); },
            target));
      }
    }
    for (const auto& [name, run] : c.peers) contestants.push_back(std::make_unique<Call>(name, run));
    Frame frame;
    frame.width = out.roi.width(), frame.height = out.roi.height();
    frame.type = out.type, frame.output = c.output;
    const Oracle oracle(c.exact ? Constant(c.output.spec()) : c.nodes[0].second, 4, 2);
    std::map<std::string, Errors> errors;
    if (c.exact) {
      for (const auto& contestant : contestants) {
        contestant->Prepare();
        contestant->Run();
        errors[contestant->Name()] = CompareWithFunction(c);
      }
    }
    results = Measure(std::move(contestants), frame, oracle, options.repetitions, options.seconds);
    for (Measured& m : results) {
      if (c.exact) m.errors = errors[m.name];
      if (m.is_copy) copy_ns = Nanoseconds(m);
      const bool peer =
          std::any_of(c.peers.begin(), c.peers.end(), [&m](const auto& p) { return p.first == m.name; });
      if (peer && (peer_ns == 0 || Nanoseconds(m) < peer_ns)) peer_ns = Nanoseconds(m);
    }
    SetSimdTarget("auto");
  }
  double Nanoseconds(const Measured& m) const { return Median(m.seconds) * 1e9 / pixels; }
};

void Report(benchmark::State& state, Group& group, const std::string& method) {
  std::string failure = "has no call for this task";
  try {
    group.MeasureOnce();
  } catch (const std::exception& error) {
    failure = error.what();
  }
  for (const Measured& m : group.results) {
    if (m.name != method) continue;
    for (auto _ : state) state.SetIterationTime(Median(m.seconds));
    const double ns = group.Nanoseconds(m);
    state.counters["ns_per_pixel"] = ns;
    state.counters["times_copy"] = ns / group.copy_ns;
    state.counters["repetitions"] = static_cast<double>(m.seconds.size());
    if (m.is_copy) return;
    state.counters["copy_share"] = group.copy_ns / ns;
    if (group.peer_ns > 0) state.counters["times_peer"] = group.peer_ns / ns;
    state.counters["max_error"] = m.errors.max;
    state.counters["rms_error"] = m.errors.rms;
    state.counters["values_checked"] = static_cast<double>(m.errors.values);
    state.counters["wrong_codes"] = static_cast<double>(m.errors.wrong_codes);
    state.counters["max_code_error"] = m.errors.max_code_error;
    return;
  }
  state.SkipWithError(failure.c_str());
}

// Names are known without making pixels; `make` is called when the group is measured.
void Register(const std::string& suite, const std::string& task, PixelType type, int width, int height,
              const Options& options, const std::vector<std::string>& suffixes,
              const std::vector<std::string>& peers, std::function<LookupCase()> make) {
  auto group = std::make_shared<Group>();
  group->make = std::move(make), group->options = options;
  std::vector<std::string> names = {"copy memcpy"};
  for (const std::string& target : options.targets) {
    for (const std::string& suffix : suffixes) names.push_back("tessera " + target + suffix);
  }
  names.insert(names.end(), peers.begin(), peers.end());
  for (const std::string& name : names) {
    const std::string full = suite + "/" + task + "/" + PixelTypeName(type) + "/" + std::to_string(width) +
                             "x" + std::to_string(height) + "/threads:1/" + name;
    benchmark::RegisterBenchmark(full.c_str(),
                                 [group, name](benchmark::State& s) { Report(s, *group, name); })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
}

void RegisterCubes(const Options& options, int width, int height) {
  for (const PixelType type : {PixelType::kFloat, PixelType::kUint8}) {
    for (const bool photo : {false, true}) {
      for (const TableFilter filter : {TableFilter::kTetrahedral, TableFilter::kLinear}) {
        const std::string task = std::string("33^3 ") +
                                 (filter == TableFilter::kLinear ? "trilinear " : "tetrahedral ") +
                                 (photo ? "photo" : "random");
        Register("lookup", task, type, width, height, options, {""}, {"OpenColorIO"}, [=] {
          LookupCase c{
              task, photo ? Photo(width, height, type) : MakeInput(width, height, type, 3), {}, {}, {}, {}};
          c.output = Image(ImageSpec(width, height, 4, type));
          const Table table =
              TableFromFunction(FilmColor, {.sizes = {33, 33, 33}, .channels = 3, .probes = 1}).table;
          c.nodes = {{"", ApplyTable3D(FromImage(c.input), table, {.filter = filter})}};
          c.peers = {
              {"OpenColorIO", OcioCube(table, filter == TableFilter::kTetrahedral, c.input, c.output)}};
          return c;
        });
      }
    }
  }
}

void RegisterCurves(const Options& options, int width, int height) {
  const auto gamma = [](int size) {
    return TableFromFunction([](const double* s, double* v) { v[0] = std::pow(s[0], 0.45); },
                             {.sizes = {size}, .probes = 1})
        .table;
  };
  for (const bool photo : {false, true}) {
    const std::string task = std::string("4096 linear ") + (photo ? "photo" : "random");
    Register("lookup", task, PixelType::kFloat, width, height, options, {""}, {"OpenColorIO"}, [=] {
      const PixelType type = PixelType::kFloat;
      LookupCase c{task, photo ? Photo(width, height, type) : MakeInput(width, height, type, 3), {}, {}, {},
                   {}};
      c.output = Image(ImageSpec(width, height, 4, type));
      const Table table = gamma(4096);
      c.nodes = {{"", ApplyTables1D(FromImage(c.input), {.tables = {table, table, table}})}};
      c.peers = {{"OpenColorIO", OcioCurve(table, c.input, c.output)}};
      return c;
    });
  }
  for (const bool one : {true, false}) {
    const std::string task = std::string("256 codes ") + (one ? "one table" : "per channel");
    Register("lookup", task, PixelType::kUint8, width, height, options, {""}, {"OpenCV"}, [=] {
      LookupCase c{task, MakeInput(width, height, PixelType::kUint8, 3), {}, {}, {}, {}};
      c.output = Image(ImageSpec(width, height, 4, PixelType::kUint8));
      std::vector<Table> tables(4, gamma(256));
      if (!one)
        tables[1] = Table({2}, 1, std::vector<float>{1, 0}, TableAlign::kEnds),
        tables[3] = Table({2}, 1, std::vector<float>{0, 1}, TableAlign::kEnds);
      c.nodes = {{"", ApplyTables1D(FromImage(c.input), {.tables = tables})}};
      c.peers = {{"OpenCV", OpenCvCodes(tables, one, c.input, c.output)}};
      return c;
    });
  }
}

void RegisterTextures(const Options& options, int width, int height) {
  for (const int size : {1024, 4096}) {
    for (const bool smooth : {true, false}) {
      for (const int channels : {1, 4}) {
        for (const bool cubic : {false, true}) {
          const std::string task = std::to_string(size) + "^2 " + (smooth ? "swirl" : "random") + " " +
                                   std::to_string(channels) + "ch " + (cubic ? "cubic" : "linear");
          Register("lookup", task, PixelType::kFloat, width, height, options, {""}, {"OpenCV"}, [=] {
            LookupCase c{task, Coordinates(width, height, smooth), {}, {}, {}, {}};
            c.output = Image(ImageSpec(width, height, channels));
            const Image texture = Noise(size, size, channels);
            c.nodes = {{"", Lookup(FromImage(c.input), FromImage(texture), {},
                                   {.filter = cubic ? TableFilter::kCubic : TableFilter::kLinear})}};
            c.peers = {{"OpenCV", OpenCvRemap(texture, cubic, c.input, c.output)}};
            return c;
          });
        }
      }
    }
  }
}

void RegisterInks(const Options& options, int width, int height) {
  for (const bool photo : {false, true}) {
    const std::string task = std::string("CMYK 17^4 ") + (photo ? "photo" : "random");
    Register(
        "lookup", task, PixelType::kFloat, width, height, options, {" linear", " simplex"}, {"Little CMS"},
        [=] {
          LookupCase c{
              task,
              photo ? Photo(width, height, PixelType::kFloat) : MakeInput(width, height, PixelType::kFloat, 3),
              {},
              {},
              {},
              Inks};
          for (int y = 0; photo && y < height; ++y) {
            for (int x = 0; x < width; ++x) c.input.at<float>(x, y, 3) = 0.5f * c.input.at<float>(x, y, 1);
          }
          c.output = Image(ImageSpec(width, height, 3));
          const Table table =
              TableFromFunction(Inks, {.sizes = {17, 17, 17, 17}, .channels = 3, .probes = 1}).table;
          c.nodes = {{" linear", Lookup(FromImage(c.input), table)},
                     {" simplex", Lookup(FromImage(c.input), table, {.filter = TableFilter::kTetrahedral})}};
          c.peers = {{"Little CMS", LcmsInks(table, c.input, c.output)}};
          return c;
        });
  }
}

void RegisterErrors(const Options& options, int width, int height) {
  const std::pair<const char*, TableFilter> filters[] = {{"nearest", TableFilter::kNearest},
                                                         {"linear", TableFilter::kLinear},
                                                         {"tetrahedral", TableFilter::kTetrahedral},
                                                         {"cubic", TableFilter::kCubic}};
  const std::pair<const char*, void (*)(const double*, double*)> functions[] = {
      {"display transform", DisplayTransform}, {"tone map with a knee", Knee}, {"fog table", Fog}};
  Options best = options;
  best.targets.resize(1);
  for (const auto& [name, f] : functions) {
    std::vector<std::string> suffixes;
    for (const auto& [filter_name, filter] : filters) {
      for (const int size : {17, 33, 65, 129}) {
        for (const PixelType storage : {PixelType::kFloat, PixelType::kHalf, PixelType::kUint16}) {
          suffixes.push_back(std::string(" ") + filter_name + " " + std::to_string(size) + " " +
                             PixelTypeName(storage));
        }
      }
    }
    Register("tables", name, PixelType::kFloat, width, height, best, suffixes, {}, [=, f = f, name = name] {
      LookupCase c{
          name, MakeInput(width, height, PixelType::kFloat, 3), Image(ImageSpec(width, height, 4)), {}, {},
          f};
      for (const int size : {17, 33, 65, 129}) {
        const Table table =
            TableFromFunction(f, {.sizes = {size, size, size}, .channels = 3, .probes = 1}).table;
        for (const PixelType storage : {PixelType::kFloat, PixelType::kHalf, PixelType::kUint16}) {
          const Table stored = table.WithStorage(storage);
          for (const auto& [filter_name, filter] : filters) {
            c.nodes.emplace_back(
                std::string(" ") + filter_name + " " + std::to_string(size) + " " + PixelTypeName(storage),
                ApplyTable3D(FromImage(c.input), stored, {.filter = filter}));
          }
        }
      }
      return c;
    });
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  try {
    const Options options = ParseOptions(&argc, argv);
    for (const Options::Size& size : options.sizes) {
      const int width = size.width > 0 ? size.width : 3840, height = size.height > 0 ? size.height : 2160;
      RegisterCubes(options, width, height);
      RegisterCurves(options, width, height);
      RegisterTextures(options, width, height);
      RegisterInks(options, width, height);
    }
    // Forty-eight tables for each function: a smaller picture tells as much.
    RegisterErrors(options, 960, 540);
    return RunRegistered(&argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_lookup: error: %s\n", error.what());
    return 1;
  }
}
