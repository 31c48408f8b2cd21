// Tables against OpenColorIO, OpenCV and Little CMS, and speed against error for every filter, size and
// storage, so that a user sees which table to take for which error.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "contest.h"
#include "lookup_peers.h"
#include "lookup_pictures.h"
#include "peers/ocio_peer.h"
#include "tessera/ops/lookup.h"

namespace tessera::bench {
namespace {

// The output's distance from what a table was made from, evaluated at the coordinates: the methods' own error
// instead of their distance from the same interpolation in double.
Errors CompareWithFunction(const TableFunction& exact, const Image& input, const Image& output) {
  Errors errors;
  double sum = 0, at[4], want[4];
  const Roi& r = output.spec().data_window;
  const int in_channels = input.spec().channel_count(), channels = std::min(3, output.spec().channel_count());
  for (int y = r.y0; y < r.y1; y += 37) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int k = 0; k < std::min(4, in_channels); ++k)
        at[k] = Decode(input.view().At(x, y, k), input.spec().type);
      exact(at, want);
      for (int k = 0; k < channels; ++k) {
        const double error = std::fabs(Decode(output.view().At(x, y, k), output.spec().type) - want[k]);
        errors.max = std::max(errors.max, error);
        sum += error * error;
        ++errors.values;
      }
    }
  }
  errors.rms = std::sqrt(sum / static_cast<double>(errors.values));
  return errors;
}

void Register(const std::string& suite, const std::string& task, PixelType type, int width, int height,
              const Options& options, const std::vector<std::string>& ways,
              const std::vector<std::string>& peers, const std::function<Contest(int threads)>& make) {
  for (const int threads : options.threads) {
    RegisterContest({suite, task, PixelTypeName(type), width, height, threads, ways, peers}, options,
                    [make, threads] { return make(threads); });
  }
}

std::vector<std::string> OcioNames() {
  std::vector<std::string> names;
  for (const OcioVersion& version : OcioVersions()) names.push_back(version.name);
  return names;
}

