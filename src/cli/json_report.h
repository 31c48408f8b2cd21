// Reports for programs (--json): one JSON object a line on standard output. doc/reports.md has their keys.
#ifndef TESSERA_CLI_JSON_REPORT_H_
#define TESSERA_CLI_JSON_REPORT_H_

#include <nlohmann/json.hpp>
#include <string>

#include "cli/session.h"
#include "tessera/verify.h"

namespace tessera::cli {

using Json = nlohmann::ordered_json;

// On a line of its own. Bytes that are no UTF-8 are replaced, numbers that are not finite are null.
void PrintJson(const Json& report);

// "report" and what it is about.
Json Report(const std::string& kind);
// Size, windows, channels, type and metadata.
Json Describe(const Entry& entry);
Json RunStatsReport(const std::string& output, const RunStats& stats);
Json VerifyReportOf(const std::string& output, int image, const VerifyReport& report);
// A text of lines as an array.
Json Lines(const std::string& text);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_JSON_REPORT_H_
