// --contactsheet: small pictures with their names below, side by side.
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "cli/metadata.h"
#include "cli/session.h"
#include "tessera/draw.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arrangement.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

constexpr int kLongestField = 1 << 14;

struct Field {
  int width = 0, height = 0, label = 0;  // of the picture; rows below it
};

Field FieldOf(const Step& step) {
  const std::string& text = step.arguments.Text("fit");
  Field field;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &field.width, &field.height, &rest) != 2 || field.width < 1 ||
      field.height < 1 || field.width > kLongestField || field.height > kLongestField) {
    throw UsageError(step.written, "found fit=" + text + ", expected WxH, sides from 1 to " +
                                       std::to_string(kLongestField) + ", such as 240x160");
  }
  // Letters reach below their line.
  if (step.arguments.Text("label") != "none") field.label = step.arguments.Integer("size") * 3 / 2;
  return field;
}

std::string LabelOf(const Step& step, const Entry& entry) {
  const std::string& what = step.arguments.Text("label");
  if (what == "caption") return ItemText(entry, "ImageDescription");
  return what == "name" ? std::filesystem::path(entry.name).filename().string() : "";
}

// Fitted into its field, in memory where something is written below it.
Node Labelled(const Step& step, const Session& session, const Entry& entry, const Field& field) {
  FitParams fit;
  fit.width = field.width, fit.height = field.height, fit.pad = true;
  Node node = Fit(entry.node, fit);
  if (field.label == 0) return node;
  node = CropToDisplay(WithDisplayWindow(node, {0, 0, field.width, field.height + field.label}));
  const std::string label = LabelOf(step, entry);
  if (label.empty() || session.options().dry_run) return node;
  Image image = Render(node, PixelType::kFloat, session.options().render);
  TextStyle style;
  style.size = step.arguments.Integer("size");
  style.x = field.width / 2, style.y = field.height + field.label / 2;
  style.x_align = "center", style.y_align = "center";
  style.color.assign(static_cast<size_t>(image.spec().channel_count()), 1.0F);
  DrawText(image, label, style);
  return FromImage(image);
}

void MakeSheet(const Step& step, Session& session) {
  const Field field = FieldOf(step);
  std::vector<Entry> entries;
  while (session.Depth() > 0) {
    entries.push_back(session.Pop());
    LeaveParts(entries.back(), WordsOf(step), session.options());
  }
  std::reverse(entries.begin(), entries.end());
  std::vector<Node> nodes;
  for (const Entry& entry : entries) {
    RequireSize(entry);
    nodes.push_back(Labelled(step, session, entry, field));
  }
  MosaicParams params;
  params.columns = std::min(step.arguments.Integer("COLUMNS"), static_cast<int>(nodes.size()));
  params.pad = step.arguments.Integer("pad");
  Entry result = std::move(entries[0]);
  result.suggested = result.SuggestedType();
  result.node = Mosaic(nodes, params);
  session.Push(std::move(result), WordsOf(step));
}

}  // namespace

std::vector<Command> SheetCommands() {
  std::vector<Command> rows;
  rows.push_back(RowOf("Images", Effect::kJoin, "contactsheet", 1,
                       "Makes one picture of all images on the stack, small, side by side, with their names.",
                       {{.name = "COLUMNS",
                         .type = ParamType::kInteger,
                         .default_value = "",
                         .help = "images side by side",
                         .min = 1,
                         .max = 1000}},
                       {{.name = "fit",
                         .type = ParamType::kText,
                         .default_value = "240x160",
                         .help = "WxH: the field that each is fitted into"},
                        {.name = "pad",
                         .type = ParamType::kInteger,
                         .default_value = "8",
                         .help = "pixels between fields",
                         .min = 0,
                         .max = 4096},
                        {.name = "label",
                         .type = ParamType::kChoice,
                         .default_value = "name",
                         .help = "what is written below: the file's name, its caption, nothing",
                         .choices = {"name", "caption", "none"}},
                        {.name = "size",
                         .type = ParamType::kInteger,
                         .default_value = "14",
                         .help = "height of letters, pixels",
                         .min = 4,
                         .max = 512}}));
  rows.back().run = MakeSheet;
  rows.back().info.help =
      "The lowest image of the stack is the first, rows are filled from the left. Every image is fitted as --fit:pad=1 does, and lies "
      "in its field's middle; around it and behind the letters is black, and zero alpha. Letters are OpenImageIO's, 1 in every channel, "
      "in the middle below. Images of a gray channel beside those of colour have it as the first; --ch makes them alike. Metadata are "
      "the first one's. --mosaic has fields without names, and the shape of oiiotool's.";
  rows.back().lines = {"a.exr b.exr c.exr --contactsheet 2 -o out.exr"};
  return rows;
}

}  // namespace tessera::cli
