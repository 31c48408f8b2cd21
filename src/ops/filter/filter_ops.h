// Registry rows of the filter family and the modifiers that they share.
#ifndef TESSERA_OPS_FILTER_FILTER_OPS_H_
#define TESSERA_OPS_FILTER_FILTER_OPS_H_

#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

OpInfo ConvolveInfo();
OpInfo BlurInfo();
OpInfo SobelInfo();
OpInfo EmbossInfo();
OpInfo LaplacianInfo();
OpInfo HighPassInfo();
OpInfo UnsharpInfo();
OpInfo MedianInfo();
OpInfo DilateInfo();
OpInfo ErodeInfo();
OpInfo MorphologyInfo();

// `:wrap=`, `:bordervalue=`, `:method=` and what they mean.
ParamInfo FilterWrapModifier();
// Throws Error for what no filter has.
void RequireFilterWrap(const std::string& op, Wrap wrap);
ParamInfo BorderValueModifier();
ParamInfo MethodModifier(std::vector<std::string> methods = {"auto", "direct", "separable", "lowrank",
                                                             "fft"});
// `:bits=`: 0, or the binary places of an accumulation buffer.
ParamInfo BufferBitsModifier();
FilterMethod MethodNamed(const std::string& name);
// `WxH` or `W`; throws Error(subject, ...) unless both are numbers in [1, 65535].
std::pair<double, double> ParseSize(const std::string& subject, const std::string& text);
// The argument SIZE in whole numbers; Error(op, ...) for others.
RankParams WindowSize(const std::string& op, const Arguments& a);
// An operation made of others: what those refuse is refused under its own name.
template <class F>
Node MadeOf(const std::string& op, F make) {
  try {
    return make();
  } catch (const Error& e) {
    const bool inner = e.subject() == "convolve" || e.subject() == "shiftaccum";
    ThrowAbout(inner ? op : e.subject(), e);
  }
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_FILTER_OPS_H_
