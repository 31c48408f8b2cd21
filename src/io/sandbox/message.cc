// Descriptions of images as bytes, whole: attributes are kept bit for bit.
#include "io/sandbox/message.h"

#include <stdexcept>
#include <vector>

#include "io/spec.h"

namespace tessera::io::sandbox {
namespace {

using OIIO::TypeDesc;

[[noreturn]] void Refuse() { throw std::runtime_error("its reader sent what is no description of an image"); }

// The numbers of a spec, in one order for both ways.
template <typename Spec, typename Visit>
void VisitNumbers(Spec& spec, const Visit& visit) {
  for (auto* number :
       {&spec.x, &spec.y, &spec.z, &spec.width, &spec.height, &spec.depth, &spec.full_x, &spec.full_y,
        &spec.full_z, &spec.full_width, &spec.full_height, &spec.full_depth, &spec.tile_width,
        &spec.tile_height, &spec.tile_depth, &spec.nchannels, &spec.alpha_channel, &spec.z_channel})
    visit(*number);
}

void PutType(MessageWriter& message, const TypeDesc& type) {
  message.Put<uint8_t>(type.basetype).Put<uint8_t>(type.aggregate).Put<uint8_t>(type.vecsemantics);
  message.Put<int32_t>(type.arraylen);
}

// Of pixels or of an attribute that has a value.
TypeDesc GetType(MessageReader& message) {
  const auto base = message.Get<uint8_t>(), aggregate = message.Get<uint8_t>(),
             meaning = message.Get<uint8_t>();
  const auto length = message.Get<int32_t>();
  const bool known = aggregate == TypeDesc::SCALAR || aggregate == TypeDesc::VEC2 ||
                     aggregate == TypeDesc::VEC3 || aggregate == TypeDesc::VEC4 ||
                     aggregate == TypeDesc::MATRIX33 || aggregate == TypeDesc::MATRIX44;
  if (base >= TypeDesc::LASTBASE || base == TypeDesc::PTR || !known || length < 0) Refuse();
  return {static_cast<TypeDesc::BASETYPE>(base), static_cast<TypeDesc::AGGREGATE>(aggregate),
          static_cast<TypeDesc::VECSEMANTICS>(meaning), length};
}

bool HasValue(const TypeDesc& type) {
  return type.basetype != TypeDesc::PTR && type.basetype != TypeDesc::UNKNOWN &&
         type.basetype != TypeDesc::NONE && type.arraylen >= 0;
}

void PutAttribute(MessageWriter& message, const OIIO::ParamValue& value) {
  message.PutText(value.name().string());
  PutType(message, value.type());
  message.Put<int32_t>(value.nvalues()).Put<uint8_t>(value.interp());
  if (value.type().basetype != TypeDesc::STRING) {
    message.PutText({static_cast<const char*>(value.data()), static_cast<size_t>(value.datasize())});
    return;
  }
  const auto* const strings = static_cast<const OIIO::ustring*>(value.data());
  const size_t count = value.type().basevalues() * static_cast<size_t>(value.nvalues());
  message.Put<uint64_t>(count);
  for (size_t i = 0; i < count; ++i) message.PutText(strings[i].string());
}

OIIO::ParamValue GetAttribute(MessageReader& message) {
  const OIIO::ustring name(message.GetText());
  const TypeDesc type = GetType(message);
  const auto count = message.Get<int32_t>();
  const auto interpolation = message.Get<uint8_t>();
  if (!HasValue(type) || count < 1 || interpolation > OIIO::ParamValue::INTERP_VERTEX) Refuse();
  const auto how = static_cast<OIIO::ParamValue::Interp>(interpolation);
  if (type.basetype != TypeDesc::STRING) {
    const std::string bytes = message.GetText();
    // The product may be larger than 64 bits.
    if (type.size() == 0 || bytes.size() % type.size() != 0 ||
        bytes.size() / type.size() != static_cast<size_t>(count))
      Refuse();
    return {name, type, count, how, bytes.data()};
  }
  std::vector<OIIO::ustring> strings(message.GetCount(sizeof(uint64_t)));
  if (strings.size() % type.basevalues() != 0 ||
      strings.size() / type.basevalues() != static_cast<size_t>(count))
    Refuse();
  for (OIIO::ustring& text : strings) text = OIIO::ustring(message.GetText());
  return {name, type, count, how, strings.data()};
}

}  // namespace

Shape ShapeOf(const OIIO::ImageSpec& spec) {
  return {spec.x,         spec.y,          spec.width,       spec.height,      spec.depth,
          spec.nchannels, spec.tile_width, spec.tile_height, StorageType(spec)};
}

std::string_view MessageReader::Take(uint64_t size) {
  if (size > left_.size()) Refuse();
  const std::string_view taken = left_.substr(0, size);
  left_.remove_prefix(size);
  return taken;
}

size_t MessageReader::GetCount(size_t least) {
  const auto count = Get<uint64_t>();
  if (count > left_.size() / least) Refuse();
  return count;
}

MessageWriter& MessageWriter::PutSpec(const OIIO::ImageSpec& spec) {
  VisitNumbers(spec, [&](int number) { Put<int32_t>(number); });
  Put<uint8_t>(spec.deep);
  PutType(*this, spec.format);
  Put<uint64_t>(spec.channelformats.size());
  for (const TypeDesc& type : spec.channelformats) PutType(*this, type);
  Put<uint64_t>(spec.channelnames.size());
  for (const std::string& name : spec.channelnames) PutText(name);
  uint64_t attributes = 0;
  for (const OIIO::ParamValue& value : spec.extra_attribs) attributes += HasValue(value.type()) ? 1 : 0;
  Put(attributes);
  for (const OIIO::ParamValue& value : spec.extra_attribs) {
    if (HasValue(value.type())) PutAttribute(*this, value);
  }
  return *this;
}

OIIO::ImageSpec MessageReader::GetSpec() {
  OIIO::ImageSpec spec;
  VisitNumbers(spec, [&](int& number) { number = Get<int32_t>(); });
  spec.deep = GetFlag();
  spec.format = GetType(*this);
  spec.channelformats.resize(GetCount(1));
  for (TypeDesc& type : spec.channelformats) type = GetType(*this);
  spec.channelnames.resize(GetCount(sizeof(uint64_t)));
  for (std::string& name : spec.channelnames) name = GetText();
  const auto channels = static_cast<size_t>(spec.nchannels);
  if (!HasValue(spec.format) || spec.nchannels < 0 || spec.channelnames.size() > channels ||
      (!spec.channelformats.empty() && spec.channelformats.size() != channels))
    Refuse();
  const size_t attributes = GetCount(sizeof(uint64_t));
  for (size_t i = 0; i < attributes; ++i) spec.extra_attribs.push_back(GetAttribute(*this));
  return spec;
}

}  // namespace tessera::io::sandbox
