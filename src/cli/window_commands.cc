// Commands on windows that have to look at the pixels first: --trim.
#include "cli/session.h"
#include "tessera/ops/arrangement.h"

namespace tessera::cli {
namespace {

void TrimImage(const Step& step, Session& session) {
  if (session.options().dry_run) return;
  Entry entry = session.Pop();
  entry.node = Trim(entry.node, session.options().render);
  session.Push(std::move(entry), WordsOf(step));
}

}  // namespace

std::vector<Command> WindowCommands() {
  std::vector<Command> rows(1);
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
