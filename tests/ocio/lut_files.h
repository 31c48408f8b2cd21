// A file of every LUT format that OpenColorIO reads, written for tests.
#ifndef TESSERA_TESTS_OCIO_LUT_FILES_H_
#define TESSERA_TESTS_OCIO_LUT_FILES_H_

#include <OpenColorIO/OpenColorIO.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace tessera::testing {

namespace lib = OCIO_NAMESPACE;
namespace fs = std::filesystem;

// A folder that goes away.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("tessera_ocio_" + std::to_string(std::random_device{}()))) {
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  std::string Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return (path_ / name).string();
  }
  std::string path() const { return path_.string(); }

 private:
  fs::path path_;
};

struct LutFile {
  std::string format, name, bytes;  // the reader's name as OpenColorIO lists it
};

// A colour cube with crosstalk, entry by entry.
inline void CubeEntry(double r, double g, double b, double (&out)[3]) {
  out[0] = 0.9 * r * r + 0.1 * g, out[1] = std::sqrt(g) * 0.8 + 0.2 * b,
  out[2] = 0.05 + 0.9 * b * (1 - 0.2 * r);
}

// Big-endian numbers of ICC profiles.
inline std::string Big(uint32_t v, int bytes = 4) {
  std::string s;
  for (int i = bytes - 1; i >= 0; --i) s += static_cast<char>(v >> (8 * i));
  return s;
}
inline std::string Fixed(double v) {
  return Big(static_cast<uint32_t>(static_cast<int32_t>(std::lround(v * 65536))));
}

// A matrix and gamma profile of a display.
inline std::string IccProfile() {
  const auto xyz = [](double x, double y, double z) {
    return "XYZ " + Big(0) + Fixed(x) + Fixed(y) + Fixed(z);
  };
  const std::string curve = "curv" + Big(0) + Big(1) + Big(static_cast<uint32_t>(2.2 * 256), 2) + Big(0, 2);
  const std::vector<std::pair<std::string, std::string>> tags = {{"rXYZ", xyz(0.4360, 0.2225, 0.0139)},
                                                                 {"gXYZ", xyz(0.3851, 0.7169, 0.0971)},
                                                                 {"bXYZ", xyz(0.1431, 0.0606, 0.7141)},
                                                                 {"rTRC", curve},
                                                                 {"gTRC", curve},
                                                                 {"bTRC", curve}};
  std::string table = Big(static_cast<uint32_t>(tags.size())), data;
  const size_t start = 128 + 4 + 12 * tags.size();
  for (const auto& [name, value] : tags) {
    table +=
        name + Big(static_cast<uint32_t>(start + data.size())) + Big(static_cast<uint32_t>(value.size()));
    data += value;
  }
  std::string header =
      Big(static_cast<uint32_t>(start + data.size())) + Big(0) + Big(0x02400000) + "mntrRGB XYZ ";
  for (const uint32_t v : {2020u, 1u, 1u, 0u, 0u, 0u}) header += Big(v, 2);
  header += "acsp" + Big(0) + Big(0) + Big(0) + Big(0) + Big(0) + Big(0) + Big(0);
  header += Fixed(0.9642) + Fixed(1) + Fixed(0.8249);
  header.resize(128, '\0');
  return header + table + data;
}

inline std::string Numbers(const double (&v)[3]) {
  std::ostringstream text;
  text.precision(7);
  text << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
  return text.str();
}

// All entries of an N^3 cube in the given order: text(r, g, b, value).
template <class F>
std::string Cube(int n, bool red_fastest, F text) {
  std::string all;
  for (int slow = 0; slow < n; ++slow) {
    for (int g = 0; g < n; ++g) {
      for (int fast = 0; fast < n; ++fast) {
        const int r = red_fastest ? fast : slow, b = red_fastest ? slow : fast;
        double v[3];
        CubeEntry(r / (n - 1.0), g / (n - 1.0), b / (n - 1.0), v);
        all += text(r, g, b, v);
      }
    }
  }
  return all;
}

// Iridas' hexadecimal floats, least significant byte first.
inline std::string Hex(const double (&v)[3]) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string s;
  for (const double x : v) {
    const uint32_t bits = std::bit_cast<uint32_t>(static_cast<float>(x));
    for (int byte = 0; byte < 4; ++byte) {
      const uint32_t value = (bits >> (8 * byte)) & 0xff;
      s += kDigits[value >> 4], s += kDigits[value & 15];
    }
  }
  return s;
}

