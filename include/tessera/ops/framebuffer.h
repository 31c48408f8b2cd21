/// A framebuffer with GL's rules: colour, depth, stencil and accumulation, and fragments drawn through the
/// tests. @file
#ifndef TESSERA_OPS_FRAMEBUFFER_H_
#define TESSERA_OPS_FRAMEBUFFER_H_

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/composite.h"
#include "tessera/roi.h"

TESSERA_API_BEGIN
namespace tessera {

/// Source: OpenGL 2.1, chapter 4, "Per-Fragment Operations"; doc/maths/composite.md. @file

/// What arrives: one fragment for every pixel of `color`'s data window (R, G, B, A) where `coverage` is not
/// given or above 1/2. Depth is the first channel of `depth`, or `z` everywhere, squeezed to scale * depth +
/// bias. Windows are equal.
struct Fragments {
  Node color;             ///< R, G, B, A
  Node depth = {};        ///< may be empty
  Node coverage = {};     ///< may be empty: all pixels
  float z = 0;            ///< depth without a depth image
  float depth_scale = 1;  ///< of the depth
  float depth_bias = 0;   ///< added to it
};

/// The state of the pipeline; the default writes every fragment as it is. Order: scissor, stipple, alpha
/// test, stencil test, depth test, blending, masks. Where the depth test is off depth is neither compared nor
/// written.
struct DrawState {
  std::optional<Roi> scissor = {};                        ///< fragments outside are dropped
  std::optional<std::array<uint32_t, 32>> stipple = {};   ///< drawn where bit x mod 32 of row y mod 32 is 1
  AlphaTestParams alpha_test = {Comparison::kAlways, 0};  ///< fragments that fail are dropped
  bool stencil_test = false;                              ///< whether it is on
  StencilParams stencil = {Comparison::kAlways, 0, 255, 255, StencilAction::kKeep,
                           StencilAction::kKeep};  ///< the stencil test and its actions

  /// Stencil passes, depth fails; on_pass is for both passed.
  StencilAction on_depth_fail = StencilAction::kKeep;
  bool depth_test = false;                                    ///< whether it is on
  Comparison depth_function = Comparison::kLess;              ///< incoming OP stored; see DepthTest for NaN
  bool depth_write = true;                                    ///< fragments that pass leave their depth
  bool blend = false;                                         ///< whether it is on; else fragments replace
  BlendParams blending = {};                                  ///< equation and factors
  std::array<bool, 4> color_mask = {true, true, true, true};  ///< which of R, G, B, A are written
};

/// Buffers over one window: colour R, G, B, A of any pixel type (integers are GL's fixed point: fragments are
/// limited to [0, 1], results saturate and are rounded once), float depth, stencil bytes, and an accumulation
/// buffer made when first asked for. Starts with colour 0, depth 1, stencil 0. Drawing costs a few passes
/// over the fragments' window; not for use by several threads at once. Errors: an empty window, fragments
/// without four channels or with unequal windows.
class Framebuffer {
 public:
  /// Cleared; Error for an empty window.
  explicit Framebuffer(const Roi& window, PixelType color = PixelType::kFloat);

  /// R, G, B, A everywhere.
  void ClearColor(const std::array<float, 4>& color);
  /// One depth everywhere.
  void ClearDepth(float depth = 1);
  /// One byte everywhere.
  void ClearStencil(uint8_t value = 0);

  /// Draws all fragments inside the window; returns how many passed every test.
  int64_t Draw(const Fragments& fragments, const DrawState& state = {});

  /// The buffers themselves; colour and depth may be used as sources of a graph until the next Draw.
  const Image& color() const { return color_; }
  const Image& depth() const { return depth_; }      ///< one channel Z
  const Image& stencil() const { return stencil_; }  ///< one channel of bytes

  /// The pixels covered.
  const Roi& window() const { return window_; }

  /// GL's accumulation operations on the colour buffer: kAccumulate A += value * colour, kLoad A = value *
  /// colour, kAdd and kMultiply by value, kReturn colour = value * A, limited to [0, 1] for integers only.
  enum class AccumulationOp : uint8_t { kAccumulate, kLoad, kAdd, kMultiply, kReturn };
  /// One operation, as AccumulationOp says.
  void Accumulate(AccumulationOp op, double value);
  /// One value everywhere in the accumulation buffer.
  void ClearAccumulation(double value = 0) { Accumulation().Clear(value); }
  /// The accumulation buffer, made when first asked for.
  AccumulationBuffer& Accumulation();

 private:
  Roi window_;
  Image color_, depth_, stencil_;
  std::unique_ptr<AccumulationBuffer> accumulation_;
};

/// Coplanar decals by priority: draws the base under its depth test with stencil 2^k where it passes and 0
/// where it fails, then decal i (0 on top) with the depth test off where 2^i < stencil, replacing the
/// stencil: drawn in any order opaque decals give one picture; these are drawn from the last to the first. At
/// most 7. Uses all stencil bits.
void DrawDecals(Framebuffer& framebuffer, const Fragments& base, std::span<const Fragments> decals,
                const DrawState& base_state = {}, const DrawState& decal_state = {});

/// Stencil dissolve: draws image `to` over what is there where the pattern's first channel is below t, using
/// one stencil bit; nothing at t = 0, all of it at 1.
void DrawDissolve(Framebuffer& framebuffer, const Fragments& to, const Node& pattern, float t);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_FRAMEBUFFER_H_
