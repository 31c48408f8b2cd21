// Where the volume and the texture of --volume come from.
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <sstream>
#include <string>

#include "base/digest.h"
#include "model/volume_data.h"
#include "ops/volume/words.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"
#include "tessera/mesh.h"
#include "tessera/render.h"

namespace tessera::ops::volume {
namespace {

constexpr double kMeshSide = 1.6;  // of the volume's 2

std::array<int, 3> SizesOf(const std::vector<double>& v) {
  std::array<int, 3> size;
  for (size_t a = 0; a < 3; ++a) {
    const double n = v[v.size() == 1 ? 0 : a];
    if (n != std::floor(n) || n < 1 || n > 4096) {
      throw Error("volume:dims", "found " + std::to_string(n) + ", expected whole numbers from 1 to 4096");
    }
    size[a] = static_cast<int>(n);
  }
  return size;
}

// The same for where the volume comes from: a distance field made (field), samples (raw), a file that
// describes itself (file), or the image below (image).
void RequireSourceUsed(const Arguments& a) {
  static constexpr Use kSourcesOf[] = {
      {"dims", "field raw"},    {"type", "field raw distance"}, {"range", "field distance"},
      {"slices", "file image"}, {"channel", "file image"},      {"part", "file"},
      {"header", "raw"},        {"bigendian", "raw"},           {"signed", "raw"}};
  const bool made = a.Given("solid") || a.Given("mesh");
  const std::string source = made ? "field" : !a.Given("file") ? "image" : a.Given("dims") ? "raw" : "file";
  for (const Use& use : kSourcesOf) {
    if (!a.Given(use.name) || Holds(use.words, source)) continue;
    if (a.Given("distance") && Holds(use.words, "distance")) continue;
    Refuse(use.name,
           source == "field"   ? (a.Given("solid") ? "solid=" : "mesh=")
           : source == "image" ? "an image as the source"
           : source == "raw"   ? "raw samples (file= with dims=)"
                               : "a file that describes itself (file= without dims=)",
           source == "raw"                               ? "a file that describes itself"
           : Holds(use.words, "raw") && source == "file" ? "dims= too"
                                                         : "another source");
  }
  const std::string type = a.Given("type") ? a.Text("type") : "uint8";
  if (a.Flag("signed") && type != "uint16") Refuse("signed", "type=" + type, "type=uint16");
}

// The distances that integers are to keep: beyond the levels that are drawn, or all outside would be taken
// for the soft region. 0 where the default does.
double RangeOf(const Arguments& a, const VolumeSpec& spec) {
  const double range = a.Number("range");
  const bool integers = spec.type == PixelType::kUint8 || spec.type == PixelType::kUint16;
  if (!integers || ChoiceOf<VolumeMode>(a, "mode", kModes) >= VolumeMode::kOver) return range;
  constexpr double kWidestSoft = 0.12;  // where none is given
  const double soft = a.Number("soft") < 0 ? kWidestSoft : a.Number("soft");
  const double furthest = std::max(std::fabs(a.Number("iso")), std::fabs(a.Number("iso") + soft));
  if (range > 0) {
    if (range > furthest) return range;
    throw Error("volume:range", "found " + std::to_string(range) + " for integers, expected more than " +
                                    std::to_string(furthest) + ", the furthest level, or type=float");
  }
  double longest = 0;
  for (size_t k = 0; k < 3; ++k) longest = std::max(longest, spec.size[k] * spec.spacing[k]);
  constexpr double kMargin = 1.05;
  return kMargin * furthest > longest / 8 ? kMargin * furthest : 0;
}

// What samples may take: what was said here, or what was left of the memory that was stated for the whole
// line.
size_t MemoryOf(const Arguments& a) {
  const double said = a.Number("memory");
  return said == 0 ? Context::Default().limits().whole : static_cast<size_t>(std::max(1.0, said * 0x1p20));
}

// What tells volumes apart: the values of words.
std::string WordsOf(const Arguments& a, std::initializer_list<const char*> names) {
  std::ostringstream words;
  words.precision(17);
  for (const char* name : names) {
    const Arguments::Value& value = a.values.at(name);
    words << name << '=' << value.given << ' ' << value.text;
    for (const double n : value.numbers) words << ' ' << n;
    words << '\n';
  }
  return words.str();
}
// What tells a file as it is now from what it will be; empty where the name is no file.
std::string StampOf(const std::string& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error) return "";
  const auto time = std::filesystem::last_write_time(file, error);
  if (error) return "";
  return std::filesystem::absolute(file, error).string() + " " + std::to_string(size) + " " +
         std::to_string(time.time_since_epoch().count()) + "\n";
}
// In memory: of a paged volume, bounds of blocks alone, since what is resident goes whenever it has to.
size_t BytesOf(const VolumeSpec& spec) {
  size_t bytes = spec.type == PixelType::kUint8 ? 1 : spec.type == PixelType::kFloat ? 4 : 2;
  for (const int n : spec.size) bytes *= static_cast<size_t>(n) + model::kVolumeBorder;
  const bool paged = spec.memory != 0 && bytes > spec.memory;
  return paged ? bytes / 32 : bytes + bytes / 4;  // with bounds of blocks
}
Volume Kept(const std::string& key, size_t bytes, const std::function<Volume()>& make) {
  return *Context::Default().Cached<Volume>("volume\n" + key, bytes,
                                            [&] { return std::make_shared<const Volume>(make()); });
}

Volume FieldOfWords(const Arguments& a, PixelType type, const Vector3& spacing, std::string& key) {
  const std::array<int, 3> size = SizesOf(a.Given("dims") ? a.Numbers("dims") : std::vector<double>{128});
  VolumeSpec spec = VolumeSpec::Centred(size, type, spacing);
  spec.memory = MemoryOf(a);
  const double range = RangeOf(a, spec);
  key = WordsOf(a, {"solid", "mesh", "dims", "type", "spacing"}) + std::to_string(range) + " " +
        std::to_string(spec.memory) + "\n";
  if (a.Given("solid")) {
    return Kept(key, BytesOf(spec),
                [&] { return DistanceField(Solid::Parse(a.Text("solid")), spec, range); });
  }
  const std::string stamp = StampOf(a.Text("mesh"));
  const auto make = [&] {
    Mesh mesh = ReadMesh(a.Text("mesh"));
    FitMesh(mesh, kMeshSide);
    try {
      return DistanceField(mesh, spec, range);
    } catch (const Error& error) {
      throw DataError(a.Text("mesh"), error.reason());
    }
  };
  key = stamp.empty() ? "" : key + stamp;
  return key.empty() ? make() : Kept(key, BytesOf(spec), make);
}

Volume FileOfWords(const Arguments& a, PixelType type, const Vector3& spacing, std::string& key) {
  VolumeFileParams f;
  f.spacing = spacing;
  f.slices = a.Integer("slices");
  f.channel = a.Integer("channel");
  if (a.Given("part")) f.part = a.Text("part");
  if (a.Given("dims")) f.raw.size = SizesOf(a.Numbers("dims"));
  f.raw.type = a.Given("type") ? type : PixelType::kUint8;
  f.raw.header = a.Integer("header");
  f.raw.big_endian = a.Flag("bigendian");
  f.raw.is_signed = a.Flag("signed");
  f.memory = MemoryOf(a);
  const auto make = [&] { return ReadVolume(a.Text("file"), f); };
  const std::string stamp = StampOf(a.Text("file"));
  if (stamp.empty()) return make();
  key = WordsOf(a, {"file", "dims", "type", "spacing", "slices", "channel", "part", "header", "bigendian",
                    "signed"}) +
        std::to_string(f.memory) + " " + stamp;
  std::error_code error;
  const size_t size = std::filesystem::file_size(a.Text("file"), error);
  return Kept(key, f.memory != 0 && size > f.memory ? size / 32 : 2 * size, make);
}

std::vector<TransferPoint> Ramp(std::initializer_list<std::array<double, 4>> stops) {
  std::vector<TransferPoint> points;
  for (const auto& s : stops) points.push_back({s[0], {s[1], s[2], s[3]}, 1});
  return points;
}

// The numbers of a list; false for a text that is none.
bool NumbersOf(const std::string& text, std::vector<double>& numbers) {
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (at < end) {
    double n = 0;
    const auto [next, error] = std::from_chars(at, end, n);
    if (error != std::errc() || (next != end && *next != ',')) return false;
    numbers.push_back(n);
    at = next + 1;
  }
  return true;
}

// Samples of a file as a block of texture that repeats.
NoiseBlock BlockOfFile(const std::string& file) {
  Volume volume = ReadVolume(file);
  std::array<int, 3> n = volume.spec().size;
  if (n[2] == 1 && n[0] > 0 && n[1] / n[0] == n[0] && n[1] % n[0] == 0) {  // slices one above the other
    volume = ReadVolume(file, {.raw = {}, .slices = n[0]});
    n = volume.spec().size;
  }
  if (n[0] != n[1] || n[0] != n[2] || n[0] < 4 || n[0] > 256) {
    throw DataError("volume:block", "found " + std::to_string(n[0]) + "x" + std::to_string(n[1]) + "x" +
                                        std::to_string(n[2]) + " samples in " + file +
                                        ", expected a cube of 4 to 256 a side");
  }
  std::vector<float> samples;
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) samples.push_back(static_cast<float>(volume.At(x, y, z)));
    }
  }
  return NoiseBlock(samples, n[0], 1);
}

}  // namespace

