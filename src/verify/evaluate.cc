// One operation at a time, in double, beside the error that its bound allows.
#include "verify/evaluate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <unordered_map>
#include <utility>

#include "graph/border.h"
#include "graph/op.h"
#include "graph/source.h"
#include "graph/topology.h"
#include "tessera/error.h"
#include "verify/pixels.h"

namespace tessera::verify {
namespace {

using graph::NodeData;
using graph::OpKind;
using reference::ImageD;

constexpr double kU = 0x1p-24;

Evaluated Empty(const Roi& roi, int channels) { return {ImageD(roi, channels), ImageD(roi, channels)}; }

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
  ForEachSample(out.value, [&](int x, int y, int c) {
    const graph::ChannelRef& ref = map[static_cast<size_t>(c)];
    if (ref.input < 0) {
      out.value.at(x, y, c) = ref.value;
      return;
    }
    const Evaluated& from = in[static_cast<size_t>(ref.input)];
    out.value.at(x, y, c) = from.value.at(x, y, ref.channel);
    out.tolerance.at(x, y, c) = from.tolerance.at(x, y, ref.channel);
  });
  return out;
}

Evaluated Crop(const Evaluated& in, const Roi& roi, int channels) {
  Evaluated out = Empty(roi, channels);
  ForEachSample(out.value, [&](int x, int y, int c) {
    if (!in.value.roi.Contains({x, y, x + 1, y + 1})) return;
    out.value.at(x, y, c) = in.value.at(x, y, c);
    out.tolerance.at(x, y, c) = in.tolerance.at(x, y, c);
  });
  return out;
}

using CallFunction = std::function<void(ImageD& result, ImageD* scales)>;

// How an input's errors pass through a weighted sum: as the sum of |weight * tolerance|, which is its scale
// at those samples less what the other inputs and a bias contribute. `input` is the operation's; it is put
// back.
void AddWeighted(const ImageD& tolerance, ImageD& input, const CallFunction& call, Evaluated& out) {
  const Roi& roi = out.value.roi;
  ImageD result(roi, out.value.channels), with = result, without = result;
  const ImageD kept = input;
  input = tolerance;
  call(result, &with);
  input = ImageD(tolerance.roi, tolerance.channels);
  call(result, &without);
  input = kept;
  ForEachSample(with, [&](int x, int y, int c) {
    const double passed = with.at(x, y, c) - without.at(x, y, c);
    if (std::isfinite(passed)) out.tolerance.at(x, y, c) += std::max(0.0, passed);
  });
}

// The same for any operation: its response to inputs moved by their tolerances, each channel alone and either
// way, the larger effects added. Exact for affine operations, first order for the rest. Where neighbours take
// part their errors may have any signs: some sets of signs are tried as well, and the largest effect counts
// twice.
void AddResponses(const ImageD& tolerance, bool neighbours, ImageD& input, const CallFunction& call,
                  Evaluated& out) {
  const ImageD kept = input;
  const int sets = neighbours ? 8 : 2;
  for (int moved = 0; moved < tolerance.channels; ++moved) {
    ImageD largest(out.value.roi, out.value.channels), response = largest;
    bool any = false;
    for (int set = 0; set < sets; ++set) {
      ForEachSample(tolerance, [&](int x, int y, int c) {
        if (c != moved || !(tolerance.at(x, y, c) > 0)) return;
        any = true;
        uint32_t hash = static_cast<uint32_t>(x) * 0x9E3779B1u ^ static_cast<uint32_t>(y) * 0x85EBCA77u;
        hash = (hash ^ hash >> 15) * 0xC2B2AE3Du;
        const bool up = set < 2 ? set == 0 : (hash >> (set + 8) & 1) != 0;
        input.at(x, y, c) += up ? tolerance.at(x, y, c) : -tolerance.at(x, y, c);
      });
      if (any) call(response, nullptr);
      input = kept;
      if (!any) break;
      ForEachSample(largest, [&](int x, int y, int c) {
        const double change = std::fabs(response.at(x, y, c) - out.value.at(x, y, c));
        if (std::isfinite(change)) largest.at(x, y, c) = std::max(largest.at(x, y, c), change);
      });
    }
    if (!any) continue;
    ForEachSample(largest, [&](int x, int y, int c) {
      out.tolerance.at(x, y, c) += (neighbours ? 2 : 1) * largest.at(x, y, c);
    });
  }
}

}  // namespace

const std::vector<double>& ReferenceEngine::Statistics(const Node& node) {
  const auto it = statistics_.find(node.data());
  if (it != statistics_.end()) return it->second;
  std::vector<double> values;
  for (const graph::StatisticRequest& r : node.data()->op->Statistics()) {
    const Node& input = node.data()->inputs[static_cast<size_t>(r.input)];
    const Roi& window = input.spec().data_window;
    long double sum = 0;
    int64_t count = 0;
    constexpr int kRows = 64;  // a band at a time bounds the memory
    for (int y = window.y0; y < window.y1; y += kRows) {
      const Evaluated band = Evaluate(input, {window.x0, y, window.x1, std::min(y + kRows, window.y1)});
      for (int64_t i = 0; i < band.value.roi.pixels(); ++i) {
        const double* p = &band.value.samples[static_cast<size_t>(i * band.value.channels)];
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
        sum += static_cast<long double>(r.weights[0]) * p[0] + static_cast<long double>(r.weights[1]) * p[1] +
               static_cast<long double>(r.weights[2]) * p[2];
        ++count;
      }
    }
    values.push_back(count > 0 ? static_cast<double>(sum / count) : std::numeric_limits<double>::quiet_NaN());
  }
  return statistics_.emplace(node.data(), std::move(values)).first->second;
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
  // Nested calls (statistics) must not clear what their caller has gathered.
  std::map<Key, Evaluated> outer = std::exchange(shared_, {});
  Evaluated result = EvaluateNode(node, roi);
  shared_ = std::move(outer);
  return result;
}

Evaluated ReferenceEngine::Shared(const Node& node, const Roi& roi) {
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
    throw Error(d.op->Name(), "has no reference function, so it cannot be verified");
  }
  if (entry != nullptr && !entry->remark.empty()) remarks_.insert(entry->remark);
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
  ImageD scale(roi, d.spec.channel_count());
  std::vector<ImageD> values;
  for (const Evaluated& e : in) values.push_back(e.value);
  const std::vector<double>& statistics = Statistics(node);
  const auto call = [&](ImageD& result, ImageD* scales) {
    entry->evaluate({d.op->Parameters(), values, specs, d.spec, statistics, result, scales});
  };
  call(out.value, &scale);
  const double bound = bound_(d.op->Name()) * kU;
  ForEachSample(out.value,
                [&](int x, int y, int c) { out.tolerance.at(x, y, c) = bound * scale.at(x, y, c); });

  for (size_t k = 0; k < in.size(); ++k) {
    if ((entry->weighted_sum_of >> k & 1) != 0) {
      AddWeighted(in[k].tolerance, values[k], call, out);
    } else {
      AddResponses(in[k].tolerance, entry->input_roi != nullptr, values[k], call, out);
    }
  }
  return out;
}

}  // namespace tessera::verify
