// Line integral convolution against rlic and a plain scalar loop: time and grey-level error on one field,
// then a table of integrators and steps on five. With TESSERA_RLIC=FILE the peer is rlic's own loop in a
// shared library that exports rlic_convolve_f32(texture, u, v, width, height, kernel, taps, out); without,
// the scalar loop alone.
#include <benchmark/benchmark.h>
#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "copy.h"
#include "harness.h"
#include "tessera/error.h"
#include "tessera/ops/flow.h"
#include "tessera/render.h"

namespace tessera::bench {
namespace {

struct Point {
  double x = 0, y = 0;
};
using Flow = std::function<Point(Point)>;

// In shares of the picture, from 0 to 1 both ways.
const std::map<std::string, Flow>& Flows() {
  static const std::map<std::string, Flow> kFlows = {
      {"circle",
       [](Point p) {
         return Point{-(p.y - 0.5), p.x - 0.5};
       }},
      {"swirl",
       [](Point p) {
         return Point{0.5 - p.y + 0.3 * std::sin(6 * p.x), p.x - 0.5 + 0.3 * std::cos(5 * p.y)};
       }},
      {"saddle",
       [](Point p) {
         return Point{p.x - 0.5, 0.5 - p.y};
       }},
      {"spiral",
       [](Point p) {
         return Point{0.5 - p.y - 0.2 * (p.x - 0.5), p.x - 0.5 - 0.2 * (p.y - 0.5)};
       }},
      {"cellular",
       [](Point p) {
         const double k = 8 * std::numbers::pi;
         return Point{std::sin(k * p.x) * std::cos(k * p.y), -std::cos(k * p.x) * std::sin(k * p.y)};
       }},
      {"rough", [](Point p) {  // changes within every pixel
         const double a = 1e4 * std::sin(12.9898e3 * p.x + 78.233e3 * p.y);
         return Point{std::cos(a), std::sin(a)};
       }}};
  return kFlows;
}

Image FieldOf(const Flow& flow, int size) {
  const Image image(ImageSpec(size, size, 2));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Point v = flow({(x + 0.5) / size, (y + 0.5) / size});
      image.at<float>(x, y, 0) = static_cast<float>(v.x), image.at<float>(x, y, 1) = static_cast<float>(v.y);
    }
  }
  return image;
}

class OursContestant final : public Contestant {
 public:
  OursContestant(std::string name, const Frame& frame, const LicParams& params, int threads)
      : name_(std::move(name)),
        frame_(frame),
        node_(Lic(FromImage(frame.inputs[0]), params)),
        threads_(threads) {}
  std::string Name() const override { return "tessera " + name_; }
  void Run() override { RenderInto(node_, frame_.output.view(), {.threads = threads_}); }

 private:
  std::string name_;
  const Frame& frame_;
  Node node_;
  int threads_;
};

class CopyContestant final : public Contestant {
 public:
  explicit CopyContestant(const Frame& frame) : frame_(frame), from_(frame.output.spec()) {}
  std::string Name() const override { return "copy streaming"; }
  void Run() override {
    CopyStreaming(from_.view().data, frame_.output.view().data,
                  static_cast<size_t>(frame_.pixels()) * sizeof(float));
  }
  bool IsCopy() const override { return true; }

 private:
  const Frame& frame_;
  Image from_;
};

// What peers are given: separate components, a texture equal to ours, weights of 1 / number.
struct PeerInput {
  PeerInput(const Frame& frame, int taps)
      : kernel(static_cast<size_t>(2 * taps + 1), 1.0f / static_cast<float>(2 * taps + 1)) {
    texture = Render(Lic(FromImage(frame.inputs[0]), {.length = 0}));
    const auto* v = reinterpret_cast<const float*>(frame.inputs[0].view().data);
    for (int64_t i = 0; i < frame.pixels(); ++i) u.push_back(v[2 * i]), w.push_back(v[2 * i + 1]);
  }
  const float* noise() const { return reinterpret_cast<const float*>(texture.view().data); }
  Image texture;
  std::vector<float> u, w, kernel;
};

using RlicConvolve = void (*)(const float*, const float*, const float*, size_t, size_t, const float*, size_t,
                              float*);