Volume VolumeOfWords(std::span<const Node> inputs, const Arguments& a) {
  if (int{a.Given("solid")} + int{a.Given("mesh")} + int{a.Given("file")} > 1)
    throw Error(kWordsName, "found more than one of solid=, mesh= and file=, expected one source");
  RequireSourceUsed(a);
  const auto type = ChoiceOf<PixelType>(a, "type", kTypes);
  const Vector3 spacing = VectorOf(a.Numbers("spacing"));
  Volume volume;
  std::string key;  // empty: not kept
  if (a.Given("solid") || a.Given("mesh")) {
    volume = FieldOfWords(a, type, spacing, key);
  } else if (a.Given("file")) {
    volume = FileOfWords(a, type, spacing, key);
  } else {
    const Node& stack = inputs.back();
    const Image slices = Render(stack, stack.spec().type);
    volume = Volume::FromImage(slices.view(), std::max(a.Integer("slices"), 1), a.Integer("channel"), spacing,
                               MemoryOf(a));
    // A distance field costs a hundred times as much as telling whether it is that of the last picture.
    if (a.Given("distance"))
      key = base::DigestText(slices.view()) + WordsOf(a, {"slices", "channel", "spacing"}) +
            std::to_string(MemoryOf(a)) + "\n";
  }
  if (!a.Given("distance")) return volume;
  DistanceFieldParams d;
  d.iso = a.Number("distance");
  d.type = a.Given("type") && !(a.Given("file") && a.Given("dims")) ? type : PixelType::kUint16;
  VolumeSpec spec = volume.spec();
  spec.type = d.type;
  d.range = RangeOf(a, spec);
  const auto make = [&] { return DistanceField(volume, d); };
  if (key.empty()) return make();
  key += WordsOf(a, {"distance", "type"}) + std::to_string(d.range) + "\n";
  return Kept(key, BytesOf(spec), make);
}

