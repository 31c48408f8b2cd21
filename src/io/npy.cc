// Arrays of one to three dimensions as images: a text of Python that says type, order and shape, and the
// samples. Source: numpy.lib.format, versions 1.0 to 3.0.
#include "io/npy.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <climits>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::io {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr uint32_t kLongestHeader = 1 << 16;
constexpr bool kLittle = std::endian::native == std::endian::little;

struct Kind {
  std::string_view code;  // without the order of bytes
  OIIO::TypeDesc::BASETYPE type;
};
constexpr Kind kKinds[] = {
    {"u1", OIIO::TypeDesc::UINT8},  {"i1", OIIO::TypeDesc::INT8},   {"b1", OIIO::TypeDesc::UINT8},
    {"u2", OIIO::TypeDesc::UINT16}, {"i2", OIIO::TypeDesc::INT16},  {"u4", OIIO::TypeDesc::UINT32},
    {"i4", OIIO::TypeDesc::INT32},  {"u8", OIIO::TypeDesc::UINT64}, {"i8", OIIO::TypeDesc::INT64},
    {"f2", OIIO::TypeDesc::HALF},   {"f4", OIIO::TypeDesc::FLOAT},  {"f8", OIIO::TypeDesc::DOUBLE}};

// What the header says.
struct Header {
  OIIO::TypeDesc::BASETYPE type = OIIO::TypeDesc::UINT8;
  bool truths = false;   // 0 and 1, which are shown as black and white
  bool swapped = false;  // bytes of the other order
  bool columns = false;  // Fortran's order: the first index runs fastest
  std::vector<int64_t> shape;
};

// The text behind 'key':, without blanks before it.
std::optional<std::string_view> ValueOf(std::string_view text, std::string_view key) {
  for (const char quote : {'\'', '"'}) {
    const size_t at = text.find(std::string(1, quote) + std::string(key) + quote);
    if (at == std::string_view::npos) continue;
    text.remove_prefix(at + key.size() + 2);
    const size_t colon = text.find_first_not_of(" \t");
    if (colon == std::string_view::npos || text[colon] != ':') return std::nullopt;
    text.remove_prefix(colon + 1);
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
    return text;
  }
  return std::nullopt;
}

// Empty for a header as it should be, else what is wrong.
std::string Parse(std::string_view text, Header& header) {
  const auto descr = ValueOf(text, "descr"), order = ValueOf(text, "fortran_order"),
             shape = ValueOf(text, "shape");
  if (!descr || !order || !shape) return "found a header without descr, fortran_order and shape";
  if (descr->empty() || ((*descr)[0] != '\'' && (*descr)[0] != '"'))
    return "found an array of records, expected numbers";
  const size_t end = descr->find((*descr)[0], 1);
  if (end == std::string_view::npos) return "found a type without an end";
  const std::string_view type = descr->substr(1, end - 1);
  const Kind* known = nullptr;
  for (const Kind& kind : kKinds) {
    if (type.size() == 3 && type.substr(1) == kind.code) known = &kind;
  }
  if (known == nullptr || std::string_view("<>|=").find(type[0]) == std::string_view::npos) {
    return "found the type " + std::string(type.substr(0, 20)) +
           ", expected integers, truth values or floats of 2, 4 or 8 bytes";
  }
  header.type = known->type, header.truths = known->code == "b1";
  header.swapped = known->code[1] != '1' && type[0] == (kLittle ? '>' : '<');
  if (!order->starts_with("True") && !order->starts_with("False"))
    return "found no fortran_order of True or False";
  header.columns = order->starts_with("True");
  if (!shape->starts_with("(")) return "found no shape in brackets";
  const size_t close = shape->find(')');
  if (close == std::string_view::npos) return "found a shape without an end";
  std::string_view rest = shape->substr(1, close - 1);
  for (;;) {
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t,"), rest.size()));
    if (rest.empty()) break;
    int64_t side = 0;
    const auto [p, error] = std::from_chars(rest.data(), rest.data() + rest.size(), side);
    if (error != std::errc() || side < 0) return "found a shape that is none of whole numbers";
    header.shape.push_back(side);
    rest.remove_prefix(static_cast<size_t>(p - rest.data()));
    if (!rest.empty() && rest[0] == 'L') rest.remove_prefix(1);  // Python 2's
  }
  return "";
}

