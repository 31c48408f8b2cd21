// What a file or an image is, in oiiotool's words: OpenImageIO's own text of a spec, hashes, pixels.
#include <OpenImageIO/hash.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <regex>

#include "io/image_file.h"
#include "io/npy.h"
#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"

namespace tessera {
namespace {

using OIIO::Strutil::sprintf;

std::regex Pattern(const std::string& text) {
  try {
    return std::regex(text, std::regex::extended | std::regex::icase);
  } catch (const std::regex_error& e) {
    throw Error("metamatch",
                "found \"" + text + "\", expected a regular expression (POSIX extended): " + e.what());
  }
}

constexpr char kResolution[] = "resolution, width, height, depth, channels";

// Which lines are told.
class Choice {
 public:
  explicit Choice(const InfoOptions& options)
      : match_(!options.match.empty()), leave_(!options.no_match.empty()) {
    if (match_) pattern_ = Pattern(options.match);
    if (leave_) left_ = Pattern(options.no_match);
  }
  bool Tells(const std::string& name) const { return !match_ || std::regex_search(name, pattern_); }
  bool TellsLine(const std::string& line) const {
    const std::string name = line.substr(0, line.find(": "));
    return Tells(name) && !(leave_ && std::regex_search(name, left_));
  }

 private:
  bool match_, leave_;
  std::regex pattern_, left_;
};

// A type as one letter and its bits.
std::string BriefType(OIIO::TypeDesc type, int bits) {
  if (type.basetype == OIIO::TypeDesc::FLOAT) return "f";
  if (type.basetype == OIIO::TypeDesc::HALF) return "h";
  return (type.is_floating_point() ? "f" : type.is_signed() ? "i" : "u") + std::to_string(bits);
}

struct Part {
  OIIO::ImageSpec spec;
  std::string format, hash;
};

std::string SizesOf(const std::vector<Part>& parts) {
  std::string line = sprintf("    %d subimages: ", static_cast<int>(parts.size()));
  for (size_t i = 0; i < parts.size(); ++i) {
    const OIIO::ImageSpec& spec = parts[i].spec;
    const int bits = spec.get_int_attribute("oiio:BitsPerSample", static_cast<int>(spec.format.size()) * 8);
    line += sprintf("%s%dx%d ", i > 0 ? ", " : "", spec.width, spec.height);
    for (int c = 0; c < spec.nchannels; ++c)
      line += (c > 0 ? "," : "[") + BriefType(spec.channelformat(c), bits);
    line += "]";
  }
  return line;
}

// One image of several, in lines.
std::string Told(const std::string& file, const std::vector<Part>& parts, size_t at,
                 const InfoOptions& options, const Choice& choice) {
  const Part& part = parts[at];
  std::vector<std::string> lines;
  OIIO::Strutil::split(
      part.spec.serialize(
          options.xml ? OIIO::ImageSpec::SerialXML : OIIO::ImageSpec::SerialText,
          options.verbose ? OIIO::ImageSpec::SerialDetailedHuman : OIIO::ImageSpec::SerialBrief),
      lines, "\n");
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  const auto second = [&](const std::string& line) {
    lines.insert(lines.begin() + std::min<ptrdiff_t>(1, static_cast<ptrdiff_t>(lines.size())), line);
  };
  if (!part.hash.empty()) second(options.xml ? "<SHA1>" + part.hash + "</SHA1>" : "    SHA-1: " + part.hash);
  const bool heads = choice.Tells(kResolution);
  if (options.xml) {
    if (parts.size() > 1) second(sprintf("<subimages>%d</subimages>", static_cast<int>(parts.size())));
  } else if (!heads) {
    lines.erase(lines.begin());
  } else {
    const std::string plain = lines[0];
    if (at > 0) {
      lines[0] = sprintf(" subimage %2d: %s", static_cast<int>(at), plain);
    } else if (!file.empty()) {
      lines[0] = file + std::string(file.size() < 20 ? 20 - file.size() : 0, ' ') + " : " + plain;
    }
    if (!part.format.empty()) lines[0] += " " + part.format;
    if (!options.verbose && parts.size() > 1)
      lines[0] += sprintf(" (%d subimages)", static_cast<int>(parts.size()));
    if (parts.size() > 1 && at == 0 && options.all) second(" subimage  0: " + plain + " " + part.format);
    if (at == 0 && options.verbose && parts.size() > 1) second(SizesOf(parts));
  }
  std::string text;
  for (size_t i = 0; i < lines.size(); ++i) {
    const bool head = i == 0 && heads && !options.xml;
    if (head || choice.TellsLine(lines[i]))
      text += (head ? lines[i] : OIIO::Strutil::unescape_chars(lines[i])) + "\n";
  }
  return text;
}

std::vector<Part> PartsOf(const std::string& file, const InfoOptions& options) {
  const size_t count = std::max<size_t>(1, Subimages(file, options.formats).size());
  std::vector<Part> parts;
  for (size_t k = 0; k < count; ++k) {
    ReadOptions read;
    read.subimage = static_cast<int>(k);
    read.formats = options.formats;
    const auto image = io::OpenFile({file, read});
    parts.push_back({image->header().spec, image->header().format, ""});
    if (options.hash && (k == 0 || options.all))
      parts.back().hash = PixelHash(file, static_cast<int>(k), options.formats);
  }
  return parts;
}

// The pixels of a file in the type that they are read as, all at once.
struct Pixels {
  OIIO::ImageSpec spec;
  PixelType type;
  std::vector<std::byte> bytes;
};
Pixels PixelsOf(const std::string& file, int subimage, Formats formats) {
  ReadOptions read;
  read.subimage = subimage;
  read.formats = formats;
  const auto image = io::OpenFile({file, read});
  const OIIO::ImageSpec& spec = image->header().spec;
  Pixels result{spec, io::StorageType(spec), {}};
  result.bytes.resize(static_cast<size_t>(spec.image_pixels()) * static_cast<size_t>(spec.nchannels) *
                      PixelBytes(result.type));
  image->ReadAll(0, spec.nchannels, result.type, result.bytes.data());
  return result;
}

// The pixel at `at`: codes and, in parentheses, what they stand for; floats alone.
std::string PixelText(const Pixels& pixels, size_t at, bool c) {
  const char* const separator = c ? ", " : " ";
  const size_t bytes = PixelBytes(pixels.type);
  std::string codes, values;
  for (size_t k = 0; k < static_cast<size_t>(pixels.spec.nchannels); ++k) {
    const std::byte* const p = pixels.bytes.data() + (at + k) * bytes;
    float value = 0;
    OIIO::convert_pixel_values(io::TypeDescOf(pixels.type), p, OIIO::TypeFloat, &value);
    uint16_t code = 0;
    std::memcpy(&code, p, std::min(bytes, sizeof code));
    codes += (k > 0 ? separator : "") + std::to_string(code);
    values += k > 0 ? separator : "";
    if (pixels.type <= PixelType::kUint16) {
      values += OIIO::Strutil::fmt::format("{}", value);
    } else {
      values += std::isnan(value) ? "nan" : std::isinf(value) ? "inf" : sprintf("%.9f", value);
    }
  }
  if (pixels.type > PixelType::kUint16) return values;
  return codes + (c ? " /* (" : " (") + values + (c ? ") */" : ")");
}

}  // namespace

std::string InfoText(const std::string& file, const InfoOptions& options) {
  const Choice choice(options);
  const std::vector<Part> parts = PartsOf(file, options);
  std::string text;
  for (size_t k = 0; k < (options.all ? parts.size() : 1); ++k) text += Told(file, parts, k, options, choice);
  return text;
}

std::string InfoText(const ImageSpec& spec, const std::vector<Attribute>& own, const InfoOptions& options) {
  OIIO::ImageSpec theirs = io::SpecTo(spec, spec.type);
  for (const Attribute& item : own) io::SetAttribute(theirs, item);
  return Told("", {{theirs, "", ""}}, 0, options, Choice(options));
}

std::string PixelHash(const std::string& file, int subimage, Formats formats) {
  const Pixels pixels = PixelsOf(file, subimage, formats);
  OIIO::SHA1 sha(pixels.bytes.data(), pixels.bytes.size());
  return sha.digest();
}

void DumpPixels(const std::string& file, int subimage, const DumpOptions& options,
                const std::function<void(const std::string&)>& print) {
  const Pixels pixels = PixelsOf(file, subimage, options.formats);
  const OIIO::ImageSpec& spec = pixels.spec;
  const bool c = !options.c_name.empty();
  if (c) {
    print(sprintf("%s%s %s[%d][%d][%d] =\n{\n", PixelTypeName(pixels.type),
                  pixels.type <= PixelType::kUint16 ? "_t" : "", options.c_name, spec.height, spec.width,
                  spec.nchannels));
  }
  const auto count = static_cast<size_t>(spec.nchannels);
  size_t at = 0;
  for (int y = 0; y < spec.height * std::max(1, spec.depth); ++y) {
    for (int x = 0; x < spec.width; ++x, at += count) {
      const std::byte* const first = pixels.bytes.data() + at * PixelBytes(pixels.type);
      if (!options.empty && std::all_of(first, first + count * PixelBytes(pixels.type),
                                        [](std::byte b) { return b == std::byte{0}; }))
        continue;
      std::string line = c ? sprintf("  %s/* (%d, %d): */ { ", x == 0 ? "{ " : "  ", x + spec.x, y + spec.y)
                           : sprintf("    Pixel (%d, %d): ", x + spec.x, y + spec.y);
      line += PixelText(pixels, at, c);
      if (c) line += x + 1 < spec.width ? " }," : " } },";
      print(line + "\n");
    }
  }
  if (c) print("};\n");
}

std::string FormatList() {
  io::DeclareNumPy();
  std::string text = "All OIIO supported formats and their extensions:\n";
  for (const auto& [format, extensions] : OIIO::get_extension_map())
    text += "    " + format + " : " + OIIO::Strutil::join(extensions, ", ") + "\n";
  return text;
}

}  // namespace tessera
