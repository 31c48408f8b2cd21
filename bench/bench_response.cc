// How soon an evaluation answers, family by family: the time to the first call of its progress callback, the
// time from a refusal by the callback to the end, and the longest time between two calls. One line for each
// family, of the largest in each column. With --regions, how soon the first 256x256 pixels of ten operations
// are there instead.
//   bench_response [--size WxH] [--all] [--op NAME]
//   bench_response --regions [--size WxH]
#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>

#include "task.h"
#include "tessera/error.h"
#include "tessera/prepared_graph.h"
#include "tessera/render.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

double Since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Answers {
  double first = 0, gap = 0, cancel = 0, whole = 0;
};

// From the callback's first refusal, `after` seconds from the start, to the end.
double CancelTime(const Node& node, const ImageView& out, RenderOptions options, double after) {
  const Clock::time_point start = Clock::now();
  Clock::time_point refused = start;
  bool once = false;
  options.progress = [&](double) {
    if (Since(start) < after) return true;
    if (!once) refused = Clock::now();
    once = true;
    return false;
  };
  try {
    RenderInto(node, out, options);
  } catch (const Cancelled&) {
    return Since(refused);
  }
  return 0;  // done before it was asked
}

Answers Measure(const Task& task, const std::vector<Image>& pictures, const RenderOptions& given) {
  std::vector<Node> nodes;
  for (int k = 0; k < task.inputs(); ++k) {
    const auto index = static_cast<size_t>(k);
    nodes.push_back(FromImage(pictures[index % pictures.size()]));
  }
  ImageSpec spec = pictures[0].spec();
  const Node node = task.Build(nodes, spec);
  ImageSpec result = node.spec();
  result.type = PixelType::kFloat;
  Answers answers;
  if (result.data_window.empty() || result.data_window.pixels() > 4 * spec.data_window.pixels())
    return answers;
  const Image image(result);
  RenderOptions options = given;
  const Clock::time_point start = Clock::now();
  Clock::time_point last = start;
  bool any = false;
  options.progress = [&](double) {
    const double gap = std::chrono::duration<double>(Clock::now() - last).count();
    last = Clock::now();
    if (!any) answers.first = gap;
    any = true;
    answers.gap = std::max(answers.gap, gap);
    return true;
  };
  RenderInto(node, image.view(), options);
  answers.whole = Since(start);
  for (const double share : {0.0, 0.1, 0.5, 0.9})
    answers.cancel = std::max(answers.cancel, CancelTime(node, image.view(), options, share * answers.whole));
  return answers;
}

// Medians over nine places, by RenderInto and from a prepared graph, and the first of all from a new one.
void MeasureRegions(const Image& picture) {
  const std::vector<std::pair<std::string, std::string>> points = {{"mulc", "1.1,1.05,0.95,1"},
                                                                   {"addc", "0.01"},
                                                                   {"saturate", "1.3"},
                                                                   {"hue", "30"},
                                                                   {"brightness", "0.9"},
                                                                   {"powc", "1.1"},
                                                                   {"saturate", "0.8"},
                                                                   {"mulc", "0.9,1,1.1,1"},
                                                                   {"hue", "-20"},
                                                                   {"clamp", ""}};
  auto windows = points;
  windows[2] = {"blur", "5"};
  windows[6] = {"median", "3x3"};
  const auto median = [](std::vector<double> times) {
    std::nth_element(times.begin(), times.begin() + 4, times.end());
    return 1e3 * times[4];
  };
  std::printf("%-34s %12s %12s %12s %12s\n", "256x256 of ten operations, ms", "render", "prepare", "first",
              "others");
  for (const auto& [name, chain] : {std::pair{"points", points}, {"points, blur 5x5, median 3x3", windows}}) {
    const Task task = MakeTask(name, chain);
    const Node node = task.Build({FromImage(picture)}, picture.spec());
    const Image tile(ImageSpec(256, 256, picture.spec().channel_count()));
    const auto at = [&](int k) {
      const Roi& w = picture.spec().data_window;
      ImageView view = tile.view();
      const int x = (w.width() - 256) / 10 * (k + 1), y = (w.height() - 256) / 10 * (k + 1);
      view.roi = {x, y, x + 256, y + 256};
      return view;
    };
    std::vector<double> rendered, asked, prepared_in, first;
    for (int k = 0; k < 9; ++k) {
      Clock::time_point start = Clock::now();
      RenderInto(node, at(k));
      rendered.push_back(Since(start));
      start = Clock::now();
      const PreparedGraph prepared(node);
      prepared_in.push_back(Since(start));
      start = Clock::now();
      prepared.RenderInto(at(k));
      first.push_back(Since(start));
      start = Clock::now();
      prepared.RenderInto(at(8 - k));
      asked.push_back(Since(start));
    }
    std::printf("%-34s %12.2f %12.2f %12.2f %12.2f\n", name, median(rendered), median(prepared_in),
                median(first), median(asked));
  }
}

