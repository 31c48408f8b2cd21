// LUT files of every kind that is checked before OpenColorIO reads it, for the targets that read them.
#ifndef TESSERA_TESTS_FUZZ_LUTS_H_
#define TESSERA_TESTS_FUZZ_LUTS_H_

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "fuzz/fuzz.h"

namespace tessera::fuzz {

constexpr std::array kLutExtensions = {".cube",   ".spi1d", ".spi3d", ".csp", ".lut", ".itx", ".3dl",
                                       ".spimtx", ".clf",   ".cc",    ".vf",  ".ctf", ".cub", ".mga"};

// The first byte chooses the extension.
inline const std::string& PutLut(Input& in) {
  static std::deque<File> files;
  if (files.empty()) {
    for (const char* extension : kLutExtensions) files.emplace_back(std::string("lut") + extension);
  }
  const size_t kind = in.Below(kLutExtensions.size());
  return files[kind].Put(in.Rest());
}

inline std::vector<std::string> LutSeeds() {
  const std::vector<std::pair<const char*, std::string>> luts = {
      {".cube",
       "TITLE \"a\"\nLUT_3D_SIZE 2\nDOMAIN_MIN 0 0 0\nDOMAIN_MAX 1 1 1\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n"
       "0 0 1\n1 0 1\n0 1 1\n1 1 1\n"},
      {".cube", "\xef\xbb\xbfLUT_1D_SIZE 3\nLUT_1D_INPUT_RANGE 0 2\n0 0 0\n.5 .4 .3\n1 1 1\n"},
      {".cube",
       "LUT_1D_SIZE 2\nLUT_3D_SIZE 2\n0 0 0\n1 1 1\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n"},
      {".spi1d", "Version 1\nFrom 0 1\nLength 3\nComponents 1\n{\n0\n0.4\n1\n}\n"},
      {".spi3d",
       "SPILUT 1.0\n3 3\n2 2 2\n0 0 0 0 0 0\n0 0 1 0 0 1\n0 1 0 0 1 0\n0 1 1 0 1 1\n1 0 0 1 0 0\n1 0 1 1 0 1\n"
       "1 1 0 1 1 0\n1 1 1 1 1 1\n"},
      {".csp",
       "CSPLUTV100\n3D\n\nBEGIN METADATA\nx\nEND METADATA\n\n2\n0 1\n0 1\n2\n0 1\n0 1\n2\n0 1\n0 1\n\n2 2 2\n0 0 0\n"
       "1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n"},
      {".csp", "CSPLUTV100\n1D\n\n2\n0 1\n0 1\n2\n0 1\n0 1\n2\n0 1\n0 1\n\n2\n0 0 0\n1 1 1\n"},
      {".lut",
       "Version\t\t1\nFormat\t\tany\nType\t\tC\nFrom\t\t0 1\nTo\t\t0 1\nBlack\t\t0\nWhite\t\t1\nLength\t\t3\nLUT:\n"
       "RGB {\n\t0\n\t.5\n\t1\n}\n"},
      {".lut", "LUT: 1 256\n0\n1\n2\n"},
      {".itx", "LUT_3D_SIZE 2\n\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n"},
      {".3dl",
       "0 1023\n0 0 0\n0 0 4095\n0 4095 0\n0 4095 4095\n4095 0 0\n4095 0 4095\n4095 4095 0\n4095 4095 4095\n"},
      {".3dl", "3DMESH\nMesh 1 12\n0 1023\n0 0 0\n"},
      {".spimtx", "1 0 0 0\n0 1 0 0\n0 0 1 0\n"},
      {".clf",
       "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<ProcessList id=\"a\" compCLFversion=\"3.0\">\n<Matrix "
       "inBitDepth=\"32f\" outBitDepth=\"32f\">\n<Array dim=\"3 3\">1 0 0 0 1 0 0 0 1</Array>\n</Matrix>\n<LUT1D "
       "inBitDepth=\"32f\" outBitDepth=\"32f\">\n<Array dim=\"2 1\">0 1</Array>\n</LUT1D>\n</ProcessList>\n"},
      {".cc",
       "<ColorCorrection id=\"a\"><SOPNode><Slope>1 1 1</Slope><Offset>0 0 0</Offset><Power>1 1 "
       "1</Power></SOPNode><SatNode><Saturation>1.1</Saturation></SatNode></ColorCorrection>\n"},
      {".vf",
       "#Inventor V2.1 ascii\ngrid_size 2 2 2\nglobal_transform 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\ndata\n0 0 0\n0 0 "
       "1\n0 1 0\n0 1 1\n1 0 0\n1 0 1\n1 1 0\n1 1 1\n"}};
  std::vector<std::string> seeds;
  for (const auto& [extension, text] : luts) {
    for (size_t i = 0; i < kLutExtensions.size(); ++i) {
      if (std::string(kLutExtensions[i]) == extension) {
        seeds.push_back(static_cast<char>(i) + text);
        break;
      }
    }
  }
  return seeds;
}

inline std::vector<std::string> LutWords() {
  return {"LUT_1D_SIZE",
          "LUT_3D_SIZE",
          "DOMAIN_MIN",
          "DOMAIN_MAX",
          "LUT_1D_INPUT_RANGE",
          "LUT_3D_INPUT_RANGE",
          "TITLE",
          "Version",
          "From",
          "Length",
          "Components",
          "{",
          "}",
          "SPILUT",
          "CSPLUTV100",
          "1D",
          "3D",
          "BEGIN METADATA",
          "END METADATA",
          "Format",
          "Type",
          "3D+1D",
          "Black",
          "White",
          "Pre {",
          "3D {",
          "RGB {",
          "LUT:",
          "3DMESH",
          "Mesh",
          "gamma",
          "\n",
          "\r\n",
          "\xef\xbb\xbf",
          "nan",
          "1e999",
          "65536",
          "129",
          "<LUT3D",
          "<LUT1D",
          "<Array dim=\"",
          "<Range",
          "<Exponent",
          "<Log",
          "<CDL",
          "<ExposureContrast",
          "halfDomain=\"true\"",
          "rawHalfs=\"true\"",
          "<IndexMap dim=\"2\">0@0 1@1</IndexMap>",
          "grid_size",
          "&amp;",
          "<!--",
          "-->",
          "<![CDATA[",
          "]]>"};
}

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_LUTS_H_