RlicConvolve LoadRlic() {
  const char* const file = std::getenv("TESSERA_RLIC");
  void* const library = file == nullptr ? nullptr : dlopen(file, RTLD_NOW);
  if (file != nullptr && library == nullptr) throw Error(file, "cannot be loaded");
  return library == nullptr ? nullptr : reinterpret_cast<RlicConvolve>(dlsym(library, "rlic_convolve_f32"));
}

class RlicContestant final : public Contestant {
 public:
  RlicContestant(RlicConvolve convolve, const Frame& frame, int taps)
      : convolve_(convolve), frame_(frame), in_(frame, taps) {}
  std::string Name() const override { return "rlic"; }
  void Run() override {
    convolve_(in_.noise(), in_.u.data(), in_.w.data(), static_cast<size_t>(frame_.width),
              static_cast<size_t>(frame_.height), in_.kernel.data(), in_.kernel.size(),
              reinterpret_cast<float*>(frame_.output.view().data));
  }

 private:
  RlicConvolve convolve_;
  const Frame& frame_;
  PeerInput in_;
};

// The same model, one pixel after the other.
class ScalarContestant final : public Contestant {
 public:
  ScalarContestant(const Frame& frame, int taps) : frame_(frame), in_(frame, taps), taps_(taps) {}
  std::string Name() const override { return "scalar C++"; }
  void Run() override {
    auto* out = reinterpret_cast<float*>(frame_.output.view().data);
    for (int y = 0; y < frame_.height; ++y) {
      for (int x = 0; x < frame_.width; ++x) {
        float sum = in_.noise()[Index(x, y)];
        for (const float sign : {1.0f, -1.0f}) sum += Line(x, y, sign);
        *out++ = sum / static_cast<float>(2 * taps_ + 1);
      }
    }
  }

 private:
  size_t Index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(frame_.width) + static_cast<size_t>(x);
  }
  float Line(int x, int y, float sign) const {
    float fx = 0.5f, fy = 0.5f, sum = 0;
    for (int i = 0; i < taps_; ++i) {
      const float u = sign * in_.u[Index(x, y)], v = sign * in_.w[Index(x, y)];
      const float tx = u > 0 ? (1 - fx) / u : u < 0 ? -fx / u : INFINITY;
      const float ty = v > 0 ? (1 - fy) / v : v < 0 ? -fy / v : INFINITY;
      if (tx < ty) {
        x = std::clamp(x + (u > 0 ? 1 : -1), 0, frame_.width - 1), fx = u > 0 ? 0.0f : 1.0f, fy += tx * v;
      } else if (ty < INFINITY) {
        y = std::clamp(y + (v > 0 ? 1 : -1), 0, frame_.height - 1), fy = v > 0 ? 0.0f : 1.0f, fx += ty * u;
      }
      sum += in_.noise()[Index(x, y)];
    }
    return sum;
  }

  const Frame& frame_;
  PeerInput in_;
  int taps_;
};

struct Case {
  std::string flow;
  int size, taps, threads;
  bool linear = false;  // the texture between its pixels; the sampling that shared lines are meant for
  std::string Name() const {
    return "lic/" + flow + " L=" + std::to_string(taps) + (linear ? " linear" : "") + "/float/" +
           std::to_string(size) + "x" + std::to_string(size) + "/threads:" + std::to_string(threads) + "/";
  }
};

