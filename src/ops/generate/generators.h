// What the generators share: their parameters' words and the check of the spec they fill.
#ifndef TESSERA_OPS_GENERATE_GENERATORS_H_
#define TESSERA_OPS_GENERATE_GENERATORS_H_

#include <string>

#include "graph/op.h"
#include "ops/registry.h"

namespace tessera::ops {

// An operation without inputs, the windows and channels of whose result are given.
template <typename P>
class GeneratorOp : public graph::OpWith<P> {
 public:
  GeneratorOp(const char* name, const ImageSpec& spec, P params)
      : graph::OpWith<P>(std::move(params)), name_(name), spec_(spec) {
    if (spec.channels.empty()) throw Error(name, "found no channels, expected at least one");
  }
  std::string Name() const final { return name_; }
  graph::OpKind Kind() const final { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const final { return spec_; }

 private:
  const char* name_;
  ImageSpec spec_;
};

inline OpInfo GeneratorRow(const char* name, const char* summary) {
  OpInfo info;
  info.name = name;
  info.family = "generate";
  info.generator = true;
  info.inputs = 0;
  info.summary = summary;
  return info;
}

ParamInfo ColorModifier(const char* name, const char* default_value, const char* help);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GENERATE_GENERATORS_H_
