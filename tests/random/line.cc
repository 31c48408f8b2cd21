// A case in the words of the command line.
#include <cstdio>

#include "random/shrink.h"

namespace tessera::random {
namespace {

std::string Geometry(const Roi& r) {
  std::string text = std::to_string(r.width()) + "x" + std::to_string(r.height());
  if (r.x0 == 0 && r.y0 == 0) return text;
  char offset[32];
  std::snprintf(offset, sizeof offset, "%+d%+d", r.x0, r.y0);
  return text + offset;
}

std::string Modifiers(const Words& words) {
  std::string text;
  for (const auto& [key, value] : words.modifiers) {
    const bool quote = value.find(':') != std::string::npos;
    text += ":" + key + "=" + (quote ? "\"" + value + "\"" : value);
  }
  return text.find_first_of("()*;&|<> \"'") == std::string::npos ? text : "'" + text + "'";
}

// What makes a picture alike: the pattern that is nearest.
std::string PictureWords(const Picture& p) {
  const std::string shape = Geometry(p.window) + " " + std::to_string(p.channels);
  const std::string seed = std::to_string(p.seed);
  switch (p.content) {
    case Content::kFlat:
      return "--pattern constant:color=0.2,0.4,0.6,0.8 " + shape;
    case Content::kChecker:
      return "--pattern checker:width=" + std::to_string(1 + p.seed % 9) +
             ":height=" + std::to_string(1 + p.seed % 9) + ":color1=0.8,0.6,0.4,1:color2=0.2,0.3,0.5,1 " +
             shape;
    case Content::kNoise:
      return "--pattern white:color=1:seed=" + seed + " " + shape;
    case Content::kWide:
      return "--pattern white:color=1:signed=1:seed=" + seed + " " + shape;
    default:
      return std::string(ContentName(p.content)) + "." + seed + "." + Geometry(p.window) + "." +
             std::to_string(p.channels) +
             (p.type == PixelType::kFloat || p.type == PixelType::kHalf ? ".exr" : ".tif");
  }
}

std::string ValueWords(const Case& c, int value) {
  const int pictures = static_cast<int>(c.pictures.size());
  if (value < pictures) return PictureWords(c.pictures[static_cast<size_t>(value)]);
  const Step& step = c.steps[static_cast<size_t>(value - pictures)];
  std::string text;
  if (step.op->generator) {
    return "--pattern " + step.op->name + Modifiers(step.words) + " " + Geometry(step.window) + " " +
           std::to_string(step.channels);
  }
  for (size_t k = 0; k < step.inputs.size(); ++k) {
    text += k > 0 && step.inputs[k] == step.inputs[k - 1] ? "--dup " : ValueWords(c, step.inputs[k]) + " ";
  }
  text += "--" + step.op->name + Modifiers(step.words);
  for (const std::string& word : step.words.positional) text += " " + word;
  return text;
}

}  // namespace

std::string CommandLine(const Case& c) {
  return "tessera " + ValueWords(c, c.values() - 1) + " -d " + PixelTypeName(c.type) + " -o out." +
         (!c.format.empty()            ? c.format
          : c.type == PixelType::kHalf ? "exr"
                                       : "tif");
}

std::string InWords(const Case& c) {
  std::string text =
      "case " + std::to_string(c.seed) + " " + std::to_string(c.index) + "\n  " + CommandLine(c);
  for (const Picture& p : c.pictures) text += "\n  picture: " + p.Words();
  text += "\n  result " + std::string(PixelTypeName(c.type)) + ", tiles " + std::to_string(c.tile_width) +
          "x" + std::to_string(c.tile_height) + ", threads " + std::to_string(c.threads) +
          ", caller's pixels " + c.layout.Words() + (c.partial ? " in part" : "");
  return text;
}

}  // namespace tessera::random
