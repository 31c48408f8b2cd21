// The mean of a weighted sum of colour channels, in double, with an order of summation that depends on the
// image alone.
#ifndef TESSERA_GRAPH_STATISTICS_H_
#define TESSERA_GRAPH_STATISTICS_H_

#include "graph/source.h"

namespace tessera::graph {

// The first three channels of a node.
Node ColorOf(const Node& node);

// Takes float RGB rows in order; pixels with a component that is not finite are left out.
class MeanSink final : public RowSink {
 public:
  explicit MeanSink(const double (&weights)[3]) : weights_{weights[0], weights[1], weights[2]} {}
  void Write(const ConstImageView& rows) override;
  // NaN when no pixel was finite.
  double Mean() const;

 private:
  // Every eighth column has a sum of its own: one alone would wait for itself.
  static constexpr int kSums = 8;

  double weights_[3];
  double sum_[kSums] = {}, lost_[kSums] = {};  // and what it lost in rounding
  int64_t count_ = 0;
};

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_STATISTICS_H_
