// Walks a graph with the reference functions and compares pixels with the result.
#include "oracle.h"

#include <algorithm>
#include <cmath>

#include "graph/op.h"
#include "graph/source.h"
#include "task.h"
#include "tessera/error.h"

namespace tessera::bench {
namespace {

using reference::ImageD;

ImageD FromSource(const graph::SourceOp& op, const Roi& roi) {
  const auto view = op.source().View();
  if (!view) throw Error(op.Describe(), "found pixels in a file, expected them in memory");
  ImageD out(roi, view->channels);
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      for (int c = 0; c < view->channels; ++c) out.at(x, y, c) = Decode(view->At(x, y, c), view->type);
    }
  }
  return out;
}

// Copies what `in` has of out's region; the rest stays zero.
void CopyChannel(const ImageD& in, int from, ImageD& out, int to) {
  const Roi both = Intersection(in.roi, out.roi);
  for (int y = both.y0; y < both.y1; ++y) {
    for (int x = both.x0; x < both.x1; ++x) out.at(x, y, to) = in.at(x, y, from);
  }
}

double Statistic(const Node& input, const graph::StatisticRequest& request) {
  const Roi window = input.spec().data_window;
  long double sum = 0;
  int64_t count = 0;
  for (int y = window.y0; y < window.y1; y += 64) {
    const ImageD band = Reference(input, {window.x0, y, window.x1, std::min(y + 64, window.y1)});
    for (size_t i = 0; i < band.samples.size(); i += band.channels) {
      double v = 0;
      for (int c = 0; c < std::min(3, band.channels); ++c) v += request.weights[c] * band.samples[i + c];
      if (std::isfinite(v)) sum += v, ++count;
    }
  }
  return count ? static_cast<double>(sum / count) : std::nan("");
}

}  // namespace

ImageD Reference(const Node& node, const Roi& roi) {
  const graph::NodeData& data = *node.data();
  const graph::Op& op = *data.op;
  if (op.Kind() == graph::OpKind::kSource) return FromSource(dynamic_cast<const graph::SourceOp&>(op), roi);

  std::vector<ImageSpec> specs;
  for (const Node& input : data.inputs) specs.push_back(input.spec());
  const reference::Entry* entry = reference::Find(op.Name());
  std::vector<ImageD> in;
  for (size_t k = 0; k < data.inputs.size(); ++k) {
    Roi need = roi;
    if (entry && entry->input_roi) need = entry->input_roi(op.Parameters(), static_cast<int>(k), roi);
    in.push_back(Reference(data.inputs[k], Intersection(need, specs[k].data_window)));
  }
  ImageD out(roi, node.spec().channel_count());
  if (op.Kind() == graph::OpKind::kShuffle) {
    const std::vector<graph::ChannelRef> map = op.ChannelMap(specs);
    for (int c = 0; c < out.channels; ++c) {
      if (map[c].input >= 0) {
        CopyChannel(in[map[c].input], map[c].channel, out, c);
      } else {
        for (size_t i = c; i < out.samples.size(); i += out.channels) out.samples[i] = map[c].value;
      }
    }
  } else if (op.Kind() == graph::OpKind::kCrop) {
    for (int c = 0; c < out.channels; ++c) CopyChannel(in[0], c, out, c);
  } else {
    if (!entry) throw Error(op.Name(), "found no reference function, expected one");
    std::vector<double> statistics;
    for (const graph::StatisticRequest& request : op.Statistics()) {
      statistics.push_back(Statistic(data.inputs[request.input], request));
    }
    entry->evaluate({op.Parameters(), in, specs, node.spec(), statistics, out, nullptr});
  }
  return out;
}

bool NeedsStatistics(const Node& node) {
  if (!node.data()->op->Statistics().empty()) return true;
  return std::any_of(node.data()->inputs.begin(), node.data()->inputs.end(), NeedsStatistics);
}

Oracle::Oracle(const Node& node, int bands, int rows_per_band) {
  const Roi window = node.spec().data_window;
  const int rows = std::min(rows_per_band, window.height());
  bands = std::max(1, std::min(bands, window.height() / std::max(1, rows)));
  for (int i = 0; i < bands; ++i) {
    const int last = window.height() - rows;
    const int y = window.y0 + (bands > 1 ? static_cast<int>(int64_t{last} * i / (bands - 1)) : 0);
    bands_.push_back(Reference(node, {window.x0, y, window.x1, y + rows}));
  }
}

Errors Oracle::Compare(const ConstImageView& pixels) const {
  Errors errors;
  const bool integer = pixels.type == PixelType::kUint8 || pixels.type == PixelType::kUint16;
  const double codes = pixels.type == PixelType::kUint8 ? 255 : 65535;
  double squares = 0;
  for (const ImageD& band : bands_) {
    for (int y = band.roi.y0; y < band.roi.y1; ++y) {
      for (int x = band.roi.x0; x < band.roi.x1; ++x) {
        for (int c = 0; c < band.channels; ++c) {
          double exact = band.at(x, y, c);
          const double found = Decode(pixels.At(x, y, c), pixels.type);
          if (integer) exact = std::isnan(exact) ? 0 : std::clamp(exact, 0.0, 1.0);
          if (!std::isfinite(exact) || !std::isfinite(found)) {
            const bool same = exact == found || (std::isnan(exact) && std::isnan(found));
            errors.not_finite += same ? 0 : 1;
            continue;
          }
          const double error = std::abs(found - exact);
          errors.max = std::max(errors.max, error);
          squares += error * error;
          ++errors.values;
          if (integer) {
            const double code = exact * codes;
            const int difference = std::abs(static_cast<int>(std::lrint(found * codes) - std::lrint(code)));
            const bool tie = std::abs(code - std::floor(code) - 0.5) <= 0x1p-12;
            errors.max_code_error = std::max(errors.max_code_error, difference);
            if (difference > (tie ? 1 : 0)) ++errors.wrong_codes;
          }
        }
      }
    }
  }
  errors.rms = errors.values ? std::sqrt(squares / static_cast<double>(errors.values)) : 0;
  return errors;
}

}  // namespace tessera::bench
