// What holds for the whole line, wherever it was written.
#ifndef TESSERA_CLI_OPTIONS_H_
#define TESSERA_CLI_OPTIONS_H_

#include <optional>
#include <string>

#include "cli/limits.h"
#include "tessera/io.h"
#include "tessera/render.h"
#include "tessera/roi.h"

namespace tessera::cli {

// What --stream says of its frames.
struct StreamOptions {
  bool on = false;
  std::string input = "y4m", output = "same", size, matrix = "auto", range = "auto", siting = "auto";
  std::string alpha = "straight", rate;
};

struct Options {
  RenderOptions render;
  Codec codec = Codec::kAuto;
  Formats formats = Formats::kTrusted;
  StreamOptions stream;
  bool batch = false;
  int batch_jobs = 1;  // at once; 0: one a core
  bool help = false, version = false, list_commands = false;
  std::string help_topic;   // empty: the overview
  std::string help_search;  // words; --help-search was asked for where `search` is set
  bool search = false, manual = false;
  std::string completion;  // for which shell; empty: not asked for
  std::string list_format = "tsv";
  bool verbose = false, quiet = false, dry_run = false, runstats = false, explain = false;
  bool cost = false;  // with explain: what it takes in place of what it is
  bool verify = false;
  int verify_samples = 16;
  std::optional<bool> progress;  // unset: when stderr is a terminal
  std::string simd;              // empty: the best target; "list" prints them
  std::string frames;            // empty: from the file names
  bool wildcards = true;         // of the names that follow
  bool evaluate = true;          // expressions in the words that follow
  bool skip_bad_frames = false;
  std::string part;                    // of the frames: K/N, auto, auto/N; empty: all
  std::optional<int> parallel_frames;  // at once; 0: as many as help
  bool resume = false;
  std::optional<Roi> region;  // of every output
  int frame_padding = 0;      // 0: as the pattern says
  bool sync = true;
  bool autoorient = false;  // every file that is read
  bool pages = false;       // what is larger than a budget that was asked for may lie on disk
  bool all_parts = false;   // -a
  bool metadata_merge = false, update = false, auto_trim = false, auto_crop = true, sans_attributes = false;
  bool no_clobber = false, adjust_time = false;
  // What is told of every file that is read.
  bool info = false, info_xml = false, info_hash = false, dump = false, dump_empty = true;
  std::string info_match, info_no_match, dump_name;
  bool TellsInputs() const { return info || info_hash || dump; }
  bool list_formats = false;
  // Something is printed and nothing done.
  bool Informs() const {
    return help || search || manual || !completion.empty() || version || list_commands || list_formats ||
           simd == "list";
  }
  bool json = false;  // reports are for programs
  bool safe = false;
  bool sandbox = true;
  Limits limits;
  bool software_attribute = true;

  bool ShowsProgress() const;
};

}  // namespace tessera::cli

#endif  // TESSERA_CLI_OPTIONS_H_
