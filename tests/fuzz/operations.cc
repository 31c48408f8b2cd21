// The registry's words, and its operations on small pictures.
#include "fuzz/operations.h"

#include <cmath>
#include <limits>
#include <set>

#include "random/values.h"
#include "tessera/render.h"

namespace tessera::fuzz {

std::vector<std::string> RegistryWords() {
  std::set<std::string> words;
  for (const ops::OpInfo& op : ops::Registry()) {
    words.insert(op.name);
    for (const auto* params : {&op.arguments, &op.modifiers}) {
      for (const ops::ParamInfo& p : *params) {
        words.insert(p.name);
        words.insert(p.choices.begin(), p.choices.end());
        if (!p.default_value.empty()) words.insert(p.default_value);
      }
    }
    for (const std::string& example : op.examples) {
      const ops::Words parts = ops::SplitExample(op, example);
      words.insert(parts.positional.begin(), parts.positional.end());
      for (const auto& [key, value] : parts.modifiers) words.insert(value);
    }
  }
  words.erase("");
  return {words.begin(), words.end()};
}

std::vector<std::string> ExamplesOf(const std::string& parameter) {
  std::set<std::string> values;
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) {
      const ops::Words words = ops::SplitExample(op, example);
      for (size_t i = 0; i < words.positional.size() && i < op.arguments.size(); ++i) {
        if (op.arguments[i].name == parameter) values.insert(words.positional[i]);
      }
      for (const auto& [key, value] : words.modifiers) {
        if (key == parameter) values.insert(value);
      }
    }
  }
  return {values.begin(), values.end()};
}

Node SmallPicture(int channels) {
  constexpr float kOdd[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -1e30f, 1e-40f, -0.0f};
  const Image image(ImageSpec(9, 7, channels));
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 9; ++x) {
      for (int c = 0; c < channels; ++c) {
        const int i = (y * 9 + x) * channels + c;
        image.at<float>(x, y, c) =
            i % 41 == 7 ? kOdd[i / 41 % 5] : static_cast<float>(i * 37 % 64) / 48 - 0.1f;
      }
    }
  }
  return FromImage(image);
}

void RenderSmall(const Node& node) {
  constexpr int64_t kMostSamples = 40000;
  const ImageSpec& spec = node.spec();
  const Roi& w = spec.data_window;
  if (static_cast<double>(int64_t{w.x1} - w.x0) * static_cast<double>(int64_t{w.y1} - w.y0) *
          spec.channel_count() >
      kMostSamples)
    return;
  Render(node, PixelType::kFloat, {.threads = 1, .memory_budget = size_t{1} << 27});
}

void ApplyTo(const std::string& operation, const std::vector<std::string>& positional,
             const Modifiers& modifiers) {
  const ops::OpInfo& op = *ops::FindOp(operation);
  const ops::Arguments arguments = ops::ParseArguments(op, positional, modifiers);
  if (!random::IsCheap(op, arguments)) return;
  ImageSpec spec(9, 7, 3);
  const std::vector<Node> inputs(op.generator ? 0 : static_cast<size_t>(op.Operands(arguments)),
                                 SmallPicture());
  RenderSmall(op.make(inputs, arguments, op.generator ? &spec : nullptr));
}

}  // namespace tessera::fuzz
