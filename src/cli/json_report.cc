// Makes the objects of reports for programs.
#include "cli/json_report.h"

#include <sys/resource.h>

#include <cstring>
#include <iostream>
#include <sstream>

#include "cli/metadata.h"
#include "tessera/metadata.h"

namespace tessera::cli {
namespace {

Json WindowOf(const Roi& r) {
  return {{"x", r.x0}, {"y", r.y0}, {"width", r.width()}, {"height", r.height()}};
}

template <typename T>
Json Values(const Attribute& item) {
  Json list = Json::array();
  for (size_t at = 0; at + sizeof(T) <= item.bytes.size(); at += sizeof(T)) {
    T value{};
    std::memcpy(&value, &item.bytes[at], sizeof value);
    list.push_back(value);
  }
  return list.size() == 1 ? list[0] : list;
}

// Ints, floats and strings as what they are, others in OpenImageIO's words.
Json ValueOf(const Attribute& item) {
  const std::string element = item.type.substr(0, item.type.find('['));
  if (element == "int") return Values<int>(item);
  if (element == "float") return Values<float>(item);
  if (element == "string" && item.strings.size() != 1) return item.strings;
  return AttributeText(item);
}

}  // namespace

void PrintJson(const Json& report) {
  std::cout << report.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
}

Json Report(const std::string& kind) { return {{"report", kind}}; }

Json Describe(const Entry& entry) {
  const ImageSpec& spec = entry.node.spec();
  Json metadata = Json::array();
  for (const Attribute& item : MetadataOf(entry))
    metadata.push_back({{"name", item.name}, {"type", item.type}, {"value", ValueOf(item)}});
  return {{"width", spec.width()},
          {"height", spec.height()},
          {"type", PixelTypeName(entry.SuggestedType())},
          {"channels", spec.channels},
          {"alpha", spec.alpha},
          {"data_window", WindowOf(spec.data_window)},
          {"display_window", WindowOf(spec.display_window)},
          {"metadata", metadata}};
}

Json RunStatsReport(const std::string& output, const RunStats& stats) {
  Json report = Report("runstats");
  report["output"] = output;
  double total = 0;
  report["passes"] = Json::array();
  for (const RunStats::Pass& pass : stats.passes) {
    total += pass.seconds;
    report["passes"].push_back(
        {{"name", pass.name}, {"seconds", pass.seconds}, {"pixels", pass.pixels}, {"bytes", pass.bytes}});
  }
  report["rules"] = stats.rules;
  report["files"] = stats.files;
  const RunPhases& p = stats.phases;
  Json decode = Json::array();
  for (const RunPhases::Decode& d : p.decode)
    decode.push_back({{"file", d.file}, {"busy", d.busy}, {"elapsed", d.elapsed}});
  report["phases"] = {{"threads", p.threads}, {"seconds", p.seconds},
                      {"prepare", p.prepare}, {"decode", std::move(decode)},
                      {"compute", p.compute}, {"encode", p.encode},
                      {"wait", p.wait},       {"encode_elapsed", p.encode_elapsed},
                      {"limit", p.Limit()}};
  report["seconds"] = total;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  report["peak_memory"] = int64_t{usage.ru_maxrss} * 1024;
  return report;
}

Json VerifyReportOf(const std::string& output, int image, const VerifyReport& v) {
  Json report = Report("verify");
  report["output"] = output;
  report["image"] = image;
  report["within_bound"] = v.within_bound;
  report["max_error"] = v.max_error;
  report["rms_error"] = v.rms_error;
  report["bound"] = v.bound;
  report["largest_bound"] = v.largest_bound;
  report["closest"] = v.closest;
  report["samples"] = v.samples;
  report["share"] = v.share;
  report["undecided"] = v.undecided;
  report["nan_mismatches"] = v.nan_mismatches;
  report["codes_at_tie"] = v.codes_at_tie;
  report["codes_wrong"] = v.codes_wrong;
  report["out_of_bound"] = v.out_of_bound;
  report["worst"] = {{"x", v.worst_x}, {"y", v.worst_y}, {"channel", v.worst_channel}};
  report["remarks"] = v.remarks;
  return report;
}

Json Lines(const std::string& text) {
  Json list = Json::array();
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) list.push_back(line);
  return list;
}

}  // namespace tessera::cli
