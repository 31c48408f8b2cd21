// The framebuffer: per-fragment tests in plain loops, blending by the library's own nodes.
#include "tessera/ops/framebuffer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/render.h"

namespace tessera {
namespace {

ImageSpec SpecOf(const Roi& window, std::vector<std::string> channels, PixelType type) {
  ImageSpec spec;
  spec.data_window = spec.display_window = window;
  spec.channels = std::move(channels);
  spec.alpha = spec.channels.size() == 4 ? 3 : -1;
  spec.type = type;
  return spec;
}
ImageSpec ColorSpec(const Roi& window, PixelType type) { return SpecOf(window, {"R", "G", "B", "A"}, type); }

template <typename T>
bool Passes(Comparison test, T a, T b) {
  switch (test) {
    case Comparison::kNever:
      return false;
    case Comparison::kLess:
      return a < b;
    case Comparison::kEqual:
      return a == b;
    case Comparison::kLessOrEqual:
      return a <= b;
    case Comparison::kGreater:
      return a > b;
    case Comparison::kNotEqual:
      return a != b;
    case Comparison::kGreaterOrEqual:
      return a >= b;
    case Comparison::kAlways:
      break;
  }
  return true;
}

uint8_t Acted(StencilAction action, uint8_t stored, const StencilParams& p) {
  int next = stored;
  switch (action) {
    case StencilAction::kKeep:
      break;
    case StencilAction::kZero:
      next = 0;
      break;
    case StencilAction::kReplace:
      next = p.reference;
      break;
    case StencilAction::kIncrement:
      next = std::min(stored + 1, 255);
      break;
    case StencilAction::kDecrement:
      next = std::max(stored - 1, 0);
      break;
    case StencilAction::kInvert:
      next = ~stored;
      break;
    case StencilAction::kIncrementWrap:
      next = stored + 1;
      break;
    case StencilAction::kDecrementWrap:
      next = stored - 1;
      break;
  }
  return static_cast<uint8_t>((stored & ~p.write_mask) | (next & p.write_mask));
}

// All of a node's pixels as floats, the part of its data window that is wanted.
Image Floats(const Node& node, const Roi& roi) {
  ImageSpec spec = node.spec();
  spec.data_window = roi;
  spec.type = PixelType::kFloat;
  const Image image(std::move(spec));
  RenderInto(node, image.view());
  return image;
}

void RequireFragments(const Fragments& f) {
  const ImageSpec& color = f.color.spec();
  if (color.channel_count() != 4 || color.alpha != 3) {
    throw DataError("framebuffer", "found fragments of " + std::to_string(color.channel_count()) +
                                       " channels, expected R,G,B,A");
  }
  for (const Node* other : {&f.depth, &f.coverage}) {
    if (*other && other->spec().data_window != color.data_window) {
      throw DataError("framebuffer",
                      "found colour and depth or coverage of different windows, expected equal ones");
    }
  }
}

}  // namespace

Framebuffer::Framebuffer(const Roi& window, PixelType color) : window_(window) {
  if (window.empty()) throw Error("framebuffer", "found an empty window, expected at least one pixel");
  color_ = Image(ColorSpec(window, color));
  depth_ = Image(SpecOf(window, {"Z"}, PixelType::kFloat));
  stencil_ = Image(SpecOf(window, {"Y"}, PixelType::kUint8));
  ClearDepth();
}

void Framebuffer::ClearColor(const std::array<float, 4>& color) {
  const Image one(ColorSpec({0, 0, 1, 1}, PixelType::kFloat));
  std::memcpy(one.view().data, color.data(), sizeof color);
  const Image pixel = Render(FromImage(one), color_.spec().type);
  const size_t bytes = 4 * PixelBytes(color_.spec().type);
  for (int64_t i = 0; i < window_.pixels(); ++i) {
    std::memcpy(color_.view().data + static_cast<size_t>(i) * bytes, pixel.view().data, bytes);
  }
}
void Framebuffer::ClearDepth(float depth) {
  std::fill_n(reinterpret_cast<float*>(depth_.view().data), window_.pixels(), depth);
}
void Framebuffer::ClearStencil(uint8_t value) {
  std::memset(stencil_.view().data, value, static_cast<size_t>(window_.pixels()));
}

int64_t Framebuffer::Draw(const Fragments& fragments, const DrawState& state) {
  RequireFragments(fragments);
  Roi roi = Intersection(window_, fragments.color.spec().data_window);
  if (state.scissor) roi = Intersection(roi, *state.scissor);
  if (roi.empty()) return 0;
  const PixelType type = color_.spec().type;
  Node color = fragments.color;
  if (type == PixelType::kUint8 || type == PixelType::kUint16) color = Clamp(color, {{0}, {1}, false});
  const Image incoming = Floats(color, roi);
  const Image depth = fragments.depth && state.depth_test ? Floats(fragments.depth, roi) : Image();
  const Image coverage = fragments.coverage ? Floats(fragments.coverage, roi) : Image();

  // Blended before the tests, which change neither colour; what fails is not written.
  ImageSpec spec = ColorSpec(roi, type);
  Node result = FromImage(incoming);
  if (state.blend) result = Blend(result, FromView(color_.view().Sub(roi), spec), state.blending);
  const Image written = Render(result, type);

  const size_t bytes = PixelBytes(type);
  const bool squeezed = fragments.depth_scale != 1 || fragments.depth_bias != 0;
  int64_t passed = 0;
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      if (fragments.coverage && !(coverage.at<float>(x, y) > 0.5f)) continue;
      if (state.stipple) {
        const uint32_t row = (*state.stipple)[static_cast<size_t>(y & 31)];
        if ((row >> (x & 31) & 1) == 0) continue;
      }
      if (!Passes(state.alpha_test.test, incoming.at<float>(x, y, 3), state.alpha_test.reference)) continue;
      auto& stored = stencil_.at<uint8_t>(x, y);
      const StencilParams& s = state.stencil;
      if (state.stencil_test && !Passes(s.test, s.reference & s.mask, stored & s.mask)) {
        stored = Acted(s.on_fail, stored, s);
        continue;
      }
      if (state.depth_test) {
        float z = fragments.depth ? depth.at<float>(x, y) : fragments.z;
        if (squeezed) {
          const float product = z * fragments.depth_scale;
          z = product + fragments.depth_bias;
        }
        auto& nearest = depth_.at<float>(x, y);
        if (!Passes(state.depth_function, z, nearest) && !(std::isnan(nearest) && !std::isnan(z))) {
          if (state.stencil_test) stored = Acted(state.on_depth_fail, stored, s);
          continue;
        }
        if (state.depth_write) nearest = z;
      }
      if (state.stencil_test) stored = Acted(s.on_pass, stored, s);
      ++passed;
      for (int c = 0; c < 4; ++c) {
        if (state.color_mask[static_cast<size_t>(c)]) {
          std::memcpy(color_.view().At(x, y, c), written.view().At(x, y, c), bytes);
        }
      }
    }
  }
  return passed;
}

