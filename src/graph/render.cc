// Evaluation: statistics first, then the plan over tiles or bands.
#include "graph/render.h"

#include <chrono>
#include <cmath>
#include <limits>

#include "graph/executor.h"
#include "graph/plan.h"
#include "graph/statistics.h"

namespace tessera {
namespace graph {
namespace {

class PassTimer {
 public:
  PassTimer(RunStats* stats, std::string name) : stats_(stats), name_(std::move(name)) {}
  void Stop(int64_t pixels, int64_t bytes) {
    if (stats_ == nullptr) return;
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start_;
    stats_->passes.push_back({name_, took.count(), pixels, bytes});
  }

 private:
  RunStats* stats_;
  std::string name_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

bool AllResident(const Plan& plan) {
  for (const PlannedSource& s : plan.sources) {
    if (!s.source->View()) return false;
  }
  return true;
}

// Runs the whole plan; one of `out` and `sink`.
void Evaluate(const Node& node, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink,
              const RenderOptions& options, RunStats* stats) {
  const auto statistic = [&](const Node& input, const StatisticRequest& request) {
    PassTimer timer(stats, "mean");
    MeanSink mean(request.weights);
    RenderOptions quiet = options;
    quiet.progress = nullptr;
    const Node color = ColorOf(input);
    Evaluate(color, color.spec().data_window, PixelType::kFloat, nullptr, &mean, quiet, nullptr);
    timer.Stop(input.spec().data_window.pixels(), input.spec().data_window.pixels() * 12);
    return mean.Mean();
  };
  const Plan plan = MakePlan(node, options.optimize, statistic);
  PassTimer timer(stats, sink != nullptr ? "stream" : "render");
  if (out != nullptr && AllResident(plan)) {
    RunResident(plan, *out, options);
  } else {
    RunBands(plan, roi, type, out, sink, options);
  }
  timer.Stop(roi.pixels(), BytesMoved(plan, roi, type));
}

}  // namespace

void RenderToSink(const Node& node, PixelType type, RowSink& sink, const RenderOptions& options, RunStats* stats) {
  Evaluate(node, node.spec().data_window, type, nullptr, &sink, options, stats);
}

}  // namespace graph

Image Render(const Node& node, PixelType type, const RenderOptions& options, RunStats* stats) {
  ImageSpec spec = node.spec();
  spec.type = type;
  Image image(std::move(spec));
  RenderInto(node, image.view(), options, stats);
  return image;
}

void RenderInto(const Node& node, const ImageView& out, const RenderOptions& options, RunStats* stats) {
  const ImageSpec& spec = node.spec();
  if (!spec.data_window.Contains(out.roi)) throw Error("render", "the region reaches outside the image's data window");
  if (out.channels != spec.channel_count()) {
    throw Error("render", "the output has " + std::to_string(out.channels) + " channels, expected " +
                              std::to_string(spec.channel_count()));
  }
  graph::Evaluate(node, out.roi, out.type, &out, nullptr, options, stats);
}

}  // namespace tessera
