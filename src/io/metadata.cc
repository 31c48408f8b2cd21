// Metadata items made of text, and text made of them.
#include "tessera/metadata.h"

#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <charconv>
#include <cstring>
#include <vector>

#include "io/spec.h"
#include "tessera/error.h"

namespace tessera {
namespace {

using OIIO::TypeDesc;

template <typename T>
bool Parse(std::string_view text, T& value) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

template <typename T>
void Append(T value, std::vector<std::byte>& bytes) {
  const size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(&bytes[at], &value, sizeof value);
}

template <typename T>
bool Append(std::string_view text, std::vector<std::byte>& bytes) {
  T value{};
  if (!Parse(text, value)) return false;
  Append(value, bytes);
  return true;
}

bool AppendAs(TypeDesc::BASETYPE type, std::string_view text, std::vector<std::byte>& bytes) {
  switch (type) {
    case TypeDesc::INT8:
      return Append<int8_t>(text, bytes);
    case TypeDesc::UINT8:
      return Append<uint8_t>(text, bytes);
    case TypeDesc::INT16:
      return Append<int16_t>(text, bytes);
    case TypeDesc::UINT16:
      return Append<uint16_t>(text, bytes);
    case TypeDesc::INT32:
      return Append<int32_t>(text, bytes);
    case TypeDesc::UINT32:
      return Append<uint32_t>(text, bytes);
    case TypeDesc::FLOAT:
      return Append<float>(text, bytes);
    case TypeDesc::DOUBLE:
      return Append<double>(text, bytes);
    default:
      return false;
  }
}

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// Hours, minutes, seconds and frames as SMPTE 12M packs them, two decimal digits each; user bits are 0.
bool AppendTimeCode(std::string_view text, std::vector<std::byte>& bytes) {
  uint32_t packed = 0;
  const std::vector<std::string_view> fields = Split(text, ':');
  constexpr uint32_t kMost[] = {23, 59, 59, 29};
  if (fields.size() != 4) return false;
  for (size_t i = 0; i < 4; ++i) {
    uint32_t value = 0;
    if (!Parse(fields[i], value) || value > kMost[i]) return false;
    packed |= (value / 10 << 4 | value % 10) << (24 - 8 * i);
  }
  Append(packed, bytes);
  Append(uint32_t{0}, bytes);
  return true;
}

}  // namespace

Attribute ParseAttribute(const std::string& name, const std::string& text, const std::string& type_name) {
  Attribute result{name, type_name, {}, {}};
  if (type_name.empty()) {
    if (Append<int>(text, result.bytes)) {
      result.type = "int";
    } else if (Append<float>(text, result.bytes)) {
      result.type = "float";
    } else {
      result.type = "string", result.strings = {text};
    }
    return result;
  }
  const TypeDesc type = type_name == "timecode"   ? OIIO::TypeTimeCode
                        : type_name == "rational" ? OIIO::TypeRational
                                                  : io::ParseType(type_name);
  const auto base = static_cast<TypeDesc::BASETYPE>(type.basetype);
  const bool known = base == TypeDesc::STRING || (base >= TypeDesc::UINT8 && base <= TypeDesc::DOUBLE);
  if (!known || type.arraylen < 0 || type.basevalues() > 4096) {
    throw Error(name,
                "found the type \"" + type_name +
                    "\", expected one such as int, float, string, float[3], rational, timecode or matrix");
  }
  result.type = type.c_str();
  bool right = true;
  if (base == TypeDesc::STRING) {
    if (type.basevalues() == 1) {
      result.strings = {text};
    } else {
      for (const std::string_view part : Split(text, ',')) result.strings.emplace_back(part);
    }
    right = result.strings.size() == type.basevalues();
  } else if (type == OIIO::TypeTimeCode && text.find(':') != std::string::npos) {
    right = AppendTimeCode(text, result.bytes);
  } else {
    const bool ratio = type == OIIO::TypeRational && text.find('/') != std::string::npos;
    for (const std::string_view part : Split(text, ratio ? '/' : ','))
      right = right && AppendAs(base, part, result.bytes);
    right = right && result.bytes.size() == type.size();
  }
  if (!right) {
    throw Error(name,
                "found \"" + text + "\", expected " +
                    (type == OIIO::TypeTimeCode ? std::string("HH:MM:SS:FF")
                     : type.basevalues() == 1   ? "a value of the type " + type_name
                                                : std::to_string(type.basevalues()) +
                                                    " comma-separated values for the type " + type_name));
  }
  return result;
}

std::string AttributeText(const Attribute& attribute) {
  if (attribute.strings.size() == 1) return attribute.strings[0];
  OIIO::ImageSpec spec;
  io::SetAttribute(spec, attribute);
  const OIIO::ParamValue* const value = spec.find_attribute(attribute.name);
  return value == nullptr ? "" : OIIO::ImageSpec::metadata_val(*value);
}

std::optional<std::string> DescribedValue(const ImageSpec& spec, const std::vector<Attribute>& own,
                                          const std::string& name) {
  OIIO::ImageSpec theirs = io::SpecTo(spec, spec.type);
  for (const Attribute& item : own) io::SetAttribute(theirs, item);
  OIIO::ParamValue room;
  const OIIO::ParamValue* const value = theirs.find_attribute(name, room);
  if (value == nullptr) return std::nullopt;
  if (value->type() == OIIO::TypeString) return std::string(value->get_ustring().string());
  return OIIO::ImageSpec::metadata_val(*value);
}

}  // namespace tessera
