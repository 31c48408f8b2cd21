// The list of formats, what their files begin with, how far they can pack pixels.
#include "io/open_input.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <new>
#include <string_view>

#include "base/input_file.h"
#include "base/policy.h"
#include "io/header_bytes.h"
#include "io/npy.h"
#include "io/spec.h"
#include "io/xmp_packets.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

using namespace std::string_view_literals;

struct Start {
  std::string_view bytes;
  size_t at;
  const char* format;
};
constexpr Start kStarts[] = {{"\x76\x2f\x31\x01"sv, 0, "openexr"},
                             {"\x89PNG\r\n\x1a\n"sv, 0, "png"},
                             {"\xff\xd8\xff"sv, 0, "jpeg"},
                             {"II*\0"sv, 0, "tiff"},
                             {"MM\0*"sv, 0, "tiff"},
                             {"II+\0"sv, 0, "tiff"},
                             {"MM\0+"sv, 0, "tiff"},
                             {"SDPX"sv, 0, "dpx"},
                             {"XPDS"sv, 0, "dpx"},
                             {"\x80\x2a\x5f\xd7"sv, 0, "cineon"},
                             {"\xd7\x5f\x2a\x80"sv, 0, "cineon"},
                             {"#?RADIANCE"sv, 0, "hdr"},
                             {"#?RGBE"sv, 0, "hdr"},
                             {"GIF8"sv, 0, "gif"},
                             {"BM"sv, 0, "bmp"},
                             {"WEBP"sv, 8, "webp"},
                             {"\0\0\0\x0cjP  \r\n\x87\n"sv, 0, "jpeg2000"},
                             {"\xff\x4f\xff\x51"sv, 0, "jpeg2000"},
                             {"ftyp"sv, 4, "heif"},
                             {"\x01\xda"sv, 0, "sgi"},
                             {"\x93NUMPY"sv, 0, "npy"},
                             {" BDV"sv, 0, "openvdb"}};
// These begin with numbers or nothing that tells them.
constexpr std::array kByName = {"pnm", "targa", "rla"};

}  // namespace

bool IsTrusted(std::string_view format) {
  return std::any_of(std::begin(kStarts), std::end(kStarts),
                     [&](const Start& s) { return format == s.format; }) ||
         std::find(kByName.begin(), kByName.end(), format) != kByName.end();
}

namespace {

// The format whose reader OpenImageIO has for the name; empty for none.
std::string FormatOfName(const std::string& file) {
  DeclareNumPy();
  std::string extension = std::filesystem::path(file).extension().string();
  if (extension.size() < 2) return "";
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const auto& [format, extensions] : OIIO::get_extension_map()) {
    if (std::find(extensions.begin(), extensions.end(), extension.substr(1)) != extensions.end())
      return format;
  }
  return "";
}

std::string FormatOfContents(const std::string& file) {
  base::InputFile stream(file, "an image file");
  std::array<char, 16> bytes{};
  stream.read(bytes.data(), bytes.size());
  const std::string_view start(bytes.data(), static_cast<size_t>(stream.gcount()));
  for (const Start& s : kStarts) {
    if (start.size() > s.at && start.substr(s.at).starts_with(s.bytes)) return s.format;
  }
  return "";
}

std::unique_ptr<OIIO::ImageInput> OpenAs(const std::string& file, const std::string& format) {
  CheckHeaderBytes(file, format);
  CheckXmp(file, format);
  auto input = OIIO::ImageInput::create(format);
  if (input == nullptr) throw DataError(file, "cannot be read as an image: " + OneLine(OIIO::geterror()));
  OIIO::ImageSpec spec;
  if (!input->open(file, spec))
    throw DataError(file, "cannot be read as an image: " + OneLine(input->geterror()));
  return input;
}

}  // namespace

bool IsListed(const std::string& file) {
  const std::string named = FormatOfName(file);
  return (named.empty() || IsTrusted(named)) && !FormatOfContents(file).empty();
}

std::unique_ptr<OIIO::ImageInput> OpenImage(const std::string& file, Formats formats) {
  try {
    if (formats == Formats::kAll && !Context::Default().policy().listed_formats && !IsListed(file)) {
      auto input = OIIO::ImageInput::open(file);
      if (!input) throw DataError(file, "cannot be read as an image: " + OneLine(OIIO::geterror()));
      return input;
    }
    const std::string named = FormatOfName(file), held = FormatOfContents(file);
    // A raw photograph begins as a TIFF file does and is none.
    if (!named.empty() && !IsTrusted(named)) {
      throw DataError(file, "found the format " + named +
                                ", whose reader is not guarded against damaged files; for files that you "
                                "trust, --formats all reads it");
    }
    if (!held.empty()) return OpenAs(file, held);
    if (!named.empty()) return OpenAs(file, named);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    throw DataError(file, OneLine(e.what()));
  }
  throw DataError(file,
                  "cannot be read as an image: neither its name nor its first bytes are those of a format "
                  "that is read");
}

void CheckPlausible(const std::string& file, const std::string& format, const OIIO::ImageSpec& spec,
                    int64_t file_bytes) {
  // What a byte becomes at most: deflate makes 1032 of it, LZW's longest code 2^12; half of the samples of
  // YCbCr may be shared by four pixels. The others pack a flat picture into their headers.
  constexpr struct {
    std::string_view format, packing;
    double most;
  } kPackings[] = {
      {"tiff", "none", 4}, {"tiff", "packbits", 100}, {"tiff", "lzw", 4096}, {"tiff", "zip", 1100},
      {"png", "", 1100},   {"openexr", "none", 2},    {"bmp", "", 256},      {"npy", "", 1}};
  constexpr double kMostOfOthers = 20000, kUnsuspicious = 1 << 24, kHeader = 64;
  const std::string packing(spec.get_string_attribute("compression"));
  double most = kMostOfOthers, free = kUnsuspicious;
  for (const auto& p : kPackings) {
    if (p.format == format && (p.packing.empty() || p.packing == packing)) most = p.most, free = 0;
  }
  const int bits =
                spec.get_int_attribute("tiff:BitsPerSample", spec.get_int_attribute("oiio:BitsPerSample", 0)),
            stored = 8 * static_cast<int>(spec.format.size());
  double bytes = static_cast<double>(spec.image_pixels()) * static_cast<double>(spec.pixel_bytes(true));
  if (bits > 0 && bits < stored) bytes *= static_cast<double>(bits) / stored;
  if (spec.get_int_attribute("tiff:PhotometricInterpretation", 0) == 3) bytes /= 3;  // a palette's codes
  if (bytes <= free || bytes / most <= static_cast<double>(file_bytes) + kHeader) return;
  throw DataError(file, "found " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                            " pixels of " + std::to_string(spec.nchannels) +
                            " channels declared in a file of " + std::to_string(file_bytes) +
                            " bytes, expected a plausible size");
}

}  // namespace tessera::io
