// One operation at a time, in double, beside the error that its bound allows.
#include "verify/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "base/border.h"
#include "graph/op.h"
#include "graph/source.h"
#include "graph/topology.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/render.h"
#include "verify/pixels.h"

namespace tessera::verify {
namespace {

using graph::NodeData;
using graph::OpKind;
using reference::ImageD;

constexpr double kU = 0x1p-24;
constexpr int64_t kMostKept = 1 << 24;  // pixels of an image that is kept for the next region

Evaluated Empty(const Roi& roi, int channels) { return {ImageD(roi, channels), ImageD(roi, channels), {}}; }

// Keeps out's jumps only where there are some.
void DropWithoutJumps(Evaluated& out) {
  const auto& all = out.jump.samples;
  if (std::none_of(all.begin(), all.end(), [](double v) { return v > 0; })) out.jump = {};
}

// Between operations samples are floats: what is beyond the largest is infinite, what may be is undecided.
void Overflow(Evaluated& out) {
  constexpr double kLargest = 0x1.ffffffp127;  // rounds to infinity
  for (size_t i = 0; i < out.value.samples.size(); ++i) {
    double &v = out.value.samples[i], &tolerance = out.tolerance.samples[i];
    const double size = std::fabs(v);
    if (!std::isfinite(v) || !(size + tolerance >= kLargest)) continue;
    const bool decided = size - tolerance >= kLargest;
    if (size >= kLargest) v = std::copysign(std::numeric_limits<double>::infinity(), v), tolerance = 0;
    if (decided) continue;
    if (out.jump.samples.empty()) out.jump = ImageD(out.value.roi, out.value.channels);
    out.jump.samples[i] = reference::kEndlessJump;
  }
}

// Calls f(x, y, c) for every sample.
template <typename F>
void ForEachSample(const ImageD& image, const F& f) {
  for (int y = image.roi.y0; y < image.roi.y1; ++y) {
    for (int x = image.roi.x0; x < image.roi.x1; ++x) {
      for (int c = 0; c < image.channels; ++c) f(x, y, c);
    }
  }
}

Evaluated Shuffle(const NodeData& d, std::span<const Evaluated> in, const Roi& roi) {
  std::vector<ImageSpec> specs;
  for (const Node& input : d.inputs) specs.push_back(input.spec());
  const std::vector<graph::ChannelRef> map = d.op->ChannelMap(specs);
  Evaluated out = Empty(roi, d.spec.channel_count());
  out.jump = ImageD(roi, d.spec.channel_count());
  ForEachSample(out.value, [&](int x, int y, int c) {
    const graph::ChannelRef& ref = map[static_cast<size_t>(c)];
    if (ref.input < 0) {
      out.value.at(x, y, c) = ref.value;
      return;
    }
    const Evaluated& from = in[static_cast<size_t>(ref.input)];
    out.value.at(x, y, c) = from.value.at(x, y, ref.channel);
    out.tolerance.at(x, y, c) = from.tolerance.at(x, y, ref.channel);
    out.jump.at(x, y, c) = from.JumpAt(x, y, ref.channel);
  });
  DropWithoutJumps(out);
  return out;
}

Evaluated Crop(const Evaluated& in, const Roi& roi, int channels) {
  Evaluated out = Empty(roi, channels);
  out.jump = ImageD(roi, channels);
  ForEachSample(out.value, [&](int x, int y, int c) {
    if (!in.value.roi.Contains({x, y, x + 1, y + 1})) return;
    out.value.at(x, y, c) = in.value.at(x, y, c);
    out.tolerance.at(x, y, c) = in.tolerance.at(x, y, c);
    out.jump.at(x, y, c) = in.JumpAt(x, y, c);
  });
  DropWithoutJumps(out);
  return out;
}

}  // namespace

// What the samples may be off by, reduced like they are. Of large images some bands are looked at, and
// believed to a quarter, since few samples may have most of the error.
void ReferenceEngine::ReduceErrors(const Node& input, const reference::Entry& entry, ImageD& error) const {
  constexpr int64_t kMostPixels = 1 << 14;
  constexpr int kRows = 8;
  const Roi& window = input.spec().data_window;
  const int64_t bands = (window.height() + kRows - 1) / kRows;
  const int64_t affordable =
      std::max<int64_t>(1, kMostPixels / std::max<int64_t>(1, kRows * int64_t{window.width()}));
  const int64_t step = (bands + affordable - 1) / affordable;
  ReferenceEngine errors(bound_);
  errors.SetDeadline(deadline_);
  const auto reduction = entry.reduction(input.spec());
  for (int64_t band = step / 2; band < bands; band += step) {
    const int y = window.y0 + static_cast<int>(band) * kRows;
    const Evaluated e = errors.Evaluate(input, {window.x0, y, window.x1, std::min(y + kRows, window.y1)});
    // What hangs on a decision may be off by its jump, or, where nobody knows it, by as much as there is.
    double most = 0;
    for (const double v : e.value.samples) most = std::isfinite(v) ? std::max(most, 2 * std::fabs(v)) : most;
    ImageD off = e.tolerance;
    for (size_t i = 0; i < off.samples.size(); ++i) {
      off.samples[i] += e.jump.samples.empty() ? 0 : std::min(e.jump.samples[i], most);
      if (!std::isfinite(off.samples[i])) off.samples[i] = 0;
    }
    reduction->Take(off);
  }
  reduction->Give(error, nullptr);
  for (double& v : error.samples) v = std::isfinite(v) ? (step > 1 ? 4 : 1) * v : 0;
}

const Evaluated& ReferenceEngine::Reduced(const Node& node, const reference::Entry& entry) {
  const auto it = reduced_.find(node.data());
  if (it != reduced_.end()) return it->second;
  const Node& input = node.data()->inputs[0];
  const Roi& window = input.spec().data_window;
  ReferenceEngine exact(bound_);
  exact.SetDeadline(deadline_);
  exact.values_only_ = true;
  const auto reduction = entry.reduction(input.spec());
  constexpr int kRows = 64;  // a band at a time bounds the memory
  for (int y = window.y0; y < window.y1; y += kRows)
    reduction->Take(exact.Evaluate(input, {window.x0, y, window.x1, std::min(y + kRows, window.y1)}).value);
  Evaluated out = Empty(node.spec().data_window, node.spec().channel_count());
  ImageD scale = out.value;
  reduction->Give(out.value, &scale);
  if (!values_only_) {
    ReduceErrors(input, entry, out.tolerance);
    const double bound = bound_(entry.op) * kU;
    for (size_t i = 0; i < scale.samples.size(); ++i) out.tolerance.samples[i] += bound * scale.samples[i];
  }
  Overflow(out);
  return reduced_.emplace(node.data(), std::move(out)).first->second;
}

// Calls the entry's function, at once or row by row, while there is time.
void ReferenceEngine::Run(const reference::Entry& entry, const reference::Call& call) const {
  const std::function<void()> check = [&] {
    if (std::chrono::steady_clock::now() > deadline_) throw OutOfTime();
  };
  check();
  if (!entry.by_rows) {
    return entry.evaluate({call.parameters, call.in, call.in_specs, call.out_spec, call.out, call.scale,
                           call.undecided, call.tolerances, call.largest, &check});
  }
  const Roi& roi = call.out.roi;
  const size_t samples = static_cast<size_t>(roi.width()) * static_cast<size_t>(call.out.channels);
  for (int y = roi.y0; y < roi.y1; ++y) {
    check();
    ImageD row({roi.x0, y, roi.x1, y + 1}, call.out.channels), scale = row, undecided = row;
    entry.evaluate({call.parameters, call.in, call.in_specs, call.out_spec, row,
                    call.scale != nullptr ? &scale : nullptr,
                    call.undecided != nullptr ? &undecided : nullptr, call.tolerances, call.largest});
    const size_t at = static_cast<size_t>(y - roi.y0) * samples;
    const auto put = [&](const ImageD& from, ImageD* to) {
      if (to != nullptr) std::copy(from.samples.begin(), from.samples.end(), to->samples.begin() + at);
    };
    put(row, &call.out), put(scale, call.scale), put(undecided, call.undecided);
  }
}

// Found by the engine, which is quick, and believed as far as the reference agrees at that very sample.
double ReferenceEngine::Largest(const Node& node) {
  const auto it = largest_.find(node.data());
  if (it != largest_.end()) return it->second;
  const Roi& window = node.spec().data_window;
  const int channels = node.spec().channel_count();
  constexpr int64_t kSamples = int64_t{1} << 22;  // a band at a time bounds the memory
  const int64_t row = std::max<int64_t>(1, int64_t{window.width()} * channels);
  const auto rows = static_cast<int>(std::clamp<int64_t>(kSamples / row, 1, std::max(1, window.height())));
  double largest = 0;
  int at_x = window.x0, at_y = window.y0, at_c = 0;
  for (int top = window.y0; top < window.y1; top += rows) {
    if (std::chrono::steady_clock::now() > deadline_) throw OutOfTime();
    ImageSpec spec = node.spec();
    spec.type = PixelType::kFloat;
    spec.data_window = {window.x0, top, window.x1, std::min(top + rows, window.y1)};
    const Image band(spec);
    RenderInto(node, band.view());
    for (int y = top; y < spec.data_window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x) {
        for (int c = 0; c < channels; ++c) {
          const double v = std::fabs(double{band.at<float>(x, y, c)});
          if (std::isfinite(v) && v > largest) largest = v, at_x = x, at_y = y, at_c = c;
        }
      }
    }
  }
  if (largest > 0) {
    ReferenceEngine exact(bound_);
    exact.values_only_ = true;
    const double there =
        std::fabs(exact.Evaluate(node, {at_x, at_y, at_x + 1, at_y + 1}).value.at(at_x, at_y, at_c));
    if (!(largest <= 1.01 * there + 1e-30)) largest = there;
  }
  return largest_[node.data()] = largest;
}