void SwapBytes(std::byte* samples, size_t count, size_t size) {
  for (size_t i = 0; i < count; ++i) std::reverse(samples + i * size, samples + (i + 1) * size);
}

class NumPyInput final : public OIIO::ImageInput {
 public:
  ~NumPyInput() override { NumPyInput::close(); }
  const char* format_name() const override { return "npy"; }
  int supports(OIIO::string_view feature) const override { return feature == "ioproxy"; }
  bool open(const std::string& name, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
    ioproxy_retrieve_from_config(config);
    return open(name, spec);
  }
  bool open(const std::string& name, OIIO::ImageSpec& spec) override {
    if (!ioproxy_use_or_open(name)) return false;
    std::string text;
    if (!ReadHeader(text)) return false;
    const std::string wrong = Parse(text, header_);
    if (!wrong.empty()) return Refuse(wrong);
    const std::vector<int64_t>& shape = header_.shape;
    if (shape.empty() || shape.size() > 3) {
      return Refuse("found an array of " + std::to_string(shape.size()) +
                    " dimensions, expected 1 to 3 (height, width, channels)");
    }
    const int64_t rows = shape.size() == 1 ? 1 : shape[0], columns = shape[shape.size() == 1 ? 0 : 1],
                  channels = shape.size() == 3 ? shape[2] : 1;
    if (rows < 1 || columns < 1 || channels < 1) return Refuse("found an array without elements");
    if (rows > INT_MAX || columns > INT_MAX || channels > 65534)
      return Refuse("found an array that is too large");
    // Of what the file has, so that no product is too large: sides below 2^31 each.
    const auto size = static_cast<int64_t>(OIIO::TypeDesc(header_.type).size());
    const int64_t left = (static_cast<int64_t>(ioproxy()->size()) - start_) / size;
    if (rows > left || columns > left / rows || channels > left / rows / columns)
      return Refuse("found fewer samples than the shape says");
    m_spec = OIIO::ImageSpec(static_cast<int>(columns), static_cast<int>(rows), static_cast<int>(channels),
                             header_.type);
    if (channels == 2) m_spec.channelnames = {"X", "Y"}, m_spec.alpha_channel = -1;
    if (header_.columns && !ReadColumns()) return false;
    spec = m_spec;
    return true;
  }
  bool close() override {
    ioproxy_clear();
    all_.clear();
    header_ = {};
    return true;
  }
  bool read_native_scanline(int subimage, int miplevel, int y, int, void* data) override {
    const lock_guard lock(*this);
    if (subimage != 0 || miplevel != 0 || y < 0 || y >= m_spec.height) return false;
    auto* const samples = static_cast<std::byte*>(data);
    const auto size = OIIO::TypeDesc(header_.type).size();
    const size_t count = static_cast<size_t>(m_spec.width) * static_cast<size_t>(m_spec.nchannels);
    if (header_.columns) {
      const auto height = static_cast<size_t>(m_spec.height), width = static_cast<size_t>(m_spec.width),
                 channels = static_cast<size_t>(m_spec.nchannels);
      for (size_t x = 0; x < width; ++x) {
        for (size_t c = 0; c < channels; ++c) {
          std::memcpy(samples + (x * channels + c) * size,
                      all_.data() + (static_cast<size_t>(y) + height * (x + width * c)) * size, size);
        }
      }
    } else if (!ioseek(start_ + int64_t{y} * static_cast<int64_t>(count * size)) ||
               !ioread(samples, size, count)) {
      return false;
    }
    if (header_.swapped) SwapBytes(samples, count, size);
    for (size_t i = 0; i < count && header_.truths; ++i)
      samples[i] = samples[i] == std::byte{0} ? std::byte{0} : std::byte{255};
    return true;
  }