// All contestants of a case, measured together; errors are grey levels against exact lines.
std::vector<Measured> MeasureCase(const Case& c, int repetitions) {
  Frame frame;
  frame.width = frame.height = c.size;
  frame.inputs.push_back(FieldOf(Flows().at(c.flow), c.size));
  frame.output = Image(ImageSpec(c.size, c.size, 1));
  const LicParams exact{.length = double(c.taps), .method = LicMethod::kDirect, .linear = c.linear};
  std::vector<std::unique_ptr<Contestant>> all;
  all.push_back(std::make_unique<CopyContestant>(frame));
  const auto ours = [&](const char* name, LicIntegrator integrator, LicMethod method) {
    LicParams p = exact;
    p.integrator = integrator, p.method = method;
    all.push_back(std::make_unique<OursContestant>(name, frame, p, c.threads));
  };
  ours("adaptive", LicIntegrator::kAdaptive, LicMethod::kDirect);
  ours("shared lines", LicIntegrator::kAdaptive, LicMethod::kShared);
  if (!c.linear) {
    ours("pixel crossing", LicIntegrator::kCell, LicMethod::kDirect);
    ours("rk4", LicIntegrator::kRk4, LicMethod::kDirect);
    ours("euler", LicIntegrator::kEuler, LicMethod::kDirect);
  }
  if (c.threads == 1) {
    if (const RlicConvolve rlic = LoadRlic())
      all.push_back(std::make_unique<RlicContestant>(rlic, frame, c.taps));
    all.push_back(std::make_unique<ScalarContestant>(frame, c.taps));
  }
  const Oracle oracle(Lic(FromImage(frame.inputs[0]), exact), 6, 2);
  return Measure(std::move(all), frame, oracle, repetitions);
}