double ReferenceEngine::Work(const Node& node, const Roi& roi) {
  const std::vector<Node> order = graph::TopologicalOrder(node);
  std::unordered_map<const NodeData*, Roi> wanted{{node.data(), roi}};
  double pixels = 0;
  for (auto it = order.rbegin(); it != order.rend(); ++it) {
    const NodeData& d = *it->data();
    const Roi own = wanted[&d];
    pixels += static_cast<double>(own.width()) * own.height();
    const reference::Entry* const entry = reference::Find(d.op->Name());
    for (size_t k = 0; k < d.inputs.size(); ++k) {
      if (entry != nullptr && entry->reduction != nullptr) continue;  // once, and for all regions
      const ImageSpec& in = d.inputs[k].spec();
      const Roi from =
          entry == nullptr ? own : entry->InputRoi(d.op->Parameters(), static_cast<int>(k), in, own);
      Roi& all = wanted[d.inputs[k].data()];
      all = Union(all, Intersection(from, in.data_window));
    }
  }
  return pixels;
}

Evaluated ReferenceEngine::Evaluate(const Node& node, const Roi& roi) {
  shared_.clear();
  return EvaluateNode(node, roi);
}

Evaluated ReferenceEngine::Shared(const Node& node, const Roi& roi) {
  // Whole images, which gathers ask for, are asked for again by the next region.
  if (roi == node.spec().data_window && roi.pixels() <= kMostKept) {
    const auto it = whole_.find(node.data());
    if (it != whole_.end()) return it->second;
    return whole_.emplace(node.data(), EvaluateNode(node, roi)).first->second;
  }
  if (node.shared().use_count() <= 1) return EvaluateNode(node, roi);
  const Key key{node.data(), roi.x0, roi.y0, roi.x1, roi.y1};
  const auto it = shared_.find(key);
  if (it != shared_.end()) return it->second;
  return shared_.emplace(key, EvaluateNode(node, roi)).first->second;
}