 private:
  bool Refuse(const std::string& what) {
    errorfmt("{}", what);
    close();
    return false;
  }
  bool ReadHeader(std::string& text) {
    std::array<unsigned char, 12> start{};
    if (!ioread(start.data(), 1, 10) || std::memcmp(start.data(), kMagic.data(), kMagic.size()) != 0)
      return Refuse("found no NumPy array");
    const int version = start[6];
    if (version < 1 || version > 3)
      return Refuse("found version " + std::to_string(version) + ", expected 1 to 3");
    uint32_t length = start[8] | uint32_t{start[9]} << 8;
    start_ = 10;
    if (version > 1) {
      if (!ioread(start.data() + 10, 1, 2)) return Refuse("found a header that is cut off");
      length |= uint32_t{start[10]} << 16 | uint32_t{start[11]} << 24;
      start_ = 12;
    }
    if (length > kLongestHeader)
      return Refuse("found a header of " + std::to_string(length) + " bytes, expected fewer");
    text.resize(length);
    if (length == 0 || !ioread(text.data(), 1, length)) return Refuse("found a header that is cut off");
    start_ += length;
    return true;
  }
  // The first index runs fastest: every row is all over the file.
  bool ReadColumns() {
    const size_t bytes = m_spec.image_bytes(true);
    all_.resize(bytes);
    return ioread(all_.data(), 1, bytes) || Refuse("found fewer samples than the shape says");
  }

  Header header_;
  int64_t start_ = 0;  // of the samples
  std::vector<std::byte> all_;
};

class NumPyOutput final : public OIIO::ImageOutput {
 public:
  ~NumPyOutput() override { NumPyOutput::close(); }
  const char* format_name() const override { return "npy"; }
  int supports(OIIO::string_view feature) const override {
    return feature == "ioproxy" || feature == "nchannels" || feature == "alpha";
  }
  bool open(const std::string& name, const OIIO::ImageSpec& spec, OpenMode mode) override {
    if (mode != Create || spec.depth > 1) {
      errorfmt("holds one flat image");
      return false;
    }
    m_spec = spec;
    const Kind* kind = nullptr;
    for (const Kind& k : kKinds) {
      if (k.type == spec.format.basetype && k.code != "b1") kind = &k;
    }
    if (kind == nullptr) {
      kind = std::find_if(std::begin(kKinds), std::end(kKinds), [](const Kind& k) { return k.code == "f4"; });
      m_spec.set_format(OIIO::TypeFloat);
    }
    ioproxy_retrieve_from_config(m_spec);
    if (!ioproxy_use_or_open(name)) return false;
    std::string text = std::string("{'descr': '") +
                       (kind->code[1] == '1' ? '|'
                        : kLittle            ? '<'
                                             : '>') +
                       std::string(kind->code) + "', 'fortran_order': False, 'shape': (" +
                       std::to_string(spec.height) + ", " + std::to_string(spec.width);
    text += spec.nchannels == 1 ? "), }" : ", " + std::to_string(spec.nchannels) + "), }";
    // Samples begin at a multiple of 64 bytes, and a line's end is before them.
    constexpr size_t kBefore = 10, kStep = 64;
    text.append(kStep - 1 - (kBefore + text.size()) % kStep, ' ');
    text += '\n';
    std::string start(kMagic);
    start += {'\1', '\0', static_cast<char>(text.size() & 255), static_cast<char>(text.size() >> 8)};
    return iowrite(start.data(), 1, start.size()) && iowrite(text.data(), 1, text.size());
  }
  bool close() override {
    ioproxy_clear();
    return true;
  }
  bool write_scanline(int y, int z, OIIO::TypeDesc format, const void* data, OIIO::stride_t stride) override {
    m_spec.auto_stride(stride, format, m_spec.nchannels);
    data = to_native_scanline(format, data, stride, scratch_, dither_, y, z);
    return iowrite(data, 1, m_spec.scanline_bytes(true));
  }

 private:
  std::vector<unsigned char> scratch_;
  unsigned int dither_ = 0;
};

}  // namespace

void DeclareNumPy() {
  static std::once_flag once;
  std::call_once(once, [] {
    // OpenImageIO lists its own formats when it is first asked for any, unless there are some by then.
    OIIO::get_string_attribute("extension_list");
    static const char* extensions[] = {"npy", nullptr};
    OIIO::declare_imageio_format(
        "npy", []() -> OIIO::ImageInput* { return new NumPyInput; }, extensions,
        []() -> OIIO::ImageOutput* { return new NumPyOutput; }, extensions, "tessera");
  });
}

}  // namespace tessera::io
