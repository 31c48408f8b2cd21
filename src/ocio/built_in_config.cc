// The config that is used where neither a file nor the variable OCIO names one: ACES, cameras, video
// displays. Its roles are those of OpenColorIO's ACES configs: light of unknown primaries is ACEScg.
#include "ocio/built_in_config.h"

namespace tessera::ocio {

const char* BuiltInConfigText() {
  return R"(ocio_profile_version: 2

name: tessera built-in
environment: {}
search_path: ""
strictparsing: true

roles:
  aces_interchange: ACES2065-1
  cie_xyz_d65_interchange: CIE-XYZ-D65
  color_picking: sRGB
  color_timing: ACEScct
  compositing_log: ACEScct
  data: raw
  default: raw
  matte_paint: sRGB
  scene_linear: ACEScg
  texture_paint: sRGB

file_rules:
  - !<Rule> {name: Default, colorspace: default}

displays:
  sRGB:
    - !<View> {name: ACES 1.0 SDR, view_transform: ACES 1.0 SDR, display_colorspace: sRGB Display}
    - !<View> {name: Un-tone-mapped, view_transform: Un-tone-mapped, display_colorspace: sRGB Display}
    - !<View> {name: Raw, colorspace: raw}
  Rec.1886 Rec.709:
    - !<View> {name: ACES 1.0 SDR, view_transform: ACES 1.0 SDR, display_colorspace: Rec.1886 Rec.709 Display}
    - !<View> {name: Un-tone-mapped, view_transform: Un-tone-mapped, display_colorspace: Rec.1886 Rec.709 Display}
    - !<View> {name: Raw, colorspace: raw}
  P3-D65:
    - !<View> {name: ACES 1.1 SDR P3, view_transform: ACES 1.1 SDR P3, display_colorspace: P3-D65 Display}
    - !<View> {name: Un-tone-mapped, view_transform: Un-tone-mapped, display_colorspace: P3-D65 Display}
    - !<View> {name: Raw, colorspace: raw}
  Rec.2100-PQ:
    - !<View> {name: ACES 1.1 HDR 1000 nit, view_transform: ACES 1.1 HDR 1000 nit, display_colorspace: Rec.2100-PQ Display}
    - !<View> {name: Raw, colorspace: raw}

active_displays: []
active_views: []

view_transforms:
  - !<ViewTransform>
    name: Un-tone-mapped
    from_scene_reference: !<BuiltinTransform> {style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}
  - !<ViewTransform>
    name: ACES 1.0 SDR
    from_scene_reference: !<BuiltinTransform> {style: ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0}
  - !<ViewTransform>
    name: ACES 1.1 SDR P3
    from_scene_reference: !<BuiltinTransform> {style: ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO-P3lim_1.1}
  - !<ViewTransform>
    name: ACES 1.1 HDR 1000 nit
    from_scene_reference: !<BuiltinTransform> {style: ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - HDR-VIDEO-1000nit-15nit-REC2020lim_1.1}

display_colorspaces:
  - !<ColorSpace>
    name: CIE-XYZ-D65
  - !<ColorSpace>
    name: sRGB Display
    aliases: [sRGB - Display, srgb_display, srgb_rec709_display]
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_sRGB}
  - !<ColorSpace>
    name: Rec.1886 Rec.709 Display
    aliases: [Rec.1886 Rec.709 - Display, rec1886_rec709_display, g24_rec709_display]
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709}
  - !<ColorSpace>
    name: P3-D65 Display
    aliases: [P3-D65 - Display, p3d65_display, g26_p3d65_display]
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_G2.6-P3-D65}
  - !<ColorSpace>
    name: Rec.2100-PQ Display
    aliases: [Rec.2100-PQ - Display, rec2100_pq_display, pq_rec2020_display]
    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_REC.2100-PQ}

colorspaces:
  - !<ColorSpace>
    name: raw
    isdata: true
  - !<ColorSpace>
    name: ACES2065-1
    aliases: [aces2065_1, lin_ap0, lin_ap0_scene]
  - !<ColorSpace>
    name: ACEScg
    aliases: [acescg, lin_ap1, lin_ap1_scene]
    to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}
  - !<ColorSpace>
    name: ACEScct
    aliases: [acescct]
    to_scene_reference: !<BuiltinTransform> {style: ACEScct_to_ACES2065-1}
  - !<ColorSpace>
    name: ACEScc
    aliases: [acescc]
    to_scene_reference: !<BuiltinTransform> {style: ACEScc_to_ACES2065-1}
  - !<ColorSpace>
    name: ADX10
    to_scene_reference: !<BuiltinTransform> {style: ADX10_to_ACES2065-1}
  - !<ColorSpace>
    name: lin_rec709
    aliases: [linear, lin_srgb, lin_rec709_scene, Linear Rec.709 (sRGB)]
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: inverse}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD}
  - !<ColorSpace>
    name: sRGB
    aliases: [srgb, srgb_tx, srgb_texture, srgb_rec709_scene, sRGB - Texture]
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: inverse}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD}
        - !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055, direction: inverse}
  - !<ColorSpace>
    name: Rec709
    aliases: [rec709, Rec.709]
    from_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1, direction: inverse}
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD}
        - !<ExponentWithLinearTransform> {gamma: 2.2222222222222223, offset: 0.099, direction: inverse}
  - !<ColorSpace>
    name: ARRI LogC3
    aliases: [arri_logc3_ei800]
    to_scene_reference: !<BuiltinTransform> {style: ARRI_ALEXA-LOGC-EI800-AWG_to_ACES2065-1}
  - !<ColorSpace>
    name: Canon Log2
    to_scene_reference: !<BuiltinTransform> {style: CANON_CLOG2-CGAMUT_to_ACES2065-1}
  - !<ColorSpace>
    name: Canon Log3
    to_scene_reference: !<BuiltinTransform> {style: CANON_CLOG3-CGAMUT_to_ACES2065-1}
  - !<ColorSpace>
    name: Panasonic V-Log
    to_scene_reference: !<BuiltinTransform> {style: PANASONIC_VLOG-VGAMUT_to_ACES2065-1}
  - !<ColorSpace>
    name: RED Log3G10
    to_scene_reference: !<BuiltinTransform> {style: RED_LOG3G10-RWG_to_ACES2065-1}
  - !<ColorSpace>
    name: Sony S-Log3
    to_scene_reference: !<BuiltinTransform> {style: SONY_SLOG3-SGAMUT3_to_ACES2065-1}
  - !<ColorSpace>
    name: Sony S-Log3 Cine
    to_scene_reference: !<BuiltinTransform> {style: SONY_SLOG3-SGAMUT3.CINE_to_ACES2065-1}
)";
}

}  // namespace tessera::ocio
