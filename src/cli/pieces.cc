// Pieces of a picture. A file of tiles cannot be written by several processes: OpenEXR and libtiff keep the
// table of tiles in memory and write it at the end. So every piece is a file with a data window of its own.
#include "cli/pieces.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <charconv>
#include <climits>
#include <cstdint>
#include <set>

#include "base/geometry_text.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"

namespace tessera::cli {
namespace {

void RequireAlike(const Entry& first, const Entry& piece) {
  const ImageSpec &a = first.node.spec(), &b = piece.node.spec();
  if (a.channels != b.channels)
    throw DataError(piece.name,
                    "found other channels than in " + first.name + ", expected pieces of one picture");
  if (first.SuggestedType() != piece.SuggestedType())
    throw DataError(piece.name, std::string("found the type ") + PixelTypeName(piece.SuggestedType()) +
                                    ", expected " + PixelTypeName(first.SuggestedType()) + " as in " +
                                    first.name);
}

// Halves of halves, so that a pixel goes through few of them.
Node Laid(std::vector<Node> pieces) {
  PasteParams params;
  params.merge_windows = true;
  while (pieces.size() > 1) {
    std::vector<Node> pairs;
    for (size_t k = 0; k + 1 < pieces.size(); k += 2)
      pairs.push_back(Paste(pieces[k + 1], pieces[k], params));
    if (pieces.size() % 2 == 1) pairs.push_back(pieces.back());
    pieces = std::move(pairs);
  }
  return pieces[0];
}

void Join(const Step& step, Session& session) {
  std::vector<Entry> pieces;
  while (session.Depth() > 0) {
    pieces.push_back(session.Pop());
    LeaveParts(pieces.back(), WordsOf(step), session.options());
  }
  std::reverse(pieces.begin(), pieces.end());
  std::vector<Node> nodes;
  std::vector<Roi> windows;
  Roi all;
  for (const Entry& piece : pieces) {
    RequireAlike(pieces[0], piece);
    nodes.push_back(piece.node);
    windows.push_back(piece.node.spec().data_window);
    all = Union(all, windows.back());
  }
  Roi gap;
  if (!step.arguments.Flag("gaps") && !Covers(windows, all, gap)) {
    throw DataError(step.written, "found no piece that holds " + base::GeometryText(gap) +
                                      ", expected pieces that fill " + base::GeometryText(all) +
                                      "; gaps=1 leaves black there");
  }
  Entry result = std::move(pieces[0]);
  result.node = Laid(std::move(nodes));
  session.Push(std::move(result), WordsOf(step));
}

}  // namespace

Roi ParseRegion(const std::string& text) {
  int64_t values[4] = {};
  const char* at = text.data();
  const char* const end = at + text.size();
  bool right = true;
  for (int i = 0; i < 4 && right; ++i) {
    const auto [next, error] = std::from_chars(at, end, values[i]);
    right = error == std::errc() && (i == 3 ? next == end : next != end && *next == ',');
    at = next + 1;
  }
  const auto [x, y, w, h] = values;
  const auto fits = [](int64_t start, int64_t side) {
    return start >= INT_MIN && start <= INT_MAX && side >= 1 && side <= INT_MAX && start + side <= INT_MAX;
  };
  if (!right || !fits(x, w) || !fits(y, h)) {
    throw UsageError(
        "--region",
        "found \"" + text + "\", expected X,Y,W,H: the corner and the sides, at least 1, in whole pixels");
  }
  return {static_cast<int>(x), static_cast<int>(y), static_cast<int>(x + w), static_cast<int>(y + h)};
}

void KeepRegion(Entry& entry, const std::string& file, const Options& options) {
  if (!options.region) return;
  const Roi& window = entry.node.spec().data_window;
  const Roi part = Intersection(window, *options.region);
  if (part.empty()) {
    throw DataError(file, "found no pixel in --region " + base::GeometryText(*options.region) +
                              ", expected one that meets " + base::GeometryText(window));
  }
  const auto format = OIIO::ImageOutput::create(file);
  if (format == nullptr) {
    OIIO::geterror();  // said where the file is made
  } else if (!format->supports("displaywindow") ||
             (!format->supports("negativeorigin") && (part.x0 < 0 || part.y0 < 0))) {
    throw DataError(file, std::string("found the format ") + format->format_name() +
                              ", which does not say where in the picture a piece is, expected one that does, "
                              "such as exr");
  }
  entry.node = Crop(entry.node, part);
}

bool Covers(const std::vector<Roi>& windows, const Roi& all, Roi& gap) {
  std::set<int> edges = {all.y0, all.y1};
  for (const Roi& w : windows) edges.insert(w.y0), edges.insert(w.y1);
  std::vector<Roi> sorted = windows;
  std::sort(sorted.begin(), sorted.end(), [](const Roi& a, const Roi& b) { return a.x0 < b.x0; });
  // Between two edges the same windows are met in every row.
  for (auto y = edges.begin(); std::next(y) != edges.end(); ++y) {
    const int y0 = *y, y1 = *std::next(y);
    int x = all.x0;
    for (const Roi& w : sorted) {
      if (w.empty() || w.y0 > y0 || w.y1 < y1 || w.x1 <= x) continue;
      if (w.x0 > x) {
        gap = {x, y0, w.x0, y1};
        return false;
      }
      x = w.x1;
    }
    if (x < all.x1) {
      gap = {x, y0, all.x1, y1};
      return false;
    }
  }
  return true;
}

std::vector<Command> PieceCommands() {
  std::vector<Command> rows;
  rows.push_back(RowOf("Pieces of a picture", Effect::kOption, "region", 0,
                       "Outputs hold a part of the picture alone, which is all that is computed.",
                       {{.name = "X,Y,W,H",
                         .type = ops::ParamType::kText,
                         .default_value = "",
                         .help = "the part's corner and sides, in pixels of the display window"}}));
  rows.back().set = [](const ops::Arguments& a, Options& o) { o.region = ParseRegion(a.Text("X,Y,W,H")); };
  rows.back().info.help =
      "The data window of every output becomes what it has in the region, the display window stays: pieces that several processes make "
      "of one line have the pixels of the whole picture, bit for bit, whatever windows, borders and statistics the line has, and "
      "--join puts them together without a seam. A file of tiles cannot be written by several processes (OpenEXR and libtiff "
      "write the table of tiles at the end), so each piece is a file of its own, of a format that says where in the "
      "picture it is, such as EXR; others are refused. What does not meet the region is an error.";
  rows.back().lines = {"--region 0,0,64,32 in.exr --blur 9x9 -o upper.exr"};
  rows.push_back(RowOf("Pieces of a picture", Effect::kJoin, "join", 1,
                       "Makes one picture of all images on the stack, each where its data window is.", {},
                       {{.name = "gaps",
                         .type = ops::ParamType::kFlag,
                         .default_value = "0",
                         .help = "1: what no piece holds is black"}}));
  rows.back().run = Join;
  rows.back().info.help =
      "Pieces have the same channels and type, in any order; where they overlap, a later one counts. Windows hold those of all, metadata are "
      "the first one's. Pixels that are in no piece are an error. Bits stay, and pieces are read in bands: the picture may be larger than memory.";
  rows.back().lines = {"in.exr --crop 64x32+0+0 in.exr --crop 64x32+0+32 --join -o out.exr"};
  return rows;
}

}  // namespace tessera::cli
