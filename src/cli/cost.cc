// The cost of an output in words and as JSON.
#include "cli/cost.h"

#include <OpenImageIO/strutil.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "cli/json_report.h"
#include "cli/messages.h"
#include "tessera/context.h"
#include "tessera/cost.h"

namespace tessera::cli {
namespace {

using OIIO::Strutil::sprintf;

double Cpu() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Written {
  double elapsed = 0, busy = 0;
};
// The first rows of an image in a file of its own.
Written WriteRows(const Image& image, int rows, const std::string& file, const WriteOptions& write) {
  ImageSpec spec = image.spec();
  spec.data_window.y1 = spec.data_window.y0 + rows;
  spec.display_window = spec.data_window;
  const double cpu = Cpu();
  const auto start = std::chrono::steady_clock::now();
  PendingOutput output(FromView(image.view().Sub(spec.data_window), spec), file, write);
  output.Commit();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  return {took.count(), Cpu() - cpu};
}

CostEstimate::Part Encoding(const CostEstimate& cost, const Node& node, const std::string& file,
                            WriteOptions write) {
  CostEstimate::Part part{"encode " + file, 0, 0, cost.parts.empty() ? 0 : cost.parts.back().pass};
  const Image& band = cost.band;
  const int rows = band.spec().height(), half = rows / 2, all = node.spec().height();
  if (rows < 1) return part;
  write.stats = nullptr;
  const base::Spool spool(Context::Default().files(), "rows",
                          std::filesystem::path(file).extension().string());
  Written most = WriteRows(band, rows, spool.file(), write);
  const Written again = WriteRows(band, rows, spool.file(), write);
  most = {(most.elapsed + again.elapsed) / 2, (most.busy + again.busy) / 2};
  const Written few = half > 0 ? WriteRows(band, half, spool.file(), write) : Written{};
  // Opening and closing do not grow with the rows.
  const auto of_all = [&](double m, double f) {
    const double slope = std::max((m - f) / std::max(1, rows - half), 0.5 * m / rows);
    return m + slope * (all - rows);
  };
  part.elapsed = of_all(most.elapsed, few.elapsed);
  part.busy = std::min(of_all(most.busy, few.busy), part.elapsed * cost.threads);
  return part;
}

CostEstimate CostOf(const Node& node, const std::string& file, const WriteOptions& write) {
  CostEstimate cost = EstimateCost(node, write.type.value_or(node.spec().type), write.render);
  cost.parts.push_back(Encoding(cost, node, file, write));
  return cost;
}

}  // namespace

void PrintCost(const Entry& entry, const std::string& file, const WriteOptions& write,
               const Options& options) {
  // What the program has taken until now is what it takes to begin.
  const double start = Cpu();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double program = static_cast<double>(usage.ru_maxrss) * 1024;

  CostEstimate cost = CostOf(entry.node, file, write);
  for (const Entry& part : entry.parts) {
    CostEstimate more = CostOf(part.node, file, write);
    const int first = cost.parts.back().pass + 1;
    for (CostEstimate::Part& p : more.parts) {
      p.pass += first;
      cost.parts.push_back(std::move(p));
    }
    cost.pixels += more.pixels, cost.bytes += more.bytes, cost.memory = std::max(cost.memory, more.memory);
  }
  for (CostEstimate::Part& p : cost.parts) ++p.pass;
  cost.parts.insert(cost.parts.begin(), {"start", start, start, 0});
  double busy = 0;
  for (const CostEstimate::Part& p : cost.parts) busy += p.busy;
  const double memory = program + static_cast<double>(cost.memory);

  if (options.json) {
    Json report = Report("cost");
    report["output"] = file;
    report["threads"] = cost.threads;
    report["parts"] = Json::array();
    for (const CostEstimate::Part& p : cost.parts) {
      report["parts"].push_back(
          {{"name", p.name}, {"elapsed", p.elapsed}, {"busy", p.busy}, {"pass", p.pass}});
    }
    report["seconds"] = cost.Seconds();
    report["busy"] = busy;
    report["limit"] = cost.Limit();
    report["pixels"] = cost.pixels;
    report["bytes"] = cost.bytes;
    report["memory"] = static_cast<int64_t>(memory);
    PrintJson(report);
    return;
  }
  std::cout << "cost " << Printable(file) << ", expected of " << cost.threads
            << (cost.threads == 1 ? " thread:\n" : " threads:\n");
  for (const CostEstimate::Part& p : cost.parts) {
    if (p.elapsed < 5e-5) continue;
    std::cout << sprintf("  %-28s %9.4f s %9.4f s of threads\n", Printable(p.name), p.elapsed, p.busy);
  }
  std::cout << sprintf("  total %.4f s, %.4f s of threads, memory %.0f MB, limit: %s\n", cost.Seconds(), busy,
                       memory / (1 << 20), Printable(cost.Limit()));
}

}  // namespace tessera::cli
