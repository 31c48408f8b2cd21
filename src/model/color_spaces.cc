// The table of known colour spaces. Sources: SMPTE ST 2065-1, S-2014-004 (ACEScg), ITU-R BT.709, BT.2020,
// BT.2100, SMPTE RP 431-2 and EG 432-1 (P3), IEC 61966-2-1; names of OpenColorIO's ACES configs; the Color
// Interop Forum's identifiers; ITU-T H.273.
#include "model/color_spaces.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace tessera::model {
namespace {

constexpr std::array<float, 8> kAp0 = {0.7347f, 0.2653f, 0, 1, 0.0001f, -0.077f, 0.32168f, 0.33767f};
constexpr std::array<float, 8> kAp1 = {0.713f, 0.293f, 0.165f, 0.83f, 0.128f, 0.044f, 0.32168f, 0.33767f};
constexpr std::array<float, 8> kRec709 = {0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f};
constexpr std::array<float, 8> kP3 = {0.68f, 0.32f, 0.265f, 0.69f, 0.15f, 0.06f, 0.3127f, 0.329f};
constexpr std::array<float, 8> kRec2020 = {0.708f, 0.292f, 0.17f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.329f};
constexpr float kRounding = 1e-3f;  // of chromaticities in files

bool Same(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  });
}

template <typename Test>
const ColorSpace* First(const Test& test) {
  const std::vector<ColorSpace>& all = ColorSpaces();
  const auto it = std::find_if(all.begin(), all.end(), test);
  return it == all.end() ? nullptr : &*it;
}

}  // namespace

const std::vector<ColorSpace>& ColorSpaces() {
  static const std::vector<ColorSpace> kAll = {
      {{"ACES2065-1", "aces2065_1", "lin_ap0", "lin_ap0_scene", "ACES - ACES2065-1"},
       "lin_ap0_scene",
       "",
       true,
       kAp0},
      {{"ACEScg", "lin_ap1", "lin_ap1_scene", "ACES - ACEScg"}, "lin_ap1_scene", "", true, kAp1},
      {{"lin_rec709", "lin_srgb", "lin_rec709_scene", "lin_rec709_srgb", "Linear Rec.709 (sRGB)",
        "Utility - Linear - sRGB", "Utility - Linear - Rec.709"},
       "lin_rec709_scene",
       "Linear",
       true,
       kRec709,
       1,
       8},
      {{"lin_p3d65", "lin_p3d65_scene", "Linear P3-D65", "Utility - Linear - P3-D65"},
       "lin_p3d65_scene",
       "",
       true,
       kP3,
       12,
       8},
      {{"lin_rec2020", "lin_rec2020_scene", "Linear Rec.2020", "Utility - Linear - Rec.2020"},
       "lin_rec2020_scene",
       "",
       true,
       kRec2020,
       9,
       8},
      {{"sRGB", "srgb_tx", "srgb_texture", "srgb_rec709_scene", "sRGB - Texture",
        "sRGB Encoded Rec.709 (sRGB)", "Utility - sRGB - Texture"},
       "srgb_rec709_scene",
       "sRGB"},
      {{"sRGB Display", "sRGB - Display", "srgb_display", "srgb_rec709_display"},
       "srgb_rec709_display",
       "sRGB",
       false,
       {},
       1,
       13},
      {{"Rec709", "Rec.709", "camera_rec709", "Camera Rec.709", "Utility - Rec.709 - Camera"}, "", "Rec709"},
      {{"Rec.1886 Rec.709 Display", "Rec.1886 Rec.709 - Display", "rec1886_rec709_display",
        "g24_rec709_display"},
       "g24_rec709_display",
       "Rec709",
       false,
       {},
       1,
       1},
      {{"Rec.1886 Rec.2020 Display", "Rec.1886 Rec.2020 - Display", "rec1886_rec2020_display",
        "g24_rec2020_display"},
       "g24_rec2020_display",
       "",
       false,
       {},
       9,
       14},
      {{"P3-D65 Display", "P3-D65 - Display", "p3d65_display", "g26_p3d65_display"}, "g26_p3d65_display", ""},
      {{"Display P3", "Display P3 - Display", "displayp3_display", "srgb_p3d65_display"},
       "srgb_p3d65_display",
       "",
       false,
       {},
       12,
       13},
      {{"Rec.2100-PQ Display", "Rec.2100-PQ - Display", "rec2100_pq_display", "pq_rec2020_display"},
       "pq_rec2020_display",
       "",
       false,
       {},
       9,
       16},
      {{"Rec.2100-HLG Display", "Rec.2100-HLG - Display", "rec2100_hlg_display", "hlg_rec2020_display"},
       "hlg_rec2020_display",
       "",
       false,
       {},
       9,
       18},
      {{"g18_rec709", "g18_rec709_tx", "g18_rec709_scene", "Gamma 1.8 Rec.709 - Texture",
        "GammaCorrected1.8"},
       "g18_rec709_scene",
       "GammaCorrected1.8"},
      {{"g22_rec709", "g22_rec709_tx", "g22_rec709_scene", "Gamma 2.2 Rec.709 - Texture",
        "GammaCorrected2.2"},
       "g22_rec709_scene",
       "GammaCorrected2.2"},
      {{"g24_rec709", "g24_rec709_tx", "g24_rec709_scene", "Gamma 2.4 Rec.709 - Texture",
        "GammaCorrected2.4"},
       "g24_rec709_scene",
       "GammaCorrected2.4"},
      {{"raw", "data", "Utility - Raw"}, "data", ""},
  };
  return kAll;
}

const ColorSpace* FindColorSpace(std::string_view name) {
  return First([name](const ColorSpace& s) {
    return std::any_of(s.names.begin(), s.names.end(),
                       [name](const std::string& n) { return Same(n, name); });
  });
}

const ColorSpace* FindColorSpace(const std::array<float, 8>& chromaticities) {
  return First([&](const ColorSpace& s) {
    return s.linear && std::equal(chromaticities.begin(), chromaticities.end(), s.chromaticities.begin(),
                                  [](float a, float b) { return std::fabs(a - b) <= kRounding; });
  });
}

const ColorSpace* FindColorSpace(int primaries, int transfer) {
  // BT.709, BT.601 and BT.2020 name one curve four times.
  if (primaries == 9 && (transfer == 1 || transfer == 15)) transfer = 14;
  if (primaries == 1 && (transfer == 6 || transfer == 14 || transfer == 15)) transfer = 1;
  return First([=](const ColorSpace& s) {
    return s.cicp_transfer != 0 && s.cicp_primaries == primaries && s.cicp_transfer == transfer;
  });
}

bool SameColorSpace(std::string_view a, std::string_view b) {
  if (Same(a, b)) return true;
  const ColorSpace* const known = FindColorSpace(a);
  return known != nullptr && known == FindColorSpace(b);
}

}  // namespace tessera::model
