// Commands on windows that have to look at the pixels first: --trim, --pixelaspect.
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <array>

#include "cli/metadata.h"
#include "ops/apply.h"
#include "tessera/error_kind.h"
#include "tessera/metadata.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/geometry.h"

namespace tessera::cli {
namespace {

Modifiers FilterOf(const Step& step) {
  if (!step.arguments.Given("filter")) return {};
  return {{"filter", step.arguments.Text("filter")}};
}

void TrimImage(const Step& step, Session& session) {
  if (session.options().dry_run) return;
  Entry entry = session.Pop();
  entry.node = Trim(entry.node, session.options().render);
  session.Push(std::move(entry), WordsOf(step));
}

// The side that is too short grows until pixels have the shape that is asked for.
void SetPixelAspect(const Step& step, Session& session) {
  constexpr char kAspect[] = "PixelAspectRatio";
  const auto number = [](const Entry& entry, const char* name) {
    return OIIO::Strutil::stof(ItemText(entry, name));
  };
  Entry entry = session.Pop();
  LeaveParts(entry, WordsOf(step), session.options());
  const auto wanted = static_cast<float>(step.arguments.Number("ASPECT"));
  const float found = ItemText(entry, kAspect).empty() ? 1.0F : number(entry, kAspect);
  if (!(found > 0))
    throw DataError(entry.name,
                    "found a PixelAspectRatio of " + std::to_string(found) + ", expected one above 0");
  const float factor = found / wanted, scale_x = std::max(factor, 1.0F), scale_y = std::max(1 / factor, 1.0F);
  const Roi& frame = entry.node.spec().display_window;
  ResizeParams size;
  size.width = static_cast<int>(static_cast<float>(frame.width()) * scale_x + 0.5F);
  size.height = static_cast<int>(static_cast<float>(frame.height()) * scale_y + 0.5F);
  if (size.width != frame.width() || size.height != frame.height()) {
    const ops::OpInfo& op = *ops::FindOp("resize");
    ops::Arguments a = ops::ParseArguments(
        op, std::array{std::to_string(size.width) + "x" + std::to_string(size.height)}, FilterOf(step));
    entry.node = ops::Apply(op, std::array{entry.node}, a, nullptr);
    SetItem(entry, ParseAttribute(kAspect, std::to_string(wanted), "float"));
    for (const auto& [name, scale] : {std::pair{"XResolution", scale_x}, std::pair{"YResolution", scale_y}}) {
      if (const float before = number(entry, name); before != 0)
        SetItem(entry, ParseAttribute(name, std::to_string(before * scale), "float"));
    }
  }
  session.Push(std::move(entry), WordsOf(step));
}

}  // namespace

std::vector<Command> WindowCommands() {
  std::vector<Command> rows(2);
  Command& aspect = rows[1];
  aspect.info.name = "pixelaspect";
  aspect.info.inputs = 1;
  aspect.info.summary = "Makes the width or the height larger, so that pixels have the given shape.";
  aspect.info.arguments = {{.name = "ASPECT",
                            .default_value = "",
                            .help = "width of a pixel over its height",
                            .min = 1e-3,
                            .max = 1e3}};
  aspect.info.modifiers = {
      {.name = "filter", .type = ops::ParamType::kText, .default_value = "", .help = "as --resize has it"}};
  aspect.info.help =
      "From the image's PixelAspectRatio, 1 where it has none; XResolution and YResolution go along. As oiiotool "
      "--pixelaspect.";
  aspect.group = "Images";
  aspect.effect = Effect::kApply;
  aspect.run = SetPixelAspect;
  aspect.lines = {"in.exr --pixelaspect 2 -o out.exr"};
  Command& trim = rows[0];
  trim.info.name = "trim";
  trim.info.inputs = 1;
  trim.info.summary = "Crops the top image to the pixels that are not zero.";
  trim.info.help =
      "The data window becomes the smallest one that holds every pixel with a sample other than zero, in any channel; "
      "its first pixel where all are zero. The display window stays. The image is computed once to find it, and again "
      "for what is made of it. As oiiotool --trim, of one image.";
  trim.group = "Images";
  trim.effect = Effect::kApply;
  trim.run = TrimImage;
  return rows;
}

}  // namespace tessera::cli
