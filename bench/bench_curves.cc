// Curves by formula and a camera-to-display pipeline of tables against OpenColorIO and the C library's
// functions. Nanoseconds per element are a third of those per pixel (a quarter for powc): curves leave alpha
// alone.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "harness.h"

namespace {

namespace fs = std::filesystem;

// A folder for the LUT files, which goes away.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("tessera_bench_" + std::to_string(std::random_device{}()))) {
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  std::string File(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

// 4096 entries of a curve.
template <class F>
void WriteTable(const std::string& file, F curve) {
  std::ofstream out(file);
  out.precision(9);
  out << "Version 1\nFrom 0 1\nLength 4096\nComponents 1\n{\n";
  for (int i = 0; i < 4096; ++i) out << curve(i / 4095.0) << '\n';
  out << "}\n";
}

// A filmic cube with crosstalk.
void WriteCube(const std::string& file, int size) {
  std::ofstream out(file);
  out.precision(9);
  out << "LUT_3D_SIZE " << size << '\n';
  const auto tone = [](double v) { return v * (2.51 * v + 0.03) / (v * (2.43 * v + 0.59) + 0.14); };
  for (int b = 0; b < size; ++b) {
    for (int g = 0; g < size; ++g) {
      for (int r = 0; r < size; ++r) {
        const double x = r / (size - 1.0), y = g / (size - 1.0), z = b / (size - 1.0);
        out << tone(0.9 * x + 0.08 * y + 0.02 * z) << ' ' << tone(0.05 * x + 0.9 * y + 0.05 * z) << ' '
            << tone(0.02 * x + 0.1 * y + 0.88 * z) << '\n';
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](const Options& options) {
    static const Folder folder;  // till the last table was read
    const std::string decode = folder.File("decode.spi1d"), encode = folder.File("encode.spi1d");
    const std::string cube = folder.File("film.cube");
    WriteTable(decode, [](double v) { return (std::exp2(6 * v) - 1) / 63; });
    WriteTable(encode, [](double v) { return std::log2(1 + 63 * v) / 6; });
    WriteCube(cube, 33);
    const std::string matrix = "0.80,0.15,0.05,0,0.10,0.85,0.05,0,0.05,0.10,0.85,0,0,0,0,1";
    RegisterTask("curves",
                 MakeTask("1-D, matrix, 1-D, 33^3",
                          {{"lut", decode}, {"ccmatrix", matrix}, {"lut", encode}, {"lut", cube}}),
                 options, /*with_unfolded=*/false);
    for (const auto& [op, arguments] :
         std::vector<std::pair<std::string, std::string>>{{"powc", "2.2"},
                                                          {"powc", "0.45"},
                                                          {"curve", "gamma exponent=2.2"},
                                                          {"curve", "gamma exponent=2.2 inverse=1"},
                                                          {"curve", "srgb"},
                                                          {"curve", "srgb inverse=1"},
                                                          {"curve", "rec709"},
                                                          {"curve", "rec709 inverse=1"},
                                                          {"curve", "log2"},
                                                          {"curve", "ln"},
                                                          {"curve", "log2 inverse=1"},
                                                          {"curve", "ln inverse=1"},
                                                          {"curve", "pq"},
                                                          {"curve", "pq inverse=1"},
                                                          {"curve", "hlg"},
                                                          {"curve", "hlg inverse=1"},
                                                          {"curve", "acescct"},
                                                          {"curve", "acescct inverse=1"},
                                                          {"curve", "logc3"},
                                                          {"curve", "logc3 inverse=1"},
                                                          {"curve", "logc4"},
                                                          {"curve", "logc4 inverse=1"},
                                                          {"curve", "slog3"},
                                                          {"curve", "slog3 inverse=1"},
                                                          {"curve", "vlog"},
                                                          {"curve", "log3g10"},
                                                          {"curve", "log3g10 inverse=1"},
                                                          {"curve", "cineon"},
                                                          {"curve", "cineon inverse=1"}}) {
      RegisterTask("curves", MakeTask(op + " " + arguments, {{op, arguments}}), options,
                   /*with_unfolded=*/false);
    }
  });
}