// Files of OpenColorIO's own writers.
inline std::string Baked(const std::string& format) {
  std::istringstream text(
      "ocio_profile_version: 1\nstrictparsing: false\nroles: {default: in}\ndisplays:\n"
      "  d: [!<View> {name: v, colorspace: in}]\ncolorspaces:\n  - !<ColorSpace> {name: in}\n"
      "  - !<ColorSpace>\n    name: out\n    from_reference: !<GroupTransform>\n      children:\n"
      "        - !<MatrixTransform> {matrix: [0.8, 0.15, 0.05, 0, 0.1, 0.85, 0.05, 0, 0, 0.1, 0.9, 0, 0, 0, "
      "0, 1]}\n"
      "        - !<ExponentTransform> {value: [0.6, 0.7, 0.65, 1]}\n");
  const lib::BakerRcPtr baker = lib::Baker::Create();
  baker->setConfig(lib::Config::CreateFromStream(text));
  baker->setFormat(format.c_str());
  baker->setInputSpace("in");
  baker->setTargetSpace("out");
  if (format == "houdini" || format == "cinespace") baker->setShaperSpace("in");
  baker->setCubeSize(17);
  std::ostringstream out;
  baker->bake(out);
  return out.str();
}
inline std::string WrittenCdl(const std::string& format) {
  const lib::CDLTransformRcPtr cdl = lib::CDLTransform::Create();
  const double slope[] = {1.2, 1, 0.9}, offset[] = {0.01, 0, -0.02}, power[] = {1.1, 0.95, 1};
  cdl->setSlope(slope), cdl->setOffset(offset), cdl->setPower(power), cdl->setSat(1.2), cdl->setID("shot");
  const lib::GroupTransformRcPtr group = lib::GroupTransform::Create();
  group->appendTransform(cdl);
  std::ostringstream out;
  group->write(lib::Config::CreateRaw(), format.c_str(), out);
  return out.str();
}

inline std::vector<LutFile> AllLutFiles() {
  std::vector<LutFile> files;
  for (const auto& [format, name] :
       std::vector<std::pair<std::string, std::string>>{{"flame", "flame.3dl"},
                                                        {"lustre", "lustre.3dl"},
                                                        {"cinespace", "a.csp"},
                                                        {"houdini", "houdini.lut"},
                                                        {"iridas_cube", "iridas.cube"},
                                                        {"iridas_itx", "a.itx"},
                                                        {"resolve_cube", "resolve.cube"},
                                                        {"truelight", "a.cub"},
                                                        {"Academy/ASC Common LUT Format", "a.clf"},
                                                        {"Color Transform Format", "a.ctf"}}) {
    files.push_back({format, name, Baked(format)});
  }
  files.push_back({"ColorCorrection", "a.cc", WrittenCdl("ColorCorrection")});
  files.push_back({"ColorCorrectionCollection", "a.ccc", WrittenCdl("ColorCorrectionCollection")});
  files.push_back({"ColorDecisionList", "a.cdl", WrittenCdl("ColorDecisionList")});
  std::string discreet = "LUT: 3 256\n";
  for (const double gamma : {0.5, 0.6, 1.4}) {
    for (int i = 0; i < 256; ++i)
      discreet += std::to_string(std::lround(255 * std::pow(i / 255.0, gamma))) + "\n";
  }
  files.push_back({"Discreet 1D LUT", "discreet.lut", discreet});
  files.push_back({"International Color Consortium profile", "a.icc", IccProfile()});
  files.push_back({"Image Color Matching profile", "a.icm", IccProfile()});
  files.push_back({"ICC profile", "a.pf", IccProfile()});
  files.push_back({"iridas_look", "a.look",
                   "<?xml version=\"1.0\" ?>\n<look>\n<LUT>\n<size>\"5\"</size>\n<data>\"" +
                       Cube(5, true, [](int, int, int, const double(&v)[3]) { return Hex(v); }) +
                       "\"</data>\n</LUT>\n</look>\n"});
  int index = 0;
  const std::string pandora = "channel 3d\nin 125\nout 4096\nformat lut\nvalues red green blue\n" +
                              Cube(5, false, [&index](int, int, int, const double(&v)[3]) {
                                std::string line = std::to_string(index++);
                                for (const double x : v) line += " " + std::to_string(std::lround(x * 4095));
                                return line + "\n";
                              });
  files.push_back({"pandora_mga", "a.mga", pandora});
  files.push_back({"pandora_m3d", "a.m3d", pandora});
  std::string spi1d = "Version 1\nFrom -0.25 1.5\nLength 64\nComponents 3\n{\n";
  for (int i = 0; i < 64; ++i) {
    const double x = i / 63.0;
    spi1d += Numbers({x * x, std::sqrt(x), 1.2 * x - 0.1});
  }
  files.push_back({"spi1d", "a.spi1d", spi1d + "}\n"});
  files.push_back({"spi3d", "a.spi3d",
                   "SPILUT 1.0\n3 3\n9 9 9\n" + Cube(9, false, [](int r, int g, int b, const double(&v)[3]) {
                     return std::to_string(r) + " " + std::to_string(g) + " " + std::to_string(b) + " " +
                            Numbers(v);
                   })});
  files.push_back({"spimtx", "a.spimtx", "0.8 0.15 0.05 655.35\n0.1 0.85 0.05 0\n0 0.1 0.9 -655.35\n"});
  files.push_back({"nukevf", "a.vf",
                   "#Inventor V2.1 ascii\ngrid_size 9 9 9\nglobal_transform 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"
                   "element_size 3\ndata\n" +
                       Cube(9, false, [](int, int, int, const double(&v)[3]) { return Numbers(v); })});
  return files;
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_OCIO_LUT_FILES_H_