void RegisterCubes(const Options& options, int width, int height) {
  for (const PixelType type : {PixelType::kFloat, PixelType::kUint8}) {
    for (const bool photo : {false, true}) {
      for (const TableFilter filter : {TableFilter::kTetrahedral, TableFilter::kLinear}) {
        const std::string task = std::string("33^3 ") +
                                 (filter == TableFilter::kLinear ? "trilinear " : "tetrahedral ") +
                                 (photo ? "photo" : "random");
        Register("lookup", task, type, width, height, options, {""}, OcioNames(), [=](int threads) {
          const Image input = photo ? Photo(width, height, type) : MakeInput(width, height, type, 3);
          Contest c;
          c.output = Image(ImageSpec(width, height, 4, type));
          const Table table =
              TableFromFunction(FilmColor, {.sizes = {33, 33, 33}, .channels = 3, .probes = 1}).table;
          c.ways = {{"", ApplyTable3D(FromImage(input), table, {.filter = filter})}};
          for (const OcioVersion& v : OcioVersions()) {
            c.peers.push_back(
                {v.name, v.cube(table, filter == TableFilter::kTetrahedral, input, c.output, threads)});
          }
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
    Register("lookup", task, PixelType::kFloat, width, height, options, {""}, OcioNames(), [=](int threads) {
      const PixelType type = PixelType::kFloat;
      const Image input = photo ? Photo(width, height, type) : MakeInput(width, height, type, 3);
      Contest c;
      c.output = Image(ImageSpec(width, height, 4, type));
      const Table table = gamma(4096);
      c.ways = {{"", ApplyTables1D(FromImage(input), {.tables = {table, table, table}})}};
      for (const OcioVersion& v : OcioVersions())
        c.peers.push_back({v.name, v.curve(table, input, c.output, threads)});
      return c;
    });
  }
  for (const bool one : {true, false}) {
    const std::string task = std::string("256 codes ") + (one ? "one table" : "per channel");
    Register("lookup", task, PixelType::kUint8, width, height, options, {""}, {"OpenCV"}, [=](int threads) {
      const Image input = MakeInput(width, height, PixelType::kUint8, 3);
      Contest c;
      c.output = Image(ImageSpec(width, height, 4, PixelType::kUint8));
      std::vector<Table> tables(4, gamma(256));
      if (!one)
        tables[1] = Table({2}, 1, std::vector<float>{1, 0}, TableAlign::kEnds),
        tables[3] = Table({2}, 1, std::vector<float>{0, 1}, TableAlign::kEnds);
      c.ways = {{"", ApplyTables1D(FromImage(input), {.tables = tables})}};
      c.peers = {{"OpenCV", OpenCvCodes(tables, one, input, c.output, threads)}};
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
          Register("lookup", task, PixelType::kFloat, width, height, options, {""}, {"OpenCV"},
                   [=](int threads) {
                     const Image input = Coordinates(width, height, smooth);
                     Contest c;
                     c.output = Image(ImageSpec(width, height, channels));
                     const Image texture = Noise(size, size, channels);
                     c.ways = {{"", Lookup(FromImage(input), FromImage(texture), {},
                                           {.filter = cubic ? TableFilter::kCubic : TableFilter::kLinear})}};
                     c.peers = {{"OpenCV", OpenCvRemap(texture, cubic, input, c.output, threads)}};
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
    Register("lookup", task, PixelType::kFloat, width, height, options, {"linear", "simplex"}, {"Little CMS"},
             [=](int threads) {
               const PixelType type = PixelType::kFloat;
               const Image input = photo ? Photo(width, height, type) : MakeInput(width, height, type, 3);
               Contest c;
               for (int y = 0; photo && y < height; ++y) {
                 for (int x = 0; x < width; ++x) input.at<float>(x, y, 3) = 0.5f * input.at<float>(x, y, 1);
               }
               c.output = Image(ImageSpec(width, height, 3));
               c.judge = [input, output = c.output] { return CompareWithFunction(Inks, input, output); };
               const Table table =
                   TableFromFunction(Inks, {.sizes = {17, 17, 17, 17}, .channels = 3, .probes = 1}).table;
               c.ways = {{"linear", Lookup(FromImage(input), table)},
                         {"simplex", Lookup(FromImage(input), table, {.filter = TableFilter::kTetrahedral})}};
               c.peers = {{"Little CMS", LcmsInks(table, input, c.output, threads)}};
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
  best.threads = {1};
  for (const auto& [name, f] : functions) {
    std::vector<std::string> ways;
    for (const auto& [filter_name, filter] : filters) {
      for (const int size : {17, 33, 65, 129}) {
        for (const PixelType storage : {PixelType::kFloat, PixelType::kHalf, PixelType::kUint16}) {
          ways.push_back(std::string(filter_name) + " " + std::to_string(size) + " " +
                         PixelTypeName(storage));
        }
      }
    }
    Register("tables", name, PixelType::kFloat, width, height, best, ways, {}, [=, f = f](int) {
      const Image input = MakeInput(width, height, PixelType::kFloat, 3);
      Contest c;
      c.output = Image(ImageSpec(width, height, 4));
      c.judge = [f, input, output = c.output] { return CompareWithFunction(f, input, output); };
      for (const int size : {17, 33, 65, 129}) {
        const Table table =
            TableFromFunction(f, {.sizes = {size, size, size}, .channels = 3, .probes = 1}).table;
        for (const PixelType storage : {PixelType::kFloat, PixelType::kHalf, PixelType::kUint16}) {
          const Table stored = table.WithStorage(storage);
          for (const auto& [filter_name, filter] : filters) {
            c.ways.push_back(
                {std::string(filter_name) + " " + std::to_string(size) + " " + PixelTypeName(storage),
                 ApplyTable3D(FromImage(input), stored, {.filter = filter})});
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
  return RunSuite(argc, argv, [](const Options& options) {
    for (const Options::Size& size : options.sizes) {
      const int width = size.width > 0 ? size.width : 3840, height = size.height > 0 ? size.height : 2160;
      RegisterCubes(options, width, height);
      RegisterCurves(options, width, height);
      RegisterTextures(options, width, height);
      RegisterInks(options, width, height);
    }
    // Forty-eight tables for each function: a smaller picture tells as much.
    RegisterErrors(options, 960, 540);
  });
}
