// A saved graph rendered by several callers at once, from C++: what bench/python holds Python's calls
// against.
//
//   graph_calls GRAPH.json PIXELS WIDTH HEIGHT CHANNELS CALLERS CALLS
//
// PIXELS is a file of 32-bit floats without a header, the graph's one open input. Every caller is a thread
// that renders the graph CALLS times with one thread of the engine into pixels of its own, as Python's
// threads do. A first call of each is not timed. Prints seconds of the clock and of CPU, and a sum of the
// last result's bytes.
#include <sys/resource.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tessera/graph_json.h"
#include "tessera/image.h"
#include "tessera/render.h"

namespace {

double ProcessorSeconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

std::vector<float> SamplesOf(const char* file, size_t count) {
  std::vector<float> samples(count);
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(samples.data()), static_cast<std::streamsize>(4 * count));
  if (!in) throw std::runtime_error(std::string(file) + ": too short for its pixels");
  return samples;
}

int Run(char** words) {
  std::ifstream file(words[1], std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const int callers = std::atoi(words[6]), calls = std::atoi(words[7]);
  const int width = std::atoi(words[3]), height = std::atoi(words[4]), channels = std::atoi(words[5]);
  const std::vector<float> samples = SamplesOf(
      words[2], static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels));
  const tessera::ImageSpec spec(width, height, channels);
  const tessera::ConstImageView pixels(reinterpret_cast<const std::byte*>(samples.data()), spec.data_window,
                                       channels, tessera::PixelType::kFloat);
  const std::string name = tessera::GraphInputs(text).at(0);
  std::vector<tessera::Image> results(static_cast<size_t>(callers));
  const auto all = [&](int times) {
    std::vector<std::thread> threads;
    for (int k = 0; k < callers; ++k) {
      threads.emplace_back([&, k] {
        tessera::RenderOptions options;
        options.threads = 1;
        for (int i = 0; i < times; ++i) {
          const tessera::Node graph = tessera::FromJson(text, {{name, tessera::FromView(pixels, spec)}});
          results[static_cast<size_t>(k)] = {};  // no two results of one caller at a time
          results[static_cast<size_t>(k)] = tessera::Render(graph, tessera::PixelType::kFloat, options);
        }
      });
    }
    for (std::thread& t : threads) t.join();
  };
  all(1);
  const double processor = ProcessorSeconds();
  const auto begin = std::chrono::steady_clock::now();
  all(calls);
  const double clock = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const tessera::ConstImageView last = results.back().view();
  uint64_t sum = 0;
  for (int y = last.roi.y0; y < last.roi.y1; ++y) {
    const auto* row = reinterpret_cast<const uint8_t*>(last.At(last.roi.x0, y));
    for (ptrdiff_t i = 0; i < ptrdiff_t{last.roi.width()} * last.channels * 4; ++i) sum += row[i];
  }
  std::printf("%.6f %.6f %llu\n", clock, ProcessorSeconds() - processor,
              static_cast<unsigned long long>(sum));
  return 0;
}

}  // namespace

int main(int count, char** words) {
  if (count != 8) {
    std::fprintf(stderr, "usage: graph_calls GRAPH.json PIXELS WIDTH HEIGHT CHANNELS CALLERS CALLS\n");
    return 2;
  }
  try {
    return Run(words);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "graph_calls: error: %s\n", error.what());
    return 1;
  }
}