Evaluated ReferenceEngine::EvaluateNode(const Node& node, const Roi& roi) {
  const NodeData& d = *node.data();
  if (d.op->Kind() == OpKind::kSource) {
    Evaluated out = Empty(roi, d.spec.channel_count());
    ReadExact(static_cast<const graph::SourceOp&>(*d.op).source(), out.value);
    if (d.spec.type == PixelType::kUint8 || d.spec.type == PixelType::kUint16) {  // unpacking rounds once
      ForEachSample(out.value,
                    [&](int x, int y, int c) { out.tolerance.at(x, y, c) = kU * out.value.at(x, y, c); });
    }
    return out;
  }
  if (d.op->Kind() == OpKind::kCrop) {
    const Roi inside = Intersection(roi, d.inputs[0].spec().data_window);
    return Crop(Shared(d.inputs[0], inside), roi, d.spec.channel_count());
  }
  return EvaluateOp(node, roi);
}

Evaluated ReferenceEngine::EvaluateOp(const Node& node, const Roi& roi) {
  const NodeData& d = *node.data();
  const reference::Entry* entry = reference::Find(d.op->Name());
  if (entry == nullptr && d.op->Kind() != OpKind::kShuffle) {
    throw DataError(d.op->Name(), "has no reference function, so it cannot be verified");
  }
  if (entry != nullptr && !entry->remark.empty()) remarks_.insert(entry->remark);
  if (entry != nullptr && entry->reduction != nullptr) {
    Evaluated whole = Reduced(node, *entry);
    return roi == whole.value.roi ? whole : Empty(roi, d.spec.channel_count());
  }
  std::vector<Evaluated> in;
  std::vector<ImageSpec> specs;
  for (size_t k = 0; k < d.inputs.size(); ++k) {
    const ImageSpec& spec = d.inputs[k].spec();
    Roi wanted = roi;
    if (entry != nullptr && entry->input_roi != nullptr) {
      wanted =
          Intersection(entry->InputRoi(d.op->Parameters(), static_cast<int>(k), spec, roi), spec.data_window);
    }
    in.push_back(Shared(d.inputs[k], wanted));
    specs.push_back(spec);
  }
  if (d.op->Kind() == OpKind::kShuffle) return Shuffle(d, in, roi);

  Evaluated out = Empty(roi, d.spec.channel_count());
  std::vector<ImageD> values, tolerances;
  for (const Evaluated& e : in) values.push_back(e.value);
  if (values_only_) {
    Run(*entry, {d.op->Parameters(), values, specs, d.spec, out.value, nullptr});
    return out;
  }
  for (const Evaluated& e : in) tolerances.push_back(e.tolerance);
  std::vector<double> largest(in.size());
  for (size_t k = 0; k < in.size() && entry->wants_largest != nullptr; ++k) {
    if (entry->wants_largest(d.op->Parameters(), static_cast<int>(k))) largest[k] = Largest(d.inputs[k]);
  }
  ImageD scale(roi, d.spec.channel_count());
  out.jump = scale;
  Run(*entry, {d.op->Parameters(), values, specs, d.spec, out.value, &scale, &out.jump, tolerances, largest});
  DropWithoutJumps(out);
  const double bound = bound_(d.op->Name()) * kU;
  // What is infinite is that exactly, or hangs on a decision.
  ForEachSample(out.value, [&](int x, int y, int c) {
    out.tolerance.at(x, y, c) = std::isfinite(out.value.at(x, y, c)) ? bound * scale.at(x, y, c) : 0;
  });

  Operation operation;
  operation.evaluate = [&](std::span<const ImageD> from, ImageD& result) {
    Run(*entry, {d.op->Parameters(), from, specs, d.spec, result, nullptr});
  };
  operation.neighbours = entry->input_roi != nullptr || entry->sized_roi != nullptr;
  operation.separate_channels = d.op->Kind() == OpKind::kChannel;
  for (size_t k = 0; k < in.size(); ++k) {
    PassErrors(operation, in, k, (entry->weighted_sum_of >> k & 1) != 0, out);
  }
  Overflow(out);
  return out;
}

}  // namespace tessera::verify
