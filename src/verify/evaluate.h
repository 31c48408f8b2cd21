// The reference engine: a graph evaluated operation by operation in double, without fusion or optimisation.
#ifndef TESSERA_VERIFY_EVALUATE_H_
#define TESSERA_VERIFY_EVALUATE_H_

#include <chrono>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "graph/op.h"
#include "reference/reference.h"
#include "tessera/node.h"
#include "verify/propagate.h"

namespace tessera::verify {

class ReferenceEngine {
 public:
  // `bound_u` of an operation by name: its bound in units of 2^-24 times the reference's scale.
  using BoundFunction = double (*)(const std::string& op);
  explicit ReferenceEngine(BoundFunction bound) : bound_(bound) {}

  // Evaluates a region inside the node's data window. Throws Error for an operation without a reference.
  Evaluated Evaluate(const Node& node, const Roi& roi);

  // Evaluations end with OutOfTime soon after that time, where they consist of several steps.
  struct OutOfTime {};
  void SetDeadline(std::chrono::steady_clock::time_point deadline) { deadline_ = deadline; }

  // How many pixels of all images on the way an evaluation of the region takes.
  static double Work(const Node& node, const Roi& roi);

  // What is to be known about the references that were used.
  const std::set<std::string>& remarks() const { return remarks_; }

 private:
  Evaluated Shared(const Node& node, const Roi& roi);
  Evaluated EvaluateNode(const Node& node, const Roi& roi);
  Evaluated EvaluateOp(const Node& node, const Roi& roi);
  const Evaluated& Reduced(const Node& node, const reference::Entry& entry);
  void ReduceErrors(const Node& input, const reference::Entry& entry, reference::ImageD& error) const;
  double Largest(const Node& node);
  void Run(const reference::Entry& entry, const reference::Call& call) const;

  BoundFunction bound_;
  std::map<const graph::NodeData*, Evaluated> reduced_;
  std::map<const graph::NodeData*, double> largest_;
  // Regions of shared nodes, for one call of Evaluate: a graph of diamonds is not evaluated exponentially
  // often.
  using Key = std::tuple<const graph::NodeData*, int, int, int, int>;
  std::map<Key, Evaluated> shared_;
  std::map<const graph::NodeData*, Evaluated> whole_;
  std::set<std::string> remarks_;
  bool values_only_ = false;
  std::chrono::steady_clock::time_point deadline_ = std::chrono::steady_clock::time_point::max();
};

}  // namespace tessera::verify

#endif  // TESSERA_VERIFY_EVALUATE_H_
