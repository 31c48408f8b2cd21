// The words of a Y4M header, one letter and what it says each.
#include "io/video/y4m.h"

#include <charconv>
#include <sstream>
#include <string_view>

#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

constexpr int kLongestSide = 65535;

struct SitingWord {
  const char* word;
  Siting siting;
};
// Of eight bits; more bits have no words for it, and are as H.264 and H.265 have them without a word: left.
constexpr SitingWord kSitings[] = {{"420jpeg", Siting::kCentre},
                                   {"420mpeg2", Siting::kLeft},
                                   {"420paldv", Siting::kTopLeft},
                                   {"420", Siting::kCentre}};

int Side(const std::string& subject, const std::string& word) {
  int side = 0;
  const char* const end = word.data() + word.size();
  const auto [at, error] = std::from_chars(word.data() + 1, end, side);
  if (error != std::errc() || at != end || side < 1 || side > kLongestSide)
    throw DataError(
        subject, "found the size " + word + ", expected W and H from 1 to " + std::to_string(kLongestSide));
  return side;
}

}  // namespace

bool SetY4mColors(const std::string& word, Y4mHeader& header) {
  for (const SitingWord& known : kSitings) {
    if (word != known.word) continue;
    header.pixels = FindPixelFormat("yuv420p"), header.siting = known.siting;
    return true;
  }
  if (word.starts_with("mono")) {
    const std::string depth = word.substr(4);
    header.pixels = FindPixelFormat(depth.empty() ? "gray" : "gray" + depth + "le");
  } else {
    const size_t p = word.find('p');
    const std::string depth = p == std::string::npos ? "" : word.substr(p + 1) + "le";
    header.pixels = FindPixelFormat("yuv" + word.substr(0, p) + "p" + depth);
  }
  header.siting = Siting::kLeft;
  return header.pixels != nullptr;
}

std::vector<std::string> Y4mColorWords() {
  std::vector<std::string> words;
  for (const SitingWord& known : kSitings) words.emplace_back(known.word);
  for (const char* const kind : {"422", "444", "mono"}) words.emplace_back(kind);
  for (const char* const kind : {"420p", "422p", "444p", "mono"}) {
    for (const int bits : {9, 10, 12, 14, 16}) words.push_back(kind + std::to_string(bits));
  }
  return words;
}

Y4mHeader ParseY4mHeader(const std::string& subject, const std::string& line) {
  std::istringstream words(line);
  std::string word;
  if (!(words >> word) || word != kY4mMagic)
    throw DataError(subject, std::string("found no Y4M stream, expected one that begins with ") + kY4mMagic +
                                 "; raw frames need input= and size=");
  Y4mHeader header;
  SetY4mColors("420jpeg", header);
  while (words >> word) {
    const std::string value = word.substr(1);
    if (word[0] == 'W') header.width = Side(subject, word);
    if (word[0] == 'H') header.height = Side(subject, word);
    if (word[0] == 'F') header.rate = value;
    if (word[0] == 'I') header.interlacing = value;
    if (word[0] == 'A') header.aspect = value;
    if (word[0] == 'C' && !SetY4mColors(value, header))
      throw DataError(subject, "found the colour space " + word +
                                   ", expected 4:2:0, 4:2:2, 4:4:4 or mono without alpha, such as C420mpeg2");
    if (word == "XCOLORRANGE=FULL") header.full = true;
    if (word == "XCOLORRANGE=LIMITED") header.full = false;
  }
  if (header.width == 0 || header.height == 0)
    throw DataError(subject, "found a Y4M header without " + std::string(header.width == 0 ? "W" : "H") +
                                 ", expected the size of the frames, such as W1920 H1080");
  return header;
}

std::string Y4mLine(const Y4mHeader& header) {
  const PixelFormat& f = *header.pixels;
  const std::string depth = f.bits == 8 ? "" : std::to_string(f.bits);
  std::string word = f.samples == Samples::kGrey ? "mono" + depth : f.name.substr(3, 3);
  if (f.samples == Samples::kYcc && f.bits > 8) word += "p" + depth;
  std::string sampling = word;
  if (word == "420") {
    for (const SitingWord& known : kSitings) {
      if (known.siting != header.siting) continue;
      word = known.word;
      break;
    }
    sampling = word;
  }
  for (char& c : sampling) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  std::string line = std::string(kY4mMagic) + " W" + std::to_string(header.width) + " H" +
                     std::to_string(header.height) + " F" + header.rate + " I" + header.interlacing + " A" +
                     header.aspect + " C" + word;
  if (f.samples == Samples::kYcc) line += " XYSCSS=" + sampling;
  if (header.full) line += std::string(" XCOLORRANGE=") + (*header.full ? "FULL" : "LIMITED");
  return line + "\n";
}

}  // namespace tessera::io
