// Line integral convolution against rlic and a plain scalar loop: time and grey-level error on one field,
// then a table of integrators and steps on five. With TESSERA_RLIC=FILE the peer is rlic's own loop in a
// shared library that exports rlic_convolve_f32(texture, u, v, width, height, kernel, taps, out); without,
// the scalar loop alone.
#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "contest.h"
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

// What peers are given: separate components, a texture equal to ours, weights of 1 / number.
struct PeerInput {
  PeerInput(const Image& field, int t)
      : size(field.spec().width()),
        taps(t),
        texture(Render(Lic(FromImage(field), {.length = 0}))),
        kernel(static_cast<size_t>(2 * t + 1), 1.0f / static_cast<float>(2 * t + 1)) {
    const auto* v = reinterpret_cast<const float*>(field.view().data);
    for (int64_t i = 0; i < int64_t{size} * size; ++i) u.push_back(v[2 * i]), w.push_back(v[2 * i + 1]);
  }
  const float* noise() const { return reinterpret_cast<const float*>(texture.view().data); }
  size_t Index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(size) + static_cast<size_t>(x);
  }
  int size, taps;
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

// The same model, one pixel after the other.
float Line(const PeerInput& in, int x, int y, float sign) {
  float fx = 0.5f, fy = 0.5f, sum = 0;
  for (int i = 0; i < in.taps; ++i) {
    const float u = sign * in.u[in.Index(x, y)], v = sign * in.w[in.Index(x, y)];
    const float tx = u > 0 ? (1 - fx) / u : u < 0 ? -fx / u : INFINITY;
    const float ty = v > 0 ? (1 - fy) / v : v < 0 ? -fy / v : INFINITY;
    if (tx < ty) {
      x = std::clamp(x + (u > 0 ? 1 : -1), 0, in.size - 1), fx = u > 0 ? 0.0f : 1.0f, fy += tx * v;
    } else if (ty < INFINITY) {
      y = std::clamp(y + (v > 0 ? 1 : -1), 0, in.size - 1), fy = v > 0 ? 0.0f : 1.0f, fx += ty * u;
    }
    sum += in.noise()[in.Index(x, y)];
  }
  return sum;
}
void ScalarLic(const PeerInput& in, float* out) {
  for (int y = 0; y < in.size; ++y) {
    for (int x = 0; x < in.size; ++x) {
      const float sum = in.noise()[in.Index(x, y)] + Line(in, x, y, 1) + Line(in, x, y, -1);
      *out++ = sum / static_cast<float>(2 * in.taps + 1);
    }
  }
}

struct Case {
  std::string flow;
  int size, taps, threads;
  bool linear = false;  // the texture between its pixels; the sampling that shared lines are meant for
};

// All contestants of a case; errors are grey levels against exact lines.
void RegisterCase(const Case& c, const Options& options) {
  struct Way {
    const char* name;
    LicIntegrator integrator;
    LicMethod method;
  };
  std::vector<Way> ways = {{"adaptive", LicIntegrator::kAdaptive, LicMethod::kDirect},
                           {"shared lines", LicIntegrator::kAdaptive, LicMethod::kShared}};
  if (!c.linear) {
    ways.push_back({"pixel crossing", LicIntegrator::kCell, LicMethod::kDirect});
    ways.push_back({"rk4", LicIntegrator::kRk4, LicMethod::kDirect});
    ways.push_back({"euler", LicIntegrator::kEuler, LicMethod::kDirect});
  }
  ContestNames names{"lic",   c.flow + " L=" + std::to_string(c.taps) + (c.linear ? " linear" : ""),
                     "float", c.size,
                     c.size,  c.threads,
                     {},      {}};
  for (const Way& way : ways) names.ways.emplace_back(way.name);
  const RlicConvolve rlic = LoadRlic();
  if (c.threads == 1 && rlic != nullptr) names.peers.emplace_back("rlic");
  if (c.threads == 1) names.peers.emplace_back("scalar C++");
  RegisterContest(names, options, [=] {
    Contest contest;
    contest.output = Image(ImageSpec(c.size, c.size, 1));
    contest.oracle_bands = 6;
    const Image field = FieldOf(Flows().at(c.flow), c.size);
    for (const Way& way : ways) {
      LicParams p{
          .length = double(c.taps), .method = way.method, .contrast = LicContrast::kNone, .linear = c.linear};
      p.integrator = way.integrator;
      contest.ways.push_back({way.name, Lic(FromImage(field), p)});
    }
    const auto in = std::make_shared<PeerInput>(field, c.taps);
    auto* const out = reinterpret_cast<float*>(contest.output.view().data);
    if (rlic != nullptr) {
      contest.peers.push_back({"rlic", [=] {
                                 const auto size = static_cast<size_t>(in->size);
                                 rlic(in->noise(), in->u.data(), in->w.data(), size, size, in->kernel.data(),
                                      in->kernel.size(), out);
                               }});
    }
    contest.peers.push_back({"scalar C++", [=] { ScalarLic(*in, out); }});
    if (c.threads > 1) contest.peers.clear();
    return contest;
  });
}

// End point after `length` pixels from a pixel's centre, of the flow itself or of its samples between which
// it is bilinear: by steps halved until third and fourth order agree, and ended where it turns round within
// the smallest of them, which is a sink.
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
  constexpr double kLongest = 1.0 / 16, kLeast = 1.0 / (1 << 16), kAgree = 1e-9;
  double h = kLongest;
  for (double left = length; left > 0;) {
    h = std::min(h, left);
    const Point a = velocity(at), b = velocity({at.x + h / 2 * a.x, at.y + h / 2 * a.y});
    const Point c = velocity({at.x + h / 2 * b.x, at.y + h / 2 * b.y}),
                d = velocity({at.x + h * c.x, at.y + h * c.y});
    const Point end{at.x + h / 6 * (a.x + 2 * b.x + 2 * c.x + d.x),
                    at.y + h / 6 * (a.y + 2 * b.y + 2 * c.y + d.y)};
    const Point last = velocity(end);
    if (h > kLeast && h / 6 * std::hypot(d.x - last.x, d.y - last.y) > kAgree) {
      h /= 2;
      continue;
    }
    if (h <= kLeast && a.x * b.x + a.y * b.y < 0) return at;
    at = end, left -= h;
    h = std::min(2 * h, kLongest);
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
  const auto flag = [&](const char* name) {  // taken out of argv
    char** const end =
        std::remove_if(argv + 1, argv + argc, [=](char* a) { return std::strcmp(a, name) == 0; });
    const bool given = end != argv + argc;
    argc = static_cast<int>(end - argv);
    return given;
  };
  const bool quick = flag("--quick"), table = flag("--table");
  if (table) {
    PrintTable(512, 100);
    return 0;
  }
  return RunSuite(argc, argv, [quick](const Options& options) {
    const int size = quick ? 256 : 1024;
    RegisterCase({"swirl", size, 20, 1}, options);
    RegisterCase({"swirl", size, 20, 1, true}, options);
    if (quick) return;
    for (const int taps : {10, 100}) {
      for (const bool linear : {false, true}) RegisterCase({"swirl", size, taps, 1, linear}, options);
    }
    RegisterCase({"rough", size, 20, 1}, options);
    RegisterCase({"cellular", size, 20, 1}, options);
    RegisterCase({"swirl", size, 20, 2}, options);
    RegisterCase({"swirl", 512, 10, 2}, options);  // the paper's picture: 20 steps, 10 each way
  });
}