VolumeTransferFunction TransferOfWords(const std::string& text) {
  std::vector<double> v;
  if (!NumbersOf(text, v)) return ReadVolumeTransferFunction(text);
  VolumeTransferFunction t;
  if (v.empty() || v.size() % 5 != 0) {
    throw Error("volume:transfer", "found " + std::to_string(v.size()) +
                                       " numbers, expected value,r,g,b,opacity for each point, or a file");
  }
  for (size_t i = 0; i < v.size(); i += 5)
    t.points.push_back({v[i], {v[i + 1], v[i + 2], v[i + 3]}, v[i + 4]});
  return t;
}

void SetTexture(const Arguments& a, VolumeParams& p) {
  if (a.Given("block") && a.Given("texture"))
    throw Error(kWordsName, "found texture= beside block=, expected one of them");
  const std::string& texture = a.Text("texture");
  if (a.Given("block")) {
    p.block = BlockOfFile(a.Text("block"));
    const double low = p.block.low(), high = p.block.high();
    p.colors = Ramp({{low, 0, 0, 0}, {high, 1, 1, 1}});
  } else if (texture == "wood") {
    p.block = NoiseBlock(NoiseContent::kWood, 3, 3);
    p.colors = Ramp(
        {{0, 0.62, 0.40, 0.20}, {0.55, 0.50, 0.29, 0.13}, {0.85, 0.30, 0.15, 0.06}, {1, 0.18, 0.08, 0.03}});
  } else if (texture == "clouds") {
    p.block = NoiseBlock(NoiseContent::kFbm, 4, 5);
    p.colors = Ramp(
        {{-0.35, 0.10, 0.25, 0.62}, {-0.05, 0.28, 0.47, 0.80}, {0.15, 0.80, 0.85, 0.90}, {0.4, 1, 1, 1}});
  }
  if (!a.Given("ramp")) return;
  std::vector<double> v;
  if (!NumbersOf(a.Text("ramp"), v)) {
    p.colors = ReadVolumeTransferFunction(a.Text("ramp")).points;
    return;
  }
  if (v.empty() || v.size() % 4 != 0) {
    throw Error("volume:ramp", "found " + std::to_string(v.size()) +
                                   " numbers, expected value,r,g,b for each point, or a file");
  }
  p.colors.clear();
  for (size_t i = 0; i < v.size(); i += 4) p.colors.push_back({v[i], {v[i + 1], v[i + 2], v[i + 3]}, 1});
}

}  // namespace tessera::ops::volume