int Main(const std::vector<std::string>& words) {
  int width = 4000, height = 3000;
  bool all = false, regions = false;
  std::string only;
  RenderOptions options;
  for (size_t k = 0; k < words.size(); ++k) {
    const bool more = k + 1 < words.size();
    if (words[k] == "--all") {
      all = true;
    } else if (words[k] == "--regions") {
      regions = true;
    } else if (words[k] == "--size" && more) {
      std::sscanf(words[++k].c_str(), "%dx%d", &width, &height);
    } else if (words[k] == "--op" && more) {
      only = words[++k];
    } else {
      std::cerr << "bench_response: found " << words[k] << ", expected --regions, --size, --all or --op\n";
      return 2;
    }
  }
  std::vector<Image> pictures;
  for (uint64_t seed = 1; seed <= 3; ++seed)
    pictures.push_back(MakeInput(width, height, PixelType::kFloat, seed, Content::kPhoto));

  if (regions) {
    MeasureRegions(pictures[0]);
    return 0;
  }

  struct Worst {
    Answers answers;
    std::map<std::string, std::string> op;
  };
  std::map<std::string, Worst> families;
  const auto line = [](const std::string& name, const Answers& a, const std::string& remark) {
    std::printf("%-14s %9.1f %9.1f %9.1f %9.2f  %s\n", name.c_str(), 1e3 * a.first, 1e3 * a.gap,
                1e3 * a.cancel, a.whole, remark.c_str());
    std::fflush(stdout);
  };
  std::printf("%dx%d RGBA floats\n%-14s %9s %9s %9s %9s  slowest to cancel\n", width, height, "", "first/ms",
              "gap/ms", "cancel/ms", "whole/s");
  for (const ops::OpInfo& op : ops::Registry()) {
    if (!only.empty() && only != op.name) continue;
    for (const std::string& example : op.examples) {
      try {
        const Answers a = Measure(MakeTask(op.name, {{op.name, example}}), pictures, options);
        const std::string words = op.name + " " + example;
        if (all || !only.empty()) line(op.name, a, example);
        Worst& worst = families[op.family];
        if (a.cancel >= worst.answers.cancel) worst.op["cancel"] = words;
        worst.answers.first = std::max(worst.answers.first, a.first);
        worst.answers.gap = std::max(worst.answers.gap, a.gap);
        worst.answers.cancel = std::max(worst.answers.cancel, a.cancel);
        worst.answers.whole = std::max(worst.answers.whole, a.whole);
      } catch (const Error& e) {
        if (all) std::printf("%-14s %s\n", op.name.c_str(), e.what());
      }
      if (!all && only.empty()) break;  // the typical one
    }
  }
  std::printf("\n");
  for (const auto& [family, worst] : families) line(family, worst.answers, worst.op.at("cancel"));
  return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) { return tessera::bench::Main({argv + 1, argv + argc}); }
