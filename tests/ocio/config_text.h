// A config with every kind of transform, looks, displays with views, and files found along its search path.
#ifndef TESSERA_TESTS_OCIO_CONFIG_TEXT_H_
#define TESSERA_TESTS_OCIO_CONFIG_TEXT_H_

#include <string>

namespace tessera::testing {

inline std::string ConfigText(const std::string& search_path) {
  return "ocio_profile_version: 2\nsearch_path: " + search_path + R"(
strictparsing: true
environment: {SHOT: a}
roles: {default: raw, scene_linear: lin, color_timing: logc}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
looks:
  - !<Look> {name: warm, process_space: lin, transform: !<CDLTransform> {slope: [1.2, 1, 0.8], offset: [0.01, 0, -0.01], power: [1.1, 1, 0.9], sat: 1.15}}
  - !<Look> {name: clipped, process_space: logc, transform: !<CDLTransform> {slope: [1.1, 1, 0.9], power: [0.9, 1, 1.2], sat: 0.8, style: asc}}
  - !<Look> {name: shot, process_space: logc, transform: !<FileTransform> {src: "${SHOT}.spi3d", interpolation: tetrahedral}}
displays:
  monitor:
    - !<View> {name: film, colorspace: video, looks: warm}
    - !<View> {name: plain, colorspace: video}
  cinema:
    - !<View> {name: film, colorspace: cube}
colorspaces:
  - !<ColorSpace> {name: raw, isdata: true}
  - !<ColorSpace> {name: lin, aliases: [linear]}
  - !<ColorSpace> {name: logc, to_scene_reference: !<LogCameraTransform> {base: 10, log_side_slope: 0.24719, log_side_offset: 0.385537, lin_side_slope: 5.555556, lin_side_offset: 0.052272, lin_side_break: 0.010591, direction: inverse}}
  - !<ColorSpace> {name: logc_slope, to_scene_reference: !<LogCameraTransform> {base: 10, log_side_slope: 0.24719, log_side_offset: 0.385537, lin_side_slope: 5.555556, lin_side_offset: 0.052272, lin_side_break: 0.010591, linear_slope: 5.4, direction: inverse}}
  - !<ColorSpace> {name: affine_log, to_scene_reference: !<LogAffineTransform> {base: 10, log_side_slope: [0.3, 0.29, 0.31], log_side_offset: 0.67, lin_side_slope: 0.99, lin_side_offset: 0.0108, direction: inverse}}
  - !<ColorSpace> {name: plain_log, to_scene_reference: !<LogTransform> {base: 2, direction: inverse}}
  - !<ColorSpace> {name: video, from_scene_reference: !<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0], direction: inverse}}
  - !<ColorSpace> {name: mirrored, from_scene_reference: !<ExponentWithLinearTransform> {gamma: 2.2, offset: 0.099, style: mirror, direction: inverse}}
  - !<ColorSpace> {name: gamma, to_scene_reference: !<ExponentTransform> {value: [2.2, 2.3, 2.4, 1]}}
  - !<ColorSpace> {name: gamma_mirror, to_scene_reference: !<ExponentTransform> {value: 2.2, style: mirror}}
  - !<ColorSpace> {name: gamma_pass, to_scene_reference: !<ExponentTransform> {value: 2.2, style: pass_thru}}
  - !<ColorSpace> {name: ranged, to_scene_reference: !<RangeTransform> {min_in_value: 0.0625, max_in_value: 0.92, min_out_value: 0, max_out_value: 1}}
  - !<ColorSpace> {name: ranged_free, to_scene_reference: !<RangeTransform> {min_in_value: 0.0625, max_in_value: 0.92, min_out_value: 0, max_out_value: 1, style: noclamp}}
  - !<ColorSpace> {name: cube, from_scene_reference: !<FileTransform> {src: a.spi3d, interpolation: linear}}
  - !<ColorSpace> {name: shaped, from_scene_reference: !<GroupTransform> {children: [!<FileTransform> {src: a.spi1d}, !<MatrixTransform> {matrix: [0.8, 0.15, 0.05, 0, 0.1, 0.85, 0.05, 0, 0, 0.1, 0.9, 0, 0, 0, 0, 1], offset: [0.01, 0, 0, 0]}, !<FileTransform> {src: a.spi3d, interpolation: tetrahedral}]}}
  - !<ColorSpace> {name: inverse_curve, to_scene_reference: !<FileTransform> {src: a.spi1d, direction: inverse}}
  - !<ColorSpace> {name: alpha_matrix, from_scene_reference: !<MatrixTransform> {matrix: [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0.2, 0, 0, 0.8], offset: [0, 0, 0, 0.05]}}
  - !<ColorSpace> {name: fixed, from_scene_reference: !<GroupTransform> {children: [!<MatrixTransform> {matrix: [0.9, 0.1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}, !<FixedFunctionTransform> {style: RGB_TO_HSV}, !<ExponentTransform> {value: [1, 0.9, 1, 1]}, !<FixedFunctionTransform> {style: RGB_TO_HSV, direction: inverse}]}}
)";
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_OCIO_CONFIG_TEXT_H_
