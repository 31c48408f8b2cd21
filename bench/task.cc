// Builds tasks from the registry, probes which steps are affine, and makes the input pictures.
#include "task.h"

#include <OpenImageIO/Imath.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "graph/op.h"
#include "graph/topology.h"
#include "oracle.h"
#include "photograph.h"
#include "tessera/error.h"
#include "verify/pixels.h"

namespace tessera::bench {
namespace {

// A counter-based generator: the same pixels on every machine and for every evaluation order.
uint64_t Hash(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// The operation evaluated in double on black, the four unit pixels and some others; affine when the others
// agree.
std::optional<Step::Affine> ProbeAffine(const Step& step) {
  if (step.info->generator || step.info->Operands(step.arguments) != 1) return std::nullopt;
  constexpr int kProbes = 16;
  const Image probe{ImageSpec(kProbes, 1, 4)};
  for (int x = 0; x < kProbes; ++x) {
    for (int c = 0; c < 4; ++c) {
      const float noise = static_cast<float>(Hash(x * 4 + c) >> 40) * 0x1p-24f * 4 - 2;
      probe.at<float>(x, 0, c) = x == 0 ? 0.0f : x <= 4 ? (x - 1 == c ? 1.0f : 0.0f) : noise;
    }
  }
  Task one{step.op(), {step}};
  const Node node = one.Build({FromImage(probe)}, probe.spec());
  if (node.spec().data_window != probe.spec().data_window || node.spec().channel_count() != 4 ||
      NeedsStatistics(node)) {
    return std::nullopt;
  }
  // What moves pixels may see nothing but the outside of so small a picture.
  for (const Node& n : graph::TopologicalOrder(node)) {
    const graph::OpKind kind = n.data()->op->Kind();
    if (kind == graph::OpKind::kTile || kind == graph::OpKind::kWhole || kind == graph::OpKind::kCrop) {
      return std::nullopt;
    }
  }
  const reference::ImageD result = Reference(node, probe.spec().data_window);
  Step::Affine affine;
  for (int r = 0; r < 4; ++r) {
    affine.m[r][4] = result.at(0, 0, r);
    for (int c = 0; c < 4; ++c) affine.m[r][c] = result.at(c + 1, 0, r) - result.at(0, 0, r);
  }
  for (int x = 5; x < kProbes; ++x) {
    for (int r = 0; r < 4; ++r) {
      double sum = affine.m[r][4];
      for (int c = 0; c < 4; ++c) sum += affine.m[r][c] * probe.at<float>(x, 0, c);
      if (!(std::abs(sum - result.at(x, 0, r)) <= 1e-12 * (1 + std::abs(sum)))) return std::nullopt;
    }
  }
  return affine;
}

// A sample in [0,1]; `noise` is white.
float Shown(Content content, int x, int y, int c, uint64_t seed, float noise) {
  const int shift = static_cast<int>(seed % 16) * 37;
  x += shift, y += shift;
  switch (content) {
    case Content::kEdges: {
      const int across = (3 * x + y) % 480;
      return across < 240 || across == 300 ? 0.0f : 1.0f;
    }
    case Content::kChecker:
      return (x / 60 + y / 60) % 2 == 0 ? 0.0f : 1.0f;
    case Content::kPhoto:
      return c < 3 ? Photograph(x, y, c, noise) : noise;
    default:
      return noise;
  }
}

}  // namespace

bool Step::Affine::diagonal() const {
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      if (r != c && m[r][c] != 0) return false;
    }
  }
  return true;
}

std::vector<double> Step::Numbers(const std::string& name) const {
  const auto found = arguments.values.find(name);
  return found == arguments.values.end() ? std::vector<double>{} : found->second.numbers;
}

std::vector<double> Step::Positional(size_t index) const {
  return index < info->arguments.size() ? Numbers(info->arguments[index].name) : std::vector<double>{};
}

Node Task::Build(const std::vector<Node>& inputs, const ImageSpec& output) const {
  std::vector<Node> operands = inputs;
  for (const Step& step : steps) {
    operands.resize(step.info->generator ? 0 : static_cast<size_t>(step.info->Operands(step.arguments)));
    operands = {step.info->make(operands, step.arguments, &output)};
  }
  return operands.front();
}

Task MakeTask(const std::string& name, const std::vector<std::pair<std::string, std::string>>& steps) {
  Task task;
  task.name = name;
  for (const auto& [op, example] : steps) {
    Step step;
    step.info = ops::FindOp(op);
    if (!step.info) throw Error(op, "found an operation that is not in the registry, expected one that is");
    step.arguments = ops::ParseExample(*step.info, example);
    step.affine = ProbeAffine(step);
    task.steps.push_back(std::move(step));
  }
  return task;
}

bool Frame::plain() const {
  const ImageSpec& spec = output.spec();
  return spec.channel_count() == 4 && spec.data_window == Roi{0, 0, width, height};
}

Image MakeInput(int width, int height, PixelType type, uint64_t seed, Content content) {
  Image image{ImageSpec(width, height, 4, type)};
  std::byte* out = image.view().data;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) * 4;
      const uint64_t a = Hash(seed * 0x2545f4914f6cdd1du + i), b = Hash(a);
      const uint32_t bits[4] = {static_cast<uint32_t>(a), static_cast<uint32_t>(a >> 32),
                                static_cast<uint32_t>(b), static_cast<uint32_t>(b >> 32)};
      for (size_t c = 0; c < 4; ++c) {
        const float unit =
            Shown(content, x, y, static_cast<int>(c), seed, static_cast<float>(bits[c] >> 8) / 0xffffffp0f);
        const float v = c == 3 ? 0.25f + 0.75f * unit : unit;
        if (type == PixelType::kFloat) {
          std::memcpy(out + (i + c) * 4, &v, 4);
        } else if (type == PixelType::kHalf) {
          const uint16_t h = Imath::half(v).bits();
          std::memcpy(out + (i + c) * 2, &h, 2);
        } else if (type == PixelType::kUint16) {
          const uint16_t u = static_cast<uint16_t>(std::lrint(v * 65535.0f));
          std::memcpy(out + (i + c) * 2, &u, 2);
        } else {
          out[i + c] = static_cast<std::byte>(std::lrint(v * 255.0f));
        }
      }
    }
  }
  return image;
}

double Decode(const std::byte* sample, PixelType type) {
  if (type == PixelType::kUint8) return std::to_integer<int>(*sample) / 255.0;
  if (type == PixelType::kFloat) {
    float v;
    std::memcpy(&v, sample, 4);
    return v;
  }
  uint16_t bits;
  std::memcpy(&bits, sample, 2);
  if (type == PixelType::kUint16) return bits / 65535.0;
  return verify::HalfToDouble(bits);
}

}  // namespace tessera::bench
