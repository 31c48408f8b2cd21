// What files say of their colours, and how they are told.
#include "io/color_state.h"

#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "model/color_spaces.h"
#include "tessera/error.h"
#include "tessera/io.h"

namespace tessera {
namespace io {
namespace {

using OIIO::TypeDesc;

constexpr char kSpace[] = "oiio:ColorSpace", kUnassociated[] = "oiio:UnassociatedAlpha",
               kInteropId[] = "colorInteropID", kProfile[] = "ICCProfile", kCodePoints[] = "CICP";
constexpr size_t kIccHeader = 128, kIccTag = 12, kMostTags = 1024;

// A known space by its own name, another name as it stands.
std::string Named(const std::string& name) {
  const model::ColorSpace* const known = model::FindColorSpace(name);
  return known != nullptr ? known->name() : name;
}

uint32_t BigEndian(const std::vector<std::byte>& bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<uint32_t>(bytes[at + i]);
  return value;
}
bool Holds(const std::vector<std::byte>& bytes, size_t at, const char* text) {
  return at + 4 <= bytes.size() && std::memcmp(bytes.data() + at, text, 4) == 0;
}
bool IsProfile(const std::vector<std::byte>& bytes) {
  return bytes.size() > kIccHeader + 4 && Holds(bytes, 36, "acsp");
}

// A text element's letters: ASCII, or UTF-16, of which those beyond ASCII become question marks.
std::string TextAt(const std::vector<std::byte>& p, size_t at, size_t size) {
  std::string text;
  if (size < 12 || at > p.size() || size > p.size() - at) return text;
  if (Holds(p, at, "desc")) {
    const size_t length = std::min<size_t>(BigEndian(p, at + 8), size - 12);
    for (size_t i = 0; i < length && p[at + 12 + i] != std::byte{0}; ++i)
      text += std::to_integer<char>(p[at + 12 + i]);
  } else if (Holds(p, at, "mluc") && size >= 28 && BigEndian(p, at + 8) > 0) {
    const size_t length = BigEndian(p, at + 20), offset = BigEndian(p, at + 24);
    if (offset > size || length > size - offset) return text;
    for (size_t i = 0; i + 1 < length; i += 2) {
      const auto high = std::to_integer<int>(p[at + offset + i]);
      const auto low = std::to_integer<int>(p[at + offset + i + 1]);
      text += high == 0 && low < 128 ? static_cast<char>(low) : '?';
    }
  }
  return text;
}

}  // namespace

std::string SpaceOfIccProfile(const std::vector<std::byte>& profile) {
  if (!IsProfile(profile)) return "";
  const size_t tags = std::min<size_t>(BigEndian(profile, kIccHeader), kMostTags);
  for (size_t i = 0; i < tags; ++i) {
    const size_t at = kIccHeader + 4 + i * kIccTag;
    if (at + kIccTag > profile.size()) break;
    if (!Holds(profile, at, "desc")) continue;
    const std::string name = TextAt(profile, BigEndian(profile, at + 4), BigEndian(profile, at + 8));
    if (name.starts_with("sRGB")) return "sRGB";  // IEC61966-2.1, built-in, 2014, ...
    const model::ColorSpace* const known = model::FindColorSpace(name);
    return known != nullptr ? known->name() : "";
  }
  return "";
}

ColorState ColorStateOf(const OIIO::ImageSpec& spec) {
  ColorState color;
  color.premultiplied = spec.get_int_attribute(kUnassociated) == 0;
  if (const std::string id(spec.get_string_attribute(kInteropId)); !id.empty()) {
    color.space = Named(id);
  } else if (const auto* const profile = spec.find_attribute(kProfile); profile != nullptr) {
    // One that is not known says all the same that the format's usual space is not this file's.
    const auto* const bytes = static_cast<const std::byte*>(profile->data());
    color.space = SpaceOfIccProfile({bytes, bytes + profile->datasize()});
  } else if (const auto* const codes = spec.find_attribute(kCodePoints, TypeDesc(TypeDesc::INT, 4));
             codes != nullptr) {
    const auto* const known = model::FindColorSpace(codes->get_int_indexed(0), codes->get_int_indexed(1));
    if (known != nullptr) color.space = known->name();
  } else if (const auto* const found = spec.find_attribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8));
             found != nullptr) {
    std::array<float, 8> xy = {};
    for (int i = 0; i < 8; ++i) xy[static_cast<size_t>(i)] = found->get_float_indexed(i);
    const auto* const known = model::FindColorSpace(xy);
    if (known != nullptr) color.space = known->name();
  } else if (const std::string name(spec.get_string_attribute(kSpace));
             OIIO::Strutil::iequals(name, "Linear")) {
    // Formats with a gamma of their own have video's primaries; of EXR the library says no more than this.
    color.space = spec.find_attribute("oiio:Gamma") != nullptr ? "lin_rec709" : model::kSceneLinear;
  } else {
    color.space = Named(name);
  }
  return color;
}

void SetColorSpace(OIIO::ImageSpec& spec, const ColorState& color) {
  const model::ColorSpace* const known = model::FindColorSpace(color.space);
  const std::string name = color.space == model::kSceneLinear ? "Linear"
                           : known != nullptr                 ? known->oiio
                                                              : color.space;
  if (name.empty()) {
    spec.erase_attribute(kSpace);
  } else {
    spec.attribute(kSpace, name);
  }
}

void SetExrColorState(OIIO::ImageSpec& spec, const ColorState& color) {
  const model::ColorSpace* const known = model::FindColorSpace(color.space);
  if (known != nullptr && known->linear)
    spec.attribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8), known->chromaticities.data());
  const std::string& id = known != nullptr ? known->interop : color.space;
  if (!id.empty() && id != model::kSceneLinear) spec.attribute(kInteropId, id);
}

void SetCodePoints(OIIO::ImageSpec& spec, const ColorState& color) {
  const model::ColorSpace* const known = model::FindColorSpace(color.space);
  // sRGB, Rec.709 and linear light have chunks of their own, that more viewers know.
  if (known == nullptr || known->cicp_transfer == 0 || !known->oiio.empty()) return;
  constexpr int kRgb = 0, kFullRange = 1;
  const int codes[4] = {known->cicp_primaries, known->cicp_transfer, kRgb, kFullRange};
  spec.attribute(kCodePoints, TypeDesc(TypeDesc::INT, 4), codes);
}

}  // namespace io

Node WithIccProfile(const Node& image, const std::vector<std::byte>& profile) {
  if (!io::IsProfile(profile)) {
    throw Error("ICC profile", "found " + std::to_string(profile.size()) +
                                   " bytes without its mark, expected a profile (\"acsp\" from byte 36 on)");
  }
  return WithColorState(
      image, {io::SpaceOfIccProfile(profile), tessera::ColorStateOf(image.spec()).premultiplied}, profile);
}

std::vector<std::byte> IccProfileOf(const ImageSpec& spec) {
  if (spec.metadata) {
    for (const Attribute& a : *spec.metadata) {
      if (a.name == io::kProfile) return a.bytes;
    }
  }
  return {};
}

}  // namespace tessera
