// The C library's functions in a plain loop, as a program without a colour library writes it.
#include <cmath>
#include <functional>

#include "contestant.h"
#include "peers/peers.h"
#include "workers.h"

namespace tessera::bench {
namespace {

// One sample of a curve, or null when the loop has no form of it.
using Function = float (*)(float, float);

float Power(float v, float exponent) { return std::pow(v, exponent); }
float Srgb(float v, float) { return v < 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f; }
float SrgbInverse(float v, float) {
  return v < 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}
float LogOf2(float v, float) { return std::log2(v); }
float LogOfE(float v, float) { return std::log(v); }
float ExpOf2(float v, float) { return std::exp2(v); }
float ExpOfE(float v, float) { return std::exp(v); }
float Pq(float v, float) {
  const float u = std::pow(v, 0.1593017578125f);
  return std::pow((0.8359375f + 18.8515625f * u) / (1 + 18.6875f * u), 78.84375f);
}

Function FunctionOf(const Step& step) {
  if (step.op() == "powc") return Power;
  if (step.op() != "curve") return nullptr;
  const std::string& name = step.arguments.Text("NAME");
  const bool inverse = step.arguments.Flag("inverse");
  if (name == "srgb") return inverse ? SrgbInverse : Srgb;
  if (name == "log2") return inverse ? ExpOf2 : LogOf2;
  if (name == "ln") return inverse ? ExpOfE : LogOfE;
  if (name == "gamma") return Power;
  return name == "pq" && !inverse ? Pq : nullptr;
}

class Libm final : public Contestant {
 public:
  Libm(const Setting& setting, Function function)
      : function_(function),
        from_(setting.frame.inputs[0].view()),
        to_(setting.frame.output.view()),
        workers_(setting.threads) {
    const Step& step = setting.task.steps[0];
    colors_only_ = step.op() == "curve";
    if (step.op() == "powc") {
      exponent_ = static_cast<float>(step.Positional(0)[0]);
    } else if (step.arguments.Text("NAME") == "gamma") {
      const double exponent = step.arguments.Number("exponent");
      exponent_ = static_cast<float>(step.arguments.Flag("inverse") ? exponent : 1 / exponent);
    }
  }
  std::string Name() const override { return "C library"; }
  void Run() override {
    workers_.Run([this](int i) {
      const int height = from_.roi.height();
      for (int y = height * i / workers_.count(); y < height * (i + 1) / workers_.count(); ++y) {
        const auto* in = reinterpret_cast<const float*>(from_.At(0, y));
        auto* out = reinterpret_cast<float*>(to_.At(0, y));
        for (int x = 0; x < from_.roi.width(); ++x, in += 4, out += 4) {
          for (int c = 0; c < 3; ++c) out[c] = function_(in[c], exponent_);
          out[3] = colors_only_ ? in[3] : function_(in[3], exponent_);
        }
      }
    });
  }

 private:
  Function function_;
  ImageView from_, to_;
  Workers workers_;
  float exponent_ = 1;
  bool colors_only_ = true;
};

}  // namespace

std::unique_ptr<Contestant> MakeLibm(const Setting& setting) {
  const Task& task = setting.task;
  if (!setting.frame.plain() || setting.frame.type != PixelType::kFloat || task.steps.size() != 1)
    return nullptr;
  const Function function = FunctionOf(task.steps[0]);
  return function == nullptr ? nullptr : std::make_unique<Libm>(setting, function);
}

}  // namespace tessera::bench
