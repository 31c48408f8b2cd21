/// Textures on surfaces' colours, by OpenGL's texture environments. @file
#ifndef TESSERA_OPS_TEXTURE_ENVIRONMENT_H_
#define TESSERA_OPS_TEXTURE_ENVIRONMENT_H_

#include <array>
#include <cstdint>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// What a texture does to the colour of the surface it lies on.
enum class TextureMode : uint8_t {
  kModulate,  ///< T F; alpha At Af
  kDecal,     ///< At T + (1 - At) F; alpha Af
  kBlend,     ///< (1 - T) F + T C, C the constant; alpha At Af
  kReplace,   ///< T; alpha At
  kAdd,       ///< T + F; alpha At Af
  kCombine,   ///< a function of up to three arguments
};
/// Functions of kCombine; a0, a1 and a2 are the arguments.
enum class TextureFunction : uint8_t {
  kModulate,     ///< a0 a1
  kReplace,      ///< a0
  kAdd,          ///< a0 + a1
  kAddSigned,    ///< a0 + a1 - 1/2
  kInterpolate,  ///< a0 a2 + a1 (1 - a2)
  kSubtract,     ///< a0 - a1
  kDot,          ///< 4 sum (a0 - 1/2)(a1 - 1/2) over R, G and B, in all three; alpha Af
};
/// What an argument of kCombine is; for alpha it is that of the same image, or 1 minus that.
enum class TextureArgument : uint8_t {
  kTexture,
  kOneMinusTexture,
  kTextureAlpha,
  kOneMinusTextureAlpha,
  kFragment,
  kOneMinusFragment,
  kFragmentAlpha,
  kOneMinusFragmentAlpha,
  kConstant,
  kOneMinusConstant,
  kConstantAlpha,
  kOneMinusConstantAlpha,
};
/// Colours are not premultiplied and nothing is limited. |error| <= 8 u times the sum of the magnitudes of
/// the formula's terms.
struct TextureEnvironmentParams {
  TextureMode mode = TextureMode::kModulate;              ///< what the texture does
  std::array<double, 4> constant = {0, 0, 0, 0};          ///< R, G, B, A
  TextureFunction function = TextureFunction::kModulate;  ///< of kCombine
  std::array<TextureArgument, 3> arguments = {TextureArgument::kTexture, TextureArgument::kFragment,
                                              TextureArgument::kConstant};  ///< of kCombine
  int scale = 1;                                                            ///< of kCombine: 1, 2 or 4
};
/// The texture on the fragment, as OpenGL's texture environments (OpenGL 2.1 2006, 3.8.13). Both have R, G
/// and B, or one grey channel for all three, with A or without; a texture of A alone leaves the colours
/// (Error with kDecal). Without A the texture leaves alpha alone; in kCombine it counts as 1. The result has
/// R, G, B, and A where either has one (with kDecal: where the fragment has). Further channels are left out.
/// Error where windows differ.
Node TextureEnvironment(const Node& texture, const Node& fragment,
                        const TextureEnvironmentParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_TEXTURE_ENVIRONMENT_H_
