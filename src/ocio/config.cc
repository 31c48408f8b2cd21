// Finds configs, colour spaces, displays, views and looks; the public functions on top of them.
#include "ocio/config.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "base/input_file.h"
#include "model/color_spaces.h"
#include "model/lookup_settings.h"
#include "ocio/built_in_config.h"
#include "ops/registry.h"
#include "tessera/color_state.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"

namespace tessera {
namespace ocio {

std::string OneLine(const std::string& text) {
  std::string line;
  for (const char c : text) {
    const bool space = std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!space) {
      line += c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  // Of a file that no reader took, what the reader of its extension said is told.
  constexpr char kReason[] = "' failed with: ";
  if (const size_t at = line.find(kReason); at != std::string::npos) {
    line.erase(0, at + sizeof kReason - 1);
    if (const size_t next = line.find(kReason); next != std::string::npos) line.erase(line.rfind(" '", next));
  }
  while (!line.empty() && (line.back() == ' ' || line.back() == '.')) line.pop_back();
  return line;
}

namespace {

namespace fs = std::filesystem;

// `folder`: where they must be, links followed; empty for anywhere.
void RequireFilesOf(const std::string& config, const fs::path& folder,
                    const lib::ConstTransformRcPtr& transform, const lib::ConstContextRcPtr& context) {
  if (const auto group = OCIO_DYNAMIC_POINTER_CAST<const lib::GroupTransform>(transform)) {
    for (int i = 0; i < group->getNumTransforms(); ++i)
      RequireFilesOf(config, folder, group->getTransform(i), context);
  }
  const auto file = OCIO_DYNAMIC_POINTER_CAST<const lib::FileTransform>(transform);
  if (file == nullptr) return;
  std::string found;
  try {
    found = context->resolveFileLocation(file->getSrc());
  } catch (const lib::Exception&) {
    lib::ClearAllCaches();  // the next config may find one there
    return;                 // a file that is missing is missed when it is asked for
  }
  RequireLutFile(found);
  if (folder.empty()) return;
  std::error_code code;
  const fs::path place = fs::canonical(found, code);
  if (!code && std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first == folder.end())
    return;
  throw DataError(config,
                  "names the file " + base::Shown(found) + ", expected files of its own folder alone");
}

// The files that a config names are opened by OpenColorIO.
void RequireFilesOf(const Config& named) {
  const lib::Config& config = *named.config;
  fs::path folder;
  if (named.name != kBuiltInConfig && Context::Default().policy().configs_inside)
    folder = fs::weakly_canonical(fs::absolute(named.name)).parent_path();
  const auto require = [&](const lib::ConstTransformRcPtr& transform) {
    RequireFilesOf(named.name, folder, transform, named.context);
  };
  const int spaces = config.getNumColorSpaces(lib::SEARCH_REFERENCE_SPACE_ALL, lib::COLORSPACE_ALL);
  for (int i = 0; i < spaces; ++i) {
    const auto space = config.getColorSpace(
        config.getColorSpaceNameByIndex(lib::SEARCH_REFERENCE_SPACE_ALL, lib::COLORSPACE_ALL, i));
    if (space == nullptr) continue;
    for (const auto way : {lib::COLORSPACE_DIR_TO_REFERENCE, lib::COLORSPACE_DIR_FROM_REFERENCE})
      require(space->getTransform(way));
  }
  for (int i = 0; i < config.getNumLooks(); ++i) {
    const auto look = config.getLook(config.getLookNameByIndex(i));
    if (look == nullptr) continue;
    require(look->getTransform());
    require(look->getInverseTransform());
  }
  for (int i = 0; i < config.getNumViewTransforms(); ++i) {
    const auto view = config.getViewTransform(config.getViewTransformNameByIndex(i));
    if (view == nullptr) continue;
    for (const auto way : {lib::VIEWTRANSFORM_DIR_TO_REFERENCE, lib::VIEWTRANSFORM_DIR_FROM_REFERENCE})
      require(view->getTransform(way));
  }
  for (int i = 0; i < config.getNumNamedTransforms(lib::NAMEDTRANSFORM_ALL); ++i) {
    const auto other =
        config.getNamedTransform(config.getNamedTransformNameByIndex(lib::NAMEDTRANSFORM_ALL, i));
    if (other == nullptr) continue;
    for (const auto way : {lib::TRANSFORM_DIR_FORWARD, lib::TRANSFORM_DIR_INVERSE})
      require(other->getTransform(way));
  }
}

}  // namespace

Config LoadConfig(const OcioParams& params) {
  Config c;
  // OpenColorIO's GetEnvVariable answers in one string that all threads share.
  const char* const variable = std::getenv("OCIO");
  c.name = !params.config.empty()                  ? params.config
           : variable != nullptr && *variable != 0 ? variable
                                                   : kBuiltInConfig;
  if (c.name == kBuiltInConfig) {
    std::istringstream text(BuiltInConfigText());
    c.config = Guarded(c.name, [&] { return lib::Config::CreateFromStream(text); });
  } else {
    base::RequireFile(c.name, "an OpenColorIO config", base::kMostText);
    c.config = Guarded(c.name, [&] {
      lib::ConstConfigRcPtr config = lib::Config::CreateFromFile(c.name.c_str());
      config->validate();
      return config;
    });
  }
  const lib::ContextRcPtr context = c.config->getCurrentContext()->createEditableCopy();
  for (const auto& [key, value] : params.context) context->setStringVar(key.c_str(), value.c_str());
  c.context = context;
  RequireFilesOf(c);
  return c;
}

namespace {

constexpr char kCurrent[] = "current";  // as OpenImageIO calls the space that an image is in

[[noreturn]] void Unknown(const Config& config, const std::string& kind, const std::string& name,
                          const std::vector<std::string>& known) {
  const std::string near = ops::Nearest(name, known);
  std::string reason = "found no " + kind + " \"" + name + "\" in this config";
  if (known.empty()) {
    reason += ", which has none";
  } else if (!near.empty()) {
    reason += "; did you mean \"" + near + "\"?";
  } else {
    constexpr size_t kShown = 12;
    reason += ", expected one of";
    for (size_t i = 0; i < known.size() && i < kShown; ++i)
      reason += (i > 0 ? ", \"" : " \"") + known[i] + "\"";
    if (known.size() > kShown) reason += ", …";
  }
  throw DataError(config.name, reason);
}

// What may name a colour space, names first.
std::vector<std::string> SpaceNames(const lib::Config& config) {
  std::vector<std::string> names;
  const int spaces = config.getNumColorSpaces(lib::SEARCH_REFERENCE_SPACE_ALL, lib::COLORSPACE_ALL);
  for (int i = 0; i < spaces; ++i) {
    names.emplace_back(
        config.getColorSpaceNameByIndex(lib::SEARCH_REFERENCE_SPACE_ALL, lib::COLORSPACE_ALL, i));
  }
  for (size_t i = 0, count = names.size(); i < count; ++i) {
    const lib::ConstColorSpaceRcPtr space = config.getColorSpace(names[i].c_str());
    for (size_t k = 0; k < space->getNumAliases(); ++k) names.emplace_back(space->getAlias(k));
  }
  for (int i = 0; i < config.getNumRoles(); ++i) names.emplace_back(config.getRoleName(i));
  return names;
}

std::vector<std::string> Displays(const lib::Config& config) {
  std::vector<std::string> names;
  for (int i = 0; i < config.getNumDisplaysAll(); ++i) names.emplace_back(config.getDisplayAll(i));
  return names;
}
std::vector<std::string> Views(const lib::Config& config, const std::string& display) {
  std::vector<std::string> names;
  for (const auto type : {lib::VIEW_SHARED, lib::VIEW_DISPLAY_DEFINED}) {
    for (int i = 0; i < config.getNumViews(type, display.c_str()); ++i) {
      names.emplace_back(config.getView(type, display.c_str(), i));
    }
  }
  return names;
}
std::vector<std::string> Looks(const lib::Config& config) {
  std::vector<std::string> names;
  for (int i = 0; i < config.getNumLooks(); ++i) names.emplace_back(config.getLookNameByIndex(i));
  return names;
}

// Every name of a list of looks: separated by commas, colons or bars, with a sign.
void RequireLooks(const Config& config, const std::string& looks) {
  std::string name;
  for (const char c : looks + ",") {
    if (c != ',' && c != ':' && c != '|') {
      name += c;
      continue;
    }
    const size_t first = name.find_first_not_of(" \t+-"), last = name.find_last_not_of(" \t");
    if (first != std::string::npos) {
      RequireOneOf(config, "look", name.substr(first, last - first + 1), Looks(*config.config));
    }
    name.clear();
  }
}

// The result of a conversion, in the space of that name.
Node In(const std::string& space, const Node& result) {
  return WithColorState(result, {space, ColorStateOf(result.spec()).premultiplied});
}

// The colour space that a view of a display leads to.
std::string ShownSpace(const Config& config, const std::string& display, const std::string& view) {
  const char* const name = config.config->getDisplayViewColorSpaceName(display.c_str(), view.c_str());
  const std::string space = name != nullptr ? name : "";
  return space.empty() || space == lib::OCIO_VIEW_USE_DISPLAY_NAME ? display : space;
}

// A correction leaves the space as it is; where a table leads nobody says.
std::string AfterFile(const std::string& file, const ImageSpec& spec) {
  const std::string extension = LowerExtension(file);
  return extension == ".cc" || extension == ".ccc" || extension == ".cdl" ? ColorStateOf(spec).space : "";
}

lib::TransformDirection Direction(bool inverse) {
  return inverse ? lib::TRANSFORM_DIR_INVERSE : lib::TRANSFORM_DIR_FORWARD;
}

// `transform` of the config on the image, between division and multiplication by alpha where asked.
Node Apply(const Node& image, const Config& config, const lib::ConstTransformRcPtr& transform, bool inverse,
           bool unpremult, const std::string& subject, const TableFilter* filter = nullptr) {
  if (image.spec().channel_count() < 3) {
    return AsColors(image, [&](const Node& colors) {
      return Apply(colors, config, transform, inverse, unpremult, subject, filter);
    });
  }
  const lib::ConstProcessorRcPtr processor = Guarded(
      subject, [&] { return config.config->getProcessor(config.context, transform, Direction(inverse)); });
  // Colours that are not multiplied need no division.
  if (!unpremult || !ColorStateOf(image.spec()).premultiplied)
    return Translate(image, processor, subject, filter);
  return Repremultiply(Translate(Unpremultiply(image), processor, subject, filter));
}

// A CLF's own interpolation stands whatever is asked for here.
lib::Interpolation InterpolationOf(const std::optional<TableFilter>& filter) {
  switch (filter.value_or(TableFilter::kTetrahedral)) {
    case TableFilter::kNearest:
      return lib::INTERP_NEAREST;
    case TableFilter::kLinear:
      return lib::INTERP_LINEAR;
    default:
      return lib::INTERP_BEST;
  }
}

const TableFilter* Asked(const LutParams& params) { return params.filter ? &*params.filter : nullptr; }

lib::FileTransformRcPtr FileTransformOf(const std::string& file, const LutParams& params) {
  if (params.filter && model::HasMipChain(*params.filter))
    throw Error(file, "found a filter of mip levels, expected nearest, linear, tetrahedral or cubic");
  const lib::FileTransformRcPtr transform = lib::FileTransform::Create();
  transform->setSrc(file.c_str());
  transform->setInterpolation(InterpolationOf(params.filter));
  transform->setCCCId(params.cccid.empty() ? "0" : params.cccid.c_str());
  return transform;
}

}  // namespace

void RequireOneOf(const Config& config, const std::string& kind, const std::string& name,
                  const std::vector<std::string>& known) {
  // Names of OpenColorIO do not depend on case.
  const auto same = [&](const std::string& k) {
    return k.size() == name.size() && std::equal(k.begin(), k.end(), name.begin(), [](char a, char b) {
             return std::tolower(static_cast<unsigned char>(a)) ==
                    std::tolower(static_cast<unsigned char>(b));
           });
  };
  if (std::none_of(known.begin(), known.end(), same)) Unknown(config, kind, name, known);
}

std::string RequireColorSpace(const Config& config, const std::string& name) {
  if (config.config->getColorSpace(name.c_str()) == nullptr &&
      config.config->getNamedTransform(name.c_str()) == nullptr) {
    Unknown(config, "colour space", name, SpaceNames(*config.config));
  }
  return name;
}

std::string SpaceOf(const Config& config, const std::string& name, const ImageSpec& spec) {
  if (!name.empty() && name != kCurrent) return RequireColorSpace(config, name);
  const std::string own = ColorStateOf(spec).space;
  if (own.empty()) return RequireColorSpace(config, lib::ROLE_SCENE_LINEAR);
  if (config.config->getColorSpace(own.c_str()) != nullptr) return own;
  if (const model::ColorSpace* const known = model::FindColorSpace(own); known != nullptr) {
    for (const std::string& other : known->names) {
      if (config.config->getColorSpace(other.c_str()) != nullptr) return other;
    }
  }
  throw Error(config.name, "found an image in the colour space \"" + own +
                               "\", which this config does not have, expected one named as the space it is "
                               "converted from");
}

std::string OwnName(const Config& config, const std::string& name) {
  const lib::ConstColorSpaceRcPtr space = config.config->getColorSpace(name.c_str());
  if (space == nullptr) return "";  // a named transform leads nowhere known
  if (model::FindColorSpace(space->getName()) != nullptr) return space->getName();
  // An alias may be what others know it by.
  for (size_t k = 0; k < space->getNumAliases(); ++k) {
    if (model::FindColorSpace(space->getAlias(k)) != nullptr) return space->getAlias(k);
  }
  return space->getName();
}

}  // namespace ocio

Node ColorConvert(const Node& image, const std::string& from, const std::string& to,
                  const OcioParams& params) {
  const ocio::Config config = ocio::LoadConfig(params);
  const auto transform = ocio::lib::ColorSpaceTransform::Create();
  transform->setSrc(ocio::SpaceOf(config, from, image.spec()).c_str());
  transform->setDst(ocio::RequireColorSpace(config, to).c_str());
  return ocio::In(ocio::OwnName(config, to),
                  ocio::Apply(image, config, transform, false, params.unpremult, "colorconvert"));
}

bool HasColorSpace(const std::string& name, const OcioParams& params) {
  return ocio::LoadConfig(params).config->getColorSpace(name.c_str()) != nullptr;
}

Node OcioDisplay(const Node& image, const std::string& display, const std::string& view,
                 const OcioDisplayParams& display_params, const OcioParams& params) {
  const ocio::Config config = ocio::LoadConfig(params);
  const bool inverse = display_params.inverse;
  // Undone, the image is the display's and `from` is where it goes.
  const std::string from = ocio::SpaceOf(config, display_params.from, inverse ? ImageSpec() : image.spec());
  std::string shown = display, shown_view = view;
  if (shown.empty()) shown = config.config->getDefaultDisplay();
  ocio::RequireOneOf(config, "display", shown, ocio::Displays(*config.config));
  if (shown_view.empty()) shown_view = config.config->getDefaultView(shown.c_str());
  ocio::RequireOneOf(config, "view", shown_view, ocio::Views(*config.config, shown));
  const auto transform = ocio::lib::DisplayViewTransform::Create();
  transform->setSrc(from.c_str());
  transform->setDisplay(shown.c_str());
  transform->setView(shown_view.c_str());
  const std::string result =
      ocio::OwnName(config, inverse ? from : ocio::ShownSpace(config, shown, shown_view));
  if (display_params.looks.empty()) {
    return ocio::In(result, ocio::Apply(image, config, transform, inverse, params.unpremult, "ociodisplay"));
  }
  // The looks in place of the view's own, then the view.
  ocio::RequireLooks(config, display_params.looks);
  const auto look = ocio::lib::LookTransform::Create();
  look->setSrc(from.c_str());
  const char* const processed = ocio::lib::LookTransform::GetLooksResultColorSpace(
      config.config, config.context, display_params.looks.c_str());
  const std::string between = processed != nullptr && *processed != 0 ? processed : from;
  look->setDst(between.c_str());
  look->setLooks(display_params.looks.c_str());
  transform->setSrc(between.c_str());
  transform->setLooksBypass(true);
  const auto both = ocio::lib::GroupTransform::Create();
  both->appendTransform(look);
  both->appendTransform(transform);
  return ocio::In(result, ocio::Apply(image, config, both, inverse, params.unpremult, "ociodisplay"));
}

Node OcioLook(const Node& image, const std::string& looks, const OcioLookParams& look_params,
              const OcioParams& params) {
  const ocio::Config config = ocio::LoadConfig(params);
  ocio::RequireLooks(config, looks);
  const std::string from = ocio::SpaceOf(config, look_params.from, image.spec());
  const std::string to = look_params.to.empty() ? from : ocio::RequireColorSpace(config, look_params.to);
  const auto transform = ocio::lib::LookTransform::Create();
  transform->setLooks(looks.c_str());
  // OpenColorIO's inverse goes from the destination to the source; here the image stays in `from`.
  transform->setSrc(look_params.inverse ? to.c_str() : from.c_str());
  transform->setDst(look_params.inverse ? from.c_str() : to.c_str());
  return ocio::In(ocio::OwnName(config, to),
                  ocio::Apply(image, config, transform, look_params.inverse, params.unpremult, "ociolook"));
}

Node OcioFileTransform(const Node& image, const std::string& file, const LutParams& lut_params,
                       const OcioParams& params) {
  const ocio::Config config = ocio::LoadConfig(params);
  const std::string found =
      ocio::Guarded(file, [&] { return std::string(config.context->resolveFileLocation(file.c_str())); });
  const ocio::CheckedLutFile checked(found);
  const auto transform = ocio::FileTransformOf(checked.path(), lut_params);
  return ocio::In(ocio::AfterFile(found, image.spec()),
                  ocio::Apply(image, config, transform, lut_params.inverse, params.unpremult, file,
                              ocio::Asked(lut_params)));
}

Node ApplyLut(const Node& image, const std::string& file, const LutParams& lut_params) {
  const ocio::CheckedLutFile checked(file);
  ocio::Config raw;
  raw.config = ocio::lib::Config::CreateRaw();
  raw.context = raw.config->getCurrentContext();
  raw.name = file;
  const auto transform = ocio::FileTransformOf(checked.path(), lut_params);
  return ocio::In(ocio::AfterFile(file, image.spec()), ocio::Apply(image, raw, transform, lut_params.inverse,
                                                                   false, file, ocio::Asked(lut_params)));
}

}  // namespace tessera
