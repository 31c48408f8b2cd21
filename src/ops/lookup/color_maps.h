// The colour maps that oiiotool has by name, as knots at equal distances from 0 to 1, in linear light: those
// of matplotlib (Smith et al. 2015) and turbo (Mikhailov 2019) decoded from sRGB, and plain old
// ones.
#ifndef TESSERA_OPS_LOOKUP_COLOR_MAPS_H_
#define TESSERA_OPS_LOOKUP_COLOR_MAPS_H_

#include <span>
#include <string_view>

namespace tessera::ops {

struct NamedColorMap {
  std::string_view name;
  std::span<const float> knots;  // R,G,B each
};

inline constexpr float kMagmaKnots[] = {
    0.000113f, 3.6e-05f,  0.001073f, 0.003066f, 0.002406f, 0.016032999f, 0.012176f, 0.005476f, 0.062265f,
    0.036874f, 0.005102f, 0.146314f, 0.081757f, 0.006177f, 0.200758f,    0.143411f, 0.011719f, 0.218382f,
    0.22611f,  0.019191f, 0.221188f, 0.334672f, 0.027718f, 0.212689f,    0.47168f,  0.037966f, 0.191879f,
    0.632894f, 0.053268f, 0.15987f,  0.79591f,  0.083327f, 0.124705f,    0.913454f, 0.146074f, 0.106311f,
    0.970011f, 0.248466f, 0.12074f,  0.991142f, 0.384808f, 0.16759f,     0.992958f, 0.553563f, 0.24777f,
    0.982888f, 0.756759f, 0.367372f, 0.9708f,   0.980633f, 0.521749f,
};
inline constexpr float kInfernoKnots[] = {
    0.000113f, 3.6e-05f,  0.001073f, 0.003275f, 0.002178f, 0.017634f, 0.015183f, 0.003697f, 0.06876f,
    0.046307f, 0.002834f, 0.130327f, 0.095494f, 0.005137f, 0.154432f, 0.163601f, 0.00992f,  0.156097f,
    0.25389f,  0.016282f, 0.143715f, 0.367418f, 0.024893f, 0.119982f, 0.500495f, 0.038279f, 0.089117f,
    0.642469f, 0.061553f, 0.057555f, 0.77619f,  0.102517f, 0.031141f, 0.883568f, 0.16999f,  0.012559f,
    0.951614f, 0.271639f, 0.002704f, 0.972636f, 0.413571f, 0.005451f, 0.943272f, 0.599923f, 0.035112f,
    0.8849f,   0.822282f, 0.140466f, 0.973729f, 0.996282f, 0.373522f,
};
inline constexpr float kPlasmaKnots[] = {
    0.00397f,  0.002307f, 0.240854f, 0.031078f, 0.001421f, 0.307376f, 0.073167f, 0.00074f,  0.356714f,
    0.132456f, 6.6e-05f,  0.38804f,  0.20933f,  0.000928f, 0.390312f, 0.300631f, 0.005819f, 0.358197f,
    0.399925f, 0.017084f, 0.301977f, 0.501006f, 0.036122f, 0.240788f, 0.600808f, 0.063814f, 0.186921f,
    0.698178f, 0.101409f, 0.142698f, 0.790993f, 0.151134f, 0.106347f, 0.874354f, 0.216492f, 0.076152f,
    0.940588f, 0.302179f, 0.051495f, 0.980469f, 0.413691f, 0.032625f, 0.984224f, 0.556999f, 0.020728f,
    0.942844f, 0.738124f, 0.018271f, 0.868931f, 0.944416f, 0.01559f,
};
inline constexpr float kViridisKnots[] = {
    0.057951f, 0.000377f, 0.088657f, 0.064791f, 0.009258f, 0.14534f,  0.063189f, 0.025975f, 0.198994f,
    0.054539f, 0.051494f, 0.237655f, 0.043139f, 0.084803f, 0.258811f, 0.032927f, 0.124348f, 0.268148f,
    0.025232f, 0.169666f, 0.271584f, 0.019387f, 0.221569f, 0.270909f, 0.014846f, 0.281323f, 0.263855f,
    0.013529f, 0.34953f,  0.246357f, 0.021457f, 0.425216f, 0.215605f, 0.049317f, 0.505412f, 0.172291f,
    0.112305f, 0.585164f, 0.121207f, 0.229143f, 0.657992f, 0.070438f, 0.417964f, 0.717561f, 0.029928f,
    0.683952f, 0.762557f, 0.009977f, 0.984709f, 0.799651f, 0.018243f,
};
inline constexpr float kTurboKnots[] = {
    0.03006f, 0.00619f, 0.04403f, 0.05131f, 0.05183f, 0.35936f, 0.06204f, 0.1482f,  0.77017f,
    0.0544f,  0.29523f, 0.99718f, 0.0216f,  0.50023f, 0.8338f,  0.00892f, 0.72094f, 0.54189f,
    0.03205f, 0.8879f,  0.31235f, 0.15318f, 0.98683f, 0.1231f,  0.37185f, 0.97738f, 0.04454f,
    0.61188f, 0.83681f, 0.03455f, 0.85432f, 0.62499f, 0.04203f, 0.98447f, 0.41196f, 0.0342f,
    0.9631f,  0.20754f, 0.01503f, 0.82971f, 0.08083f, 0.00438f, 0.63144f, 0.02851f, 0.0014f,
    0.39907f, 0.00776f, 0.00033f, 0.19564f, 0.00123f, 0.00082f,
};
inline constexpr float kBlueRedKnots[] = {0, 0, 1, 1, 0, 0};
inline constexpr float kSpectrumKnots[] = {0, 0, 0.05f, 0, 0, 0.75f, 0, 0.5f, 0, 0.5f, 0.5f, 0, 1, 0, 0};
inline constexpr float kHeatKnots[] = {0, 0, 0, 0.05f, 0, 0, 0.25f, 0, 0, 0.75f, 0.75f, 0, 1, 1, 1};

inline constexpr NamedColorMap kColorMaps[] = {
    {"inferno", kInfernoKnots},   {"viridis", kViridisKnots}, {"magma", kMagmaKnots},
    {"turbo", kTurboKnots},       {"plasma", kPlasmaKnots},   {"blue-red", kBlueRedKnots},
    {"spectrum", kSpectrumKnots}, {"heat", kHeatKnots},       {"red-blue", kBlueRedKnots},
    {"bluered", kBlueRedKnots},   {"redblue", kBlueRedKnots},
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_LOOKUP_COLOR_MAPS_H_