AccumulationBuffer& Framebuffer::Accumulation() {
  if (accumulation_ == nullptr) accumulation_ = std::make_unique<AccumulationBuffer>(window_, 4);
  return *accumulation_;
}

void Framebuffer::Accumulate(AccumulationOp op, double value) {
  AccumulationBuffer& buffer = Accumulation();
  const PixelType type = color_.spec().type;
  switch (op) {
    case AccumulationOp::kAccumulate:
      return buffer.Accumulate(color_.view(), value);
    case AccumulationOp::kLoad:
      return buffer.Load(color_.view(), value);
    case AccumulationOp::kAdd:
      return buffer.Add(value);
    case AccumulationOp::kMultiply:
      return buffer.Multiply(value);
    case AccumulationOp::kReturn:
      return buffer.Return(color_.view(), value, type == PixelType::kUint8 || type == PixelType::kUint16);
  }
}

void DrawDecals(Framebuffer& framebuffer, const Fragments& base, std::span<const Fragments> decals,
                const DrawState& base_state, const DrawState& decal_state) {
  if (decals.size() > 7) {
    throw Error("decals", "found " + std::to_string(decals.size()) + " decals, expected at most 7");
  }
  framebuffer.ClearStencil(0);
  DrawState state = base_state;
  state.stencil_test = state.depth_test = true;
  state.stencil = {Comparison::kAlways,  1 << decals.size(),     255, 255,
                   StencilAction::kKeep, StencilAction::kReplace};
  state.on_depth_fail = StencilAction::kZero;
  framebuffer.Draw(base, state);
  for (size_t i = decals.size(); i-- > 0;) {
    state = decal_state;
    state.depth_test = false;
    state.stencil_test = true;
    // GL's LESS compares reference with stencil; the mask covers all bits, or nothing would pass.
    state.stencil = {Comparison::kLess, 1 << i, 255, 255, StencilAction::kKeep, StencilAction::kReplace};
    framebuffer.Draw(decals[i], state);
  }
}

void DrawDissolve(Framebuffer& framebuffer, const Fragments& to, const Node& pattern, float t) {
  RequireFragments(to);
  const Node none = MulConstant(to.color, {0});
  const Node all = AddConstant(none, {1});
  Fragments marks = to;
  marks.color = Dissolve(none, all, {.t = t, .pattern = DissolvePattern::kImage}, pattern);
  DrawState state;
  state.stencil_test = true;
  state.color_mask = {false, false, false, false};
  state.stencil = {Comparison::kAlways, 0, 255, 1, StencilAction::kKeep, StencilAction::kReplace};
  framebuffer.Draw(marks, state);
  state.alpha_test = {Comparison::kGreater, 0.5f};
  state.stencil.reference = 1;
  framebuffer.Draw(marks, state);
  state = {};
  state.stencil_test = true;
  state.stencil = {Comparison::kEqual, 1, 1, 0, StencilAction::kKeep, StencilAction::kKeep};
  framebuffer.Draw(to, state);
}

}  // namespace tessera
