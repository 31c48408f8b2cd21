// Phases in words.
#include "graph/phases.h"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace tessera::graph {

std::vector<std::string> Phases::Lines(const std::string& output) const {
  std::vector<std::string> lines;
  const double all = threads * seconds;
  if (!(all > 0)) return lines;
  char text[96];
  std::snprintf(text, sizeof text, "%d %s for %.4f s:", threads, threads == 1 ? "thread" : "threads",
                seconds);
  lines.emplace_back(text);
  std::pair<double, std::string> limit(prepare, "prepare");
  const auto add = [&](const std::string& phase, double busy, double elapsed, const std::string& file) {
    std::snprintf(text, sizeof text, "  %-8s %9.4f s %5.1f %%", phase.c_str(), busy, 100 * busy / all);
    lines.push_back(text + (file.empty() ? "" : "  " + file));
    limit = std::max(limit, std::pair(elapsed, file.empty() ? phase : phase + " " + file));
  };
  add("prepare", prepare, prepare, "");
  for (const Decode& d : decode) add("decode", d.busy, d.elapsed, d.file);
  add("compute", compute, compute / threads, "");
  add("encode", encode, encode_elapsed, output);
  add("wait", wait, 0, "");
  lines.push_back("  limit: " + limit.second);
  return lines;
}

}  // namespace tessera::graph