void RunCase(const Case& c, int repetitions) {
  const std::vector<Measured> measured = MeasureCase(c, repetitions);
  const double pixels = double(c.size) * c.size;
  double copy = 1;
  for (const Measured& m : measured) {
    if (m.is_copy) copy = Median(m.seconds);
  }
  for (const Measured& m : measured) {
    const double seconds = Median(m.seconds), least = *std::min_element(m.seconds.begin(), m.seconds.end());
    benchmark::RegisterBenchmark((c.Name() + m.name).c_str(),
                                 [=](benchmark::State& state) {
                                   for (auto _ : state) state.SetIterationTime(seconds);
                                   state.counters["ns_per_pixel"] = 1e9 * seconds / pixels;
                                   state.counters["ns_per_pixel_min"] = 1e9 * least / pixels;
                                   state.counters["times_copy"] = seconds / copy;
                                   state.counters["repetitions"] = static_cast<double>(m.seconds.size());
                                   if (m.is_copy) return;
                                   state.counters["copy_share"] = copy / seconds;
                                   state.counters["max_error"] = m.errors.max;
                                   state.counters["rms_error"] = m.errors.rms;
                                   state.counters["values_checked"] = static_cast<double>(m.errors.values);
                                 })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
}

// End point after `length` pixels from a pixel's centre, in steps of 1/16, of the flow itself or of its
// samples between which it is bilinear.
Point Exact(const Flow& flow, const Image* samples, Point at, double length, int size) {
  const auto velocity = [&](Point p) {
    Point v;
    if (samples == nullptr) {
      v = flow({(p.x + 0.5) / size, (p.y + 0.5) / size});
    } else {
      const int x = std::clamp(static_cast<int>(std::floor(p.x)), 0, size - 2);
      const int y = std::clamp(static_cast<int>(std::floor(p.y)), 0, size - 2);
      const auto mix = [&](int c) {
        const auto s = [&](int i, int j) { return double{samples->at<float>(x + i, y + j, c)}; };
        const double tx = p.x - x, ty = p.y - y;
        return (1 - ty) * ((1 - tx) * s(0, 0) + tx * s(1, 0)) + ty * ((1 - tx) * s(0, 1) + tx * s(1, 1));
      };
      v = {mix(0), mix(1)};
    }
    const double n = std::hypot(v.x, v.y);
    return n > 0 ? Point{v.x / n, v.y / n} : Point{};
  };
  const double h = 1.0 / 16;
  for (int i = 0; i < static_cast<int>(length / h + 0.5); ++i) {
    const Point a = velocity(at), b = velocity({at.x + h / 2 * a.x, at.y + h / 2 * a.y});
    const Point c = velocity({at.x + h / 2 * b.x, at.y + h / 2 * b.y}),
                d = velocity({at.x + h * c.x, at.y + h * c.y});
    at = {at.x + h / 6 * (a.x + 2 * b.x + 2 * c.x + d.x), at.y + h / 6 * (a.y + 2 * b.y + 2 * c.y + d.y)};
  }
  return at;
}

// Integrator and step against end-point error (mean, 99 % and maximum over a grid of pixels) and against time
// on one thread, of two channels taken between the texture's pixels.
void PrintTable(int size, double length) {
  const Image coordinates(ImageSpec(size, size, 2));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      coordinates.at<float>(x, y, 0) = static_cast<float>(x - size / 2);
      coordinates.at<float>(x, y, 1) = static_cast<float>(y - size / 2);
    }
  }
  const std::pair<const char*, LicIntegrator> integrators[] = {{"euler", LicIntegrator::kEuler},
                                                               {"midpoint", LicIntegrator::kMidpoint},
                                                               {"rk4", LicIntegrator::kRk4},
                                                               {"adaptive", LicIntegrator::kAdaptive}};
  std::printf(
      "| field | integrator | step | sampled: mean / 99 %% / max px | analytic: mean px "
      "| ns per pixel |\n|---|---|---|---|---|---|\n");
  for (const char* name : {"circle", "swirl", "saddle", "spiral", "cellular"}) {
    const Flow& flow = Flows().at(name);
    const Image field = FieldOf(flow, size);
    std::vector<Point> starts, sampled, analytic;
    const int margin = static_cast<int>(length) + 4;
    for (int y = margin; y < size - margin; y += 23) {
      for (int x = margin; x < size - margin; x += 23) {
        const Point at{double(x), double(y)};
        starts.push_back(at);
        sampled.push_back(Exact(flow, &field, at, length, size)),
            analytic.push_back(Exact(flow, nullptr, at, length, size));
      }
    }
    for (const auto& [label, integrator] : integrators) {
      for (const double step : {1.0, 0.5, 0.25}) {
        LicParams p{.length = length,
                    .step = step,
                    .integrator = integrator,
                    .kernel = LicKernel::kUser,
                    .method = LicMethod::kDirect,
                    .linear = true};
        p.weights.assign(static_cast<size_t>(2 * std::lround(length / step) + 1), 0.0);
        p.weights.back() = 1;
        const Node lines = Lic(FromImage(coordinates), FromImage(field), p);
        const auto start = std::chrono::steady_clock::now();
        const Image end = Render(lines, PixelType::kFloat, {.threads = 1});
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
        std::vector<double> errors;
        double mean = 0, against_flow = 0;
        for (size_t i = 0; i < starts.size(); ++i) {
          const int x = static_cast<int>(starts[i].x), y = static_cast<int>(starts[i].y);
          const Point got{end.at<float>(x, y, 0) + size / 2.0, end.at<float>(x, y, 1) + size / 2.0};
          errors.push_back(std::hypot(got.x - sampled[i].x, got.y - sampled[i].y));
          mean += errors.back(), against_flow += std::hypot(got.x - analytic[i].x, got.y - analytic[i].y);
        }
        std::sort(errors.begin(), errors.end());
        const auto n = static_cast<double>(errors.size());
        std::printf("| %s | %s | %g | %.1e / %.1e / %.1e | %.1e | %.0f |\n", name, label, step, mean / n,
                    errors[errors.size() * 99 / 100], errors.back(), against_flow / n,
                    taken.count() / (double(size) * size));
      }
    }
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  try {
    bool quick = false, table = false;
    int kept = 1;
    for (int i = 1; i < argc; ++i) {
      quick |= std::strcmp(argv[i], "--quick") == 0, table |= std::strcmp(argv[i], "--table") == 0;
      if (argv[i][0] == '-' && std::strncmp(argv[i], "--benchmark", 11) == 0) argv[kept++] = argv[i];
    }
    argc = kept;
    if (table) {
      PrintTable(512, 100);
      return 0;
    }
    const int size = quick ? 256 : 1024, repetitions = quick ? 5 : 15;
    RunCase({"swirl", size, 20, 1}, repetitions);
    RunCase({"swirl", size, 20, 1, true}, repetitions);
    if (!quick) {
      for (const int taps : {10, 100}) {
        for (const bool linear : {false, true}) RunCase({"swirl", size, taps, 1, linear}, repetitions);
      }
      RunCase({"rough", size, 20, 1}, repetitions);
      RunCase({"cellular", size, 20, 1}, repetitions);
      RunCase({"swirl", size, 20, 2}, repetitions);
      RunCase({"swirl", 512, 10, 2}, repetitions);  // the paper's picture: 20 steps, 10 each way
    }
    return RunRegistered(&argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_lic: error: %s\n", error.what());
    return 1;
  }
}
