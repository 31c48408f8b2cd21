// Conversion of image descriptions between Tessera and OpenImageIO.
#include "io/spec.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "io/color_state.h"
#include "tessera/error.h"

namespace tessera::io {
namespace {

using OIIO::TypeDesc;

constexpr char kColorSpace[] = "oiio:ColorSpace";

constexpr std::pair<PixelType, TypeDesc::BASETYPE> kTypes[] = {{PixelType::kUint8, TypeDesc::UINT8},
                                                               {PixelType::kUint16, TypeDesc::UINT16},
                                                               {PixelType::kHalf, TypeDesc::HALF},
                                                               {PixelType::kFloat, TypeDesc::FLOAT}};

Roi Window(int x, int y, int width, int height) { return {x, y, x + width, y + height}; }

bool IsTileHint(const std::string& name) { return name == "tile_width" || name == "tile_height"; }

Attribute IntAttribute(const std::string& name, int value) {
  Attribute a{name, "int", std::vector<std::byte>(sizeof value), {}};
  std::memcpy(a.bytes.data(), &value, sizeof value);
  return a;
}

}  // namespace

TypeDesc TypeDescOf(PixelType type) { return kTypes[static_cast<int>(type)].second; }

std::optional<PixelType> PixelTypeOf(TypeDesc type) {
  for (const auto& [ours, theirs] : kTypes) {
    if (type == TypeDesc(theirs)) return ours;
  }
  return std::nullopt;
}

PixelType StorageType(const OIIO::ImageSpec& spec) {
  const TypeDesc first = spec.channelformats.empty() ? spec.format : spec.channelformats[0];
  // Mixed types have only float in common (uint16 does not fit in half, nor half in uint16).
  for (const TypeDesc& t : spec.channelformats) {
    if (t != first) return PixelType::kFloat;
  }
  return PixelTypeOf(first).value_or(PixelType::kFloat);
}

ImageSpec SpecFrom(const OIIO::ImageSpec& spec) {
  ImageSpec result;
  result.data_window = Window(spec.x, spec.y, spec.width, spec.height);
  result.display_window = Window(spec.full_x, spec.full_y, spec.full_width, spec.full_height);
  if (result.display_window.empty()) result.display_window = result.data_window;
  for (int c = 0; c < spec.nchannels; ++c) {
    std::string name(spec.channel_name(c));
    result.channels.push_back(name.empty() ? "channel" + std::to_string(c) : name);
  }
  result.alpha = spec.alpha_channel >= 0 && spec.alpha_channel < spec.nchannels ? spec.alpha_channel : -1;
  result.type = StorageType(spec);
  auto metadata = std::make_shared<std::vector<Attribute>>();
  for (const OIIO::ParamValue& p : spec.extra_attribs) {
    const auto base = p.type().basetype;
    if (base == TypeDesc::PTR || base == TypeDesc::UNKNOWN || base == TypeDesc::NONE)
      continue;  // no value to keep
    if (!IsTileHint(p.name().string()) && p.name() != kColorSpace) metadata->push_back(AttributeFrom(p));
  }
  // In one of the known spaces' own name, whichever tag told of it.
  if (const std::string space = ColorStateOf(spec).space; !space.empty())
    metadata->push_back({kColorSpace, "string", {}, {space}});
  if (spec.tile_width > 0 && spec.tile_height > 0) {
    metadata->push_back(IntAttribute("tile_width", spec.tile_width));
    metadata->push_back(IntAttribute("tile_height", spec.tile_height));
  }
  result.metadata = std::move(metadata);
  return result;
}

OIIO::ImageSpec SpecTo(const ImageSpec& spec, PixelType type) {
  OIIO::ImageSpec result(spec.width(), spec.height(), spec.channel_count(), TypeDescOf(type));
  result.x = spec.data_window.x0;
  result.y = spec.data_window.y0;
  const Roi& display = spec.display_window.empty() ? spec.data_window : spec.display_window;
  result.full_x = display.x0;
  result.full_y = display.y0;
  result.full_width = display.width();
  result.full_height = display.height();
  result.channelnames = spec.channels;
  result.alpha_channel = spec.alpha;
  result.z_channel = spec.ChannelIndex("Z");
  if (spec.metadata) {
    for (const Attribute& a : *spec.metadata) {
      if (!IsTileHint(a.name)) SetAttribute(result, a);
    }
  }
  SetColorSpace(result, ColorStateOf(spec));
  return result;
}

Attribute AttributeFrom(const OIIO::ParamValue& value) {
  TypeDesc type = value.type();
  if (value.nvalues() > 1 && type.arraylen == 0) type.arraylen = value.nvalues();
  Attribute result{value.name().string(), type.c_str(), {}, {}};
  if (type.basetype == TypeDesc::STRING) {
    const auto* strings = static_cast<const OIIO::ustring*>(value.data());
    for (size_t i = 0; i < type.basevalues(); ++i) result.strings.push_back(strings[i].string());
  } else {
    const auto* bytes = static_cast<const std::byte*>(value.data());
    result.bytes.assign(bytes, bytes + value.datasize());
  }
  return result;
}

void SetAttribute(OIIO::ImageSpec& spec, const Attribute& a) {
  if (a.bytes.empty() && a.strings.empty()) {
    spec.erase_attribute(a.name, TypeDesc::UNKNOWN, true);
    return;
  }
  const TypeDesc type = ParseType(a.type);
  if (type.basetype == TypeDesc::STRING) {
    if (a.strings.size() != type.basevalues()) {
      throw Error("attribute " + a.name, "found " + std::to_string(a.strings.size()) + " strings, expected " +
                                             std::to_string(type.basevalues()) + " for type " + a.type);
    }
    std::vector<OIIO::ustring> strings(a.strings.begin(), a.strings.end());
    spec.attribute(a.name, type, strings.data());
    return;
  }
  if (type.size() == 0 || a.bytes.size() != type.size()) {
    throw Error("attribute " + a.name, "found " + std::to_string(a.bytes.size()) + " bytes, expected " +
                                           std::to_string(type.size()) + " for type " + a.type);
  }
  spec.attribute(a.name, type, a.bytes.data());
}

TypeDesc ParseType(const std::string& name) {
  const TypeDesc direct(name);
  if (direct.basetype != TypeDesc::UNKNOWN && direct.c_str() == name) return direct;
  std::string element = name;
  int length = 0;
  if (const size_t bracket = name.find('['); bracket != std::string::npos) {
    element = name.substr(0, bracket);
    length = std::atoi(name.c_str() + bracket + 1);
  }
  constexpr TypeDesc::VECSEMANTICS kMeanings[] = {TypeDesc::NOXFORM, TypeDesc::COLOR, TypeDesc::POINT,
                                                  TypeDesc::VECTOR, TypeDesc::NORMAL};
  std::vector<TypeDesc> known = {TypeDesc(TypeDesc::INT, TypeDesc::VEC2, TypeDesc::RATIONAL),
                                 TypeDesc(TypeDesc::UINT, TypeDesc::VEC2, TypeDesc::RATIONAL)};
  for (int base = TypeDesc::UINT8; base <= TypeDesc::DOUBLE; ++base) {
    for (const auto aggregate : {TypeDesc::VEC2, TypeDesc::VEC3, TypeDesc::VEC4}) {
      for (const auto meaning : kMeanings) {
        known.emplace_back(static_cast<TypeDesc::BASETYPE>(base), aggregate, meaning);
      }
    }
    for (const auto aggregate : {TypeDesc::MATRIX33, TypeDesc::MATRIX44}) {
      known.emplace_back(static_cast<TypeDesc::BASETYPE>(base), aggregate);
    }
  }
  for (TypeDesc type : known) {
    if (element == type.c_str()) {
      type.arraylen = length;
      return type;
    }
  }
  return direct;
}

std::string OneLine(std::string_view message, const std::string& temporary, const std::string& shown) {
  std::string line;
  for (const char c : message) {
    const bool blank =
        std::isspace(static_cast<unsigned char>(c)) || std::iscntrl(static_cast<unsigned char>(c));
    if (!blank) line += c;
    if (blank && !line.empty() && line.back() != ' ') line += ' ';
  }
  while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
  if (!temporary.empty()) {
    for (size_t at = 0; (at = line.find(temporary, at)) != std::string::npos; at += shown.size())
      line.replace(at, temporary.size(), shown);
  }
  constexpr size_t kMost = 400;  // a library may have as much to say of each row
  if (line.size() > kMost) line.replace(kMost, std::string::npos, "…");
  return line.empty() ? "OpenImageIO gives no reason" : line;
}

int ChunkRows(const std::string& format, const OIIO::ImageSpec& spec) {
  if (format != "openexr") return 1;
  std::string compression = spec.get_string_attribute("compression", "zip");
  compression = compression.substr(0, compression.find(':'));  // "dwaa:45" carries its level
  constexpr std::pair<const char*, int> kRows[] = {{"none", 1},   {"rle", 1},   {"zips", 1}, {"zip", 16},
                                                   {"pxr24", 16}, {"piz", 32},  {"b44", 32}, {"b44a", 32},
                                                   {"dwaa", 32},  {"dwab", 256}};
  for (const auto& [name, rows] : kRows) {
    if (compression == name) return rows;
  }
  return 1;
}

}  // namespace tessera::io
