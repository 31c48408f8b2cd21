// The commands that hold for the whole line: threads, memory, targets, what to print, frames.
#include "cli/options.h"

#include <unistd.h>

#include <charconv>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/frame_part.h"
#include "cli/frame_run.h"
#include "cli/messages.h"

namespace tessera::cli {
namespace {

using ops::Arguments;
using ops::ParamInfo;
using ops::ParamType;

Command Option(const std::string& name, const std::string& summary, void (*set)(const Arguments&, Options&),
               std::vector<ParamInfo> arguments = {}, std::vector<ParamInfo> modifiers = {}) {
  Command c = RowOf("General", Effect::kOption, name, 0, summary, std::move(arguments), std::move(modifiers));
  c.set = set;
  return c;
}

ParamInfo Whole(const std::string& name, double min, double max, const std::string& help,
                const std::string& default_value = "") {
  return {.name = name,
          .type = ParamType::kInteger,
          .default_value = default_value,
          .help = help,
          .min = min,
          .max = max};
}

ParamInfo Text(const std::string& name, const std::string& help) {
  return {.name = name, .type = ParamType::kText, .default_value = "", .help = help};
}

std::vector<std::string> RuleNames() {
  std::vector<std::string> names = {"all"};
  for (const RuleInfo& rule : RewriteRules()) names.push_back(rule.name);
  return names;
}

// Help, for people and for shells.
void AddHelp(std::vector<Command>& rows) {
  rows.push_back(Option("help", "Prints the overview, or all about one command.",
                        [](const Arguments& a, Options& o) {
                          o.help = true;
                          if (const auto topic = a.values.find("COMMAND"); topic != a.values.end())
                            o.help_topic = topic->second.text;
                        },
                        {Text("COMMAND", "the name of a command or of a pattern")}));
  rows.back().optional_argument = true;
  rows.back().aliases = {"h"};
  rows.push_back(Option("help-search", "Finds the commands that are about something.",
                        [](const Arguments& a, Options& o) {
                          o.search = true;
                          o.help_search = a.Text("WORDS");
                        },
                        {Text("WORDS", "words, such as sharpen or \"soft shadow\"; all must hold")}));
  rows.back().any_text = true;
  rows.back().info.help =
      "Names, aliases, what other programs call them (worley, grade, exposure), summaries, parameters and help are "
      "looked through, endings left aside; the likeliest come first.";
  rows.back().lines = {"--help-search worley", "--help-search 'soft shadow'"};
  rows.push_back(Option("man", "Prints the manual page, for man(1).",
                        [](const Arguments&, Options& o) { o.manual = true; }));
  rows.back().info.help = "tessera --man | man -l - shows it; an installation brings it as tessera.1.";
  rows.back().lines = {"--man"};
  rows.push_back(Option("completion", "Prints what a shell completes lines by.",
                        [](const Arguments& a, Options& o) { o.completion = a.Text("SHELL"); },
                        {{.name = "SHELL",
                          .type = ParamType::kChoice,
                          .default_value = "",
                          .help = "the shell",
                          .choices = {"bash", "zsh", "fish"}}}));
  rows.back().info.help =
      "Commands, modifiers, what these may be, and files. An installation brings the three; without one: in bash, source "
      "<(tessera --completion bash); in zsh, put it as _tessera in a folder of $fpath; in fish, tessera --completion fish "
      "| source.";
  rows.back().lines = {"--completion bash"};
  rows.push_back(Option("version", "Prints the version and the compiled targets that this machine runs.",
                        [](const Arguments&, Options& o) { o.version = true; }));
}

// What a line is and tells.
void AddLine(std::vector<Command>& rows) {
  rows.push_back(Option("v", "Says on stderr what is read and written.",
                        [](const Arguments&, Options& o) { o.verbose = true; }));
  rows.back().aliases = {"verbose"};
  rows.push_back(Option("q", "No progress and no reports of --diff; exit codes stay.",
                        [](const Arguments&, Options& o) { o.quiet = true; }));
  rows.back().aliases = {"quiet"};
  rows.push_back(Option("autoorient", "Turns every file that is read as its Orientation says: --reorient.",
                        [](const Arguments&, Options& o) { o.autoorient = true; }));
  rows.back().aliases = {"auto-orient"};
  rows.push_back(Option("n", "Dry run: checks the line and opens the inputs; computes and writes nothing.",
                        [](const Arguments&, Options& o) { o.dry_run = true; }));
  rows.push_back(Option("batch", "Runs the lines of standard input, one process for all; answers in JSON.",
                        [](const Arguments& a, Options& o) {
                          o.batch = true;
                          o.batch_jobs = a.Integer("jobs");
                        },
                        {}, {Whole("jobs", 0, 256, "jobs that run at once; 0 is one a core", "1")}));
  rows.back().info.help =
      "Every line of standard input is a job: what would follow `tessera` on a line of its own. Words are parted "
      "by blanks; '...' is taken as it is, in \"...\" a backslash protects $ ` \" and itself, elsewhere whatever "
      "follows it; nothing is expanded. Or a JSON array of words, or {\"id\": ANYTHING, \"words\": [...]}. Empty "
      "lines and those that begin with # are no jobs. A line has at most 2^20 bytes. Options beside --batch stand "
      "before the words of every job. Jobs run one after the other, unless jobs=N has several run at once, share what the program keeps (memory, tables, "
      "threads) and nothing else: files are those that a process per job writes.\n"
      "Every job is answered, as soon as it is done, by one line of JSON on standard output: job (the number of "
      "the line, from 1), id where one was given, ok, exit_code (as of a process of its own), error with kind "
      "(usage, data, system, cancelled, internal; result for a --diff that says no or frames that were "
      "skipped) and message, outputs (names of the files written), seconds and cpu_seconds, output and messages "
      "(what it printed on standard output and standard error). A job that fails ends nothing but itself; a crash "
      "of a library ends the process: jobs without an answer are to be asked again. The end of "
      "input is the end, exit code 0, whatever the jobs came to. SIGTERM or SIGINT ends the job under way, which "
      "is answered as cancelled, and the process with 128 + N; a second one does not wait. Libraries for films, "
      "OpenVDB and meshes are loaded at the start.\n"
      "With jobs=N up to N jobs run at once, each in a process of its own that is kept for the next; answers come in "
      "the order of the lines all the same. Each has all threads that --threads gives to one (--threads 1 "
      "is best for small ones); limits are each job's own, and N times the memory of one may be in use. A crash of a library is "
      "the answer of its job then (kind internal), and another process takes its place. A job that reads what another "
      "one writes is to be sent when that is answered.";
  rows.push_back(Option("a", "Commands work on every image of a file of several.",
                        [](const Arguments&, Options& o) { o.all_parts = true; }));
  rows.back().info.help =
      "Parts of an EXR, pages of a TIFF, frames of a GIF: operations, --attrib and its kin and reports take the "
      "first of them without it, and say that the others are left. Of two operands the one with fewer gives its "
      "last to the rest. As oiiotool -a, which holds from where it stands.";
  rows.back().lines = {"-a in.exr --flip -o out.exr"};
}

// How a line is evaluated, and checked.
void AddEvaluation(std::vector<Command>& rows) {
  rows.push_back(Option("threads",
                        "Number of threads; 0, the default, is every core. Results do not depend on it.",
                        [](const Arguments& a, Options& o) { o.render.threads = a.Integer("N"); },
                        {Whole("N", 0, 4096, "threads")}));
  rows.push_back(Option(
      "runstats",
      "Prints per output: time per pass, Mpixel/s, GB/s, the seconds of all threads that decoding, computing, encoding and waiting took, and the peak memory.",
      [](const Arguments&, Options& o) { o.runstats = true; }));
  rows.push_back(Option("verify",
                        "Compares what was stored with the double-precision reference of this line.",
                        [](const Arguments& a, Options& o) {
                          o.verify = true;
                          o.verify_samples = a.Integer("samples");
                        },
                        {}, {Whole("samples", 1, 65536, "tiles of 64x64 pixels that are compared", "16")}));
  rows.back().info.help =
      "Reads every output back, before it gets its name, and compares sampled tiles with the reference, "
      "rounded to the file's type. Prints one line per output with the maximum and the root-mean-square error, "
      "the bound, which follows from the operations' own bounds and from how their results respond to errors of "
      "their inputs, and how much was looked at: the reference takes ten times the run or two seconds, whichever "
      "is longer. A code that rounds the other way where the bound reaches the tie is right; a value that hangs "
      "on a decision (a test, a hit or a miss) within its own error is undecided, neither right nor wrong. An "
      "output that is not within its bound is not written: exit code 1. Formats that do not keep what they are "
      "given are looked at as it was handed over. What OpenColorIO computes itself is compared with its own "
      "unoptimised float evaluation, by how far that moves when its input does, and the line says so.";
  rows.push_back(
      Option("explain", "Prints the plan: passes, fused stages, tile shape, bytes moved; runs nothing.",
             [](const Arguments& a, Options& o) { o.explain = true, o.cost = a.Integer("cost") != 0; }, {},
             {Whole("cost", 0, 1, "what it takes in place of what it is", "0")}));
  rows.back().info.help =
      "cost=1 tries every output in place of telling the plan: the first rows of its files are read, some rows of "
      "it are computed, and operations on whole images on the middle of theirs, rows are written to a temporary file "
      "of that kind, and the rest is taken to cost as much. It prints the seconds that decoding, computing and "
      "encoding take of the clock and of threads, which is the limit, and the memory. A second or so per output.";
  rows.push_back(Option("max-memory",
                        "Memory that a line may take, in MB; what is held whole and is larger is paged.",
                        [](const Arguments& a, Options& o) {
                          o.render.memory_budget = static_cast<size_t>(a.Number("MB")) << 20;
                          o.pages = true;
                        },
                        {Whole("MB", 1, 1 << 24, "mebibytes")}));
  rows.back().info.help =
      "Bands of rows, tiles and what is kept between outputs stay within it. Where whole images would not, "
      "commands whose method is auto are computed by one that takes bands, within the same bound. What is held "
      "whole by any method (a picture that a warp reads, a table, a volume; help says so) and takes more than half "
      "of it lies in a nameless temporary file in $TMPDIR, else /var/tmp, and is paged: results are the same bits, "
      "about half of the budget is resident, and what the system keeps of the file beyond that goes when "
      "others need memory. Tables of distances, spectra and bounds of a volume's blocks come on top, and so does the "
      "program itself, with the libraries that read and write files (some 50 MB). With --safe, and for what "
      "--limit alone refuses, nothing is paged. Without it whole images are held as they are needed, and half a "
      "gibibyte is for the rest.";
  rows.push_back(Option("simd", "Forces a compiled target; `list` prints those that this machine runs.",
                        [](const Arguments& a, Options& o) { o.simd = a.Text("TARGET"); },
                        {Text("TARGET", "a target's name, auto or list")}));
}

// What files may be, and ask for.
void AddGuards(std::vector<Command>& rows) {
  rows.push_back(Option("formats",
                        "Formats that are read; `all` adds those whose readers damaged files can harm.",
                        [](const Arguments& a, Options& o) {
                          o.formats = a.Text("WHICH") == "all" ? Formats::kAll : Formats::kTrusted;
                        },
                        {{.name = "WHICH",
                          .type = ParamType::kChoice,
                          .default_value = "",
                          .help = "trusted, or all",
                          .choices = {"trusted", "all"}}}));
  rows.back().info.help =
      "Trusted are OpenEXR, PNG, JPEG, TIFF, DPX, Cineon, Radiance, GIF, BMP, WebP, JPEG2000, HEIF, SGI, PNM, "
      "Targa, RLA, NumPy's arrays and OpenVDB, told by what a file begins with. Others (IFF, PSD, FITS, raw photographs, films) "
      "are OpenImageIO's all the same; `all` has them read too, each by a process that may do nothing else "
      "(--no-sandbox).";
  rows.push_back(Option("limit", "Refuses what is larger, more, or takes longer: pixels=1e8,seconds=60.",
                        [](const Arguments& a, Options& o) { AddLimits(a.Text("LIMITS"), o.limits); },
                        {Text("LIMITS", "a list of KEY=NUMBER")}));
  rows.back().info.help =
      "pixels: of every image of the line, read or made (voxels of a volume). channels: of the same. frames: that "
      "a line is run for, or that --motionblur reads. memory: MiB that the process may take, libraries and "
      "threads included; --max-memory is at most a quarter of it. seconds: of the whole run; evaluations end where "
      "they are, and libraries that do not ask have two more. What is over a limit is refused with the limit, the "
      "file or command and what was found: exit code 1, nothing is written, the outputs that were there stay. "
      "Of limits that are given twice the smaller holds, so that a job of --batch cannot have more than its "
      "program's line gives to each; a library that has to be ended ends the program with all its jobs.";
  rows.push_back(Option("safe", "For servers: limits, no environment, no links, listed formats alone.",
                        [](const Arguments&, Options& o) { o.safe = true; }));
  rows.back().info.help =
      "For lines that a program puts together from what strangers send it. No variable of the environment "
      "(OCIO, OPENIMAGEIO_OPTIONS, OMP_NUM_THREADS, ...) is used; OpenColorIO configs name files of their own "
      "folder alone, and LUTs no other files; outputs are not written to or through symbolic links; only the "
      "formats of --help formats are read and written, whatever --formats says; every image and volume of these "
      "is read by a process of its own that may read that file and compute, and nothing else; and where --limit "
      "says nothing else, pixels=268435456,channels=64,frames=1000,memory=4096,seconds=300. Names of files are taken as they "
      "are: which ones a stranger may name is the server's to say. What it is good against: SECURITY.md.";
  rows.push_back(Option("no-sandbox",
                        "Files that would be read in a process of their own are read by the program.",
                        [](const Arguments&, Options& o) { o.sandbox = false; }));
  rows.back().info.help =
      "Under --safe every image, else those of formats that only --formats all reads, are read by a process that "
      "may read that one file, compute and end, and nothing else (seccomp, on Linux): a reader that crashes, "
      "hangs or is taken over by what it reads is an error of the file. It may take the memory and, for a header "
      "or some rows, the seconds of --limit, else 4096 MiB. Pixels and metadata are the same. Where the system has "
      "no such thing, such files are refused; this option has them read all the same. Not for jobs of --batch: it "
      "stands on the program's own line.";
}

// For comparison, and for programs.
void AddEngine(std::vector<Command>& rows) {
  rows.push_back(Option("codec", "Who decodes and encodes pixels; `oiio` is OpenImageIO, always.",
                        [](const Arguments& a, Options& o) {
                          o.codec = a.Text("CODEC") == "oiio" ? Codec::kOpenImageIO : Codec::kAuto;
                        },
                        {{.name = "CODEC",
                          .type = ParamType::kChoice,
                          .default_value = "",
                          .help = "auto, or oiio",
                          .choices = {"auto", "oiio"}}}));
  rows.back().info.help =
      "Formats and metadata are OpenImageIO's. Where the file allows it, a codec of ours packs and unpacks the "
      "pixels on every core: of PNG those of 8 and 16 bits, without palette or interlacing; of EXR scan lines of halves "
      "or of floats, read with any compression, written with none, zips and zip; of TIFF strips without compression or deflated. Pixels and metadata are the same "
      "either way; --explain says per input who decodes and, where it is OpenImageIO, why, --runstats the same of every "
      "file. oiio is there for comparison. Levels that are asked for (zip:9, png:compressionLevel) are libdeflate's.";
  rows.push_back(Option("rules-off",
                        "Switches a rewrite rule of the engine off; `all` leaves none: for tests.",
                        [](const Arguments& a, Options& o) { o.render.rules_off.push_back(a.Text("RULE")); },
                        {{.name = "RULE",
                          .type = ParamType::kChoice,
                          .default_value = "",
                          .help = "the rule's name; may be given again",
                          .choices = RuleNames()}}));
  rows.back().info.help =
      "A run is a list of steps: loads, operations, stores. Rules rewrite it into a faster one, and --explain "
      "prints behind every step which ones did, in braces. Results do not depend on them, but that an affine "
      "operation on integer codes (the rule codes) may give the neighbouring code near a tie. With "
      "all of them off everything goes through planes of floats.";
  rows.push_back(Option("list-commands", "Prints every command for programs to read.",
                        [](const Arguments& a, Options& o) {
                          o.list_commands = true;
                          if (a.Given("format")) o.list_format = a.Text("format");
                        },
                        {},
                        {{.name = "format",
                          .type = ParamType::kChoice,
                          .default_value = "tsv",
                          .help = "how it is printed",
                          .choices = {"tsv", "json", "markdown"}}}));
  rows.back().info.help =
      "tsv: a heading line, then one line per command with tab-separated columns: name, group, images taken "
      "(-1: as many as its arguments say), images given, arguments (blank-separated), modifiers "
      "(key=default, written as on the line), summary. Generators are listed as \"pattern NAME\". json holds "
      "ranges, choices and the whole help as well. markdown is the reference page.";
  rows.push_back(Option("progress", "Shows progress on stderr even when that is no terminal.",
                        [](const Arguments&, Options& o) { o.progress = true; }));
  rows.push_back(
      Option("no-progress", "Shows no progress.", [](const Arguments&, Options& o) { o.progress = false; }));
}

// Frames for many processes, and many for one.
void AddSharing(std::vector<Command>& rows) {
  rows.push_back(Option("part", "Runs the line for a part of its frames: one of many processes.",
                        [](const Arguments& a, Options& o) {
                          o.part = a.Text("K/N");
                          if (!o.part.starts_with("auto")) ParseFramePart(o.part);
                        },
                        {Text("K/N", "part K of N, or auto: what a scheduler says, or auto/N")}));
  rows.back().info.help =
      "Part K has the frames K, K+N, K+2N ... of the list, so that parts are equally long where frames become slower. "
      "The files are those of one process, byte for byte. auto takes K and N from the environment of a scheduler's task; the first of these "
      "that is set counts: " +
      SchedulerHelp() +
      ". auto/N says N itself: tasks are numbered from 1 to N then (from 0 where the list says so), and one of them can be "
      "run again alone. Every process must see the same list: where inputs are still arriving, --frames or a range in "
      "a name gives it. Refused are lines where parts would wait for each other: an output that several frames write, a frame "
      "that reads another's output. Not under --safe. tessera-farm makes a job of Slurm of such a line.";
  rows.back().lines = {"--frames 1-8 --part 2/4 in.exr --mulc {FRAME_NUMBER/8} -o out.#.exr"};
  rows.push_back(Option("resume",
                        "Leaves the frames that are finished already, by records beside the outputs.",
                        [](const Arguments&, Options& o) { o.resume = true; }));
  rows.back().info.help =
      "To be given from the first run on. Each process keeps a record of every frame that it has finished, in "
      "NAMEframes.K-of-N.jsonl, NAME being the first output's up to the frame's number (out.frames.1-of-1.jsonl for "
      "out.#.exr), and reads those of all parts. A frame is finished where a record has this line (but for options of the run "
      "alone: --frames, --part, --threads, -v and the like) and this version, inputs of the sizes and times of now, and "
      "outputs of the size and the hash (XXH64) that was written; a file that is there, torn, altered or made by another line is made again. Inputs are "
      "the files that words name and those that images come from; what an OpenColorIO config names itself is not looked "
      "at. Records are written by one call each, when the outputs have their names, and have a hash of their own: processes may end "
      "at any moment, and several may run. What a line prints about a frame is not printed again. Refused are outputs that their "
      "own frame reads, --no-clobber, -u and --safe. With --json a last report, frames, says what was left, made and failed.";
  rows.back().lines = {"--frames 1-4 --resume in.exr --mulc {FRAME_NUMBER/4} -o out.#.exr"};
  rows.push_back(
      Option("parallel-frames", "Frames that may be under way at once: decoded, computed, encoded.",
             [](const Arguments& a, Options& o) {
               const std::string& text = a.Text("N");
               int count = 0;
               const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
               const bool number = error == std::errc() && end == text.data() + text.size();
               if (text != "auto" && (!number || count < 1 || count > kMostParallelFrames)) {
                 throw UsageError("--parallel-frames", "found \"" + text +
                                                           "\", expected auto, or a number from 1 to " +
                                                           std::to_string(kMostParallelFrames));
               }
               o.parallel_frames = count;
             },
             {Text("N", "a number, or auto: one more than threads, at most 16")}));
  rows.back().info.help =
      "All of them share --threads, and with --max-memory each takes its Nth of it; one that would be computed by "
      "another method within that has all of it, while no other is computed. Without --parallel-frames up to three are under way, and with "
      "--max-memory one. It is always one with a single thread, where one may read what another writes, where the line tells something while it "
      "runs (-v, --runstats, --verify, --stats), with --limit of memory or seconds, and in a job of --batch. The files are the same, byte for byte, and they get their names in order; "
      "after an error no later frame's does, but with --skip-bad-frames.";
  rows.back().lines = {"--frames 1-4 --parallel-frames auto in.exr --mulc {FRAME_NUMBER/4} -o out.#.exr"};
}

// Frames, and how files are named and written.
void AddFrames(std::vector<Command>& rows) {
  rows.push_back(
      Option("frames",
             "Runs the line once per frame; # or %04d in file names, {FRAME_NUMBER} in any word, becomes "
             "the frame's number.",
             [](const Arguments& a, Options& o) { o.frames = a.Text("RANGE"); },
             {Text("RANGE", "frames such as 1-10, 1-100x2 or 3,7,10-20")}));
  rows.back().info.help =
      "RANGE is a comma-separated list of frames and of ranges FIRST-LAST, FIRST-LASTxSTEP or "
      "FIRST-LASTySTEP (those that x leaves out), at most a million frames. # stands for four digits, @ for "
      "one, %04d for what printf makes of it. Without --frames, a range in a name (shot.1-10#.exr) or the "
      "files present decide. {FRAME_NUMBER} anywhere in a line with such a name is the frame's number; the "
      "braces may hold a calculation with + - * / and parentheses: --frames 1-48 --pattern "
      "clouds:time={FRAME_NUMBER/24} 1920x1080 3 -o clouds.#.exr. Frames are independent, and up to three are "
      "under way at once, see --parallel-frames; --part shares them out among processes, --resume leaves what is finished. Files and errors "
      "come in order.";
  rows.push_back(Option("wildcardoff",
                        "File names that follow hold no frame numbers: # @ and % are themselves.",
                        [](const Arguments&, Options& o) { o.wildcards = false; }));
  rows.back().info.help =
      "A file whose name is just as written needs it not: a name with #, @ or % stands for that file where "
      "there is one. Outputs do, whose names are not there yet.";
  rows.push_back(Option("wildcardon", "File names that follow may hold frame numbers again.",
                        [](const Arguments&, Options& o) { o.wildcards = true; }));
  rows.push_back(Option("skip-bad-frames",
                        "A frame that fails does not stop the frames after it; the exit code is 1.",
                        [](const Arguments&, Options& o) { o.skip_bad_frames = true; }));
  AddSharing(rows);
  rows.push_back(Option("framepadding", "Digits of frame numbers, whatever the pattern says.",
                        [](const Arguments& a, Options& o) { o.frame_padding = a.Integer("N"); },
                        {Whole("N", 1, 16, "digits")}));
  rows.push_back(Option("no-fsync", "Outputs get their names before they are on the disk: for scratch disks.",
                        [](const Arguments&, Options& o) { o.sync = false; }));
  rows.back().info.help =
      "Without it a file whose name is there holds what it should even after the power failed: it and its "
      "directory are flushed.";
  rows.push_back(Option("nosoftwareattrib",
                        "Does not write the command line into Exif:ImageHistory and Software.",
                        [](const Arguments&, Options& o) { o.software_attribute = false; }));
  rows.back().info.help =
      "Options that files do not depend on (-v, --threads, --progress, --verify, --part, --resume and the like) are "
      "not written in any case.";
}

ParamInfo Word(const std::string& name, const std::string& default_value, const std::string& help,
               std::vector<std::string> choices) {
  return {.name = name,
          .type = ParamType::kChoice,
          .default_value = default_value,
          .help = help,
          .choices = std::move(choices)};
}

// Frames of pipes.
void AddStream(std::vector<Command>& rows) {
  ParamInfo input = Text("input", "y4m, or the format of raw frames, such as rgb24 or yuv420p10le");
  ParamInfo output = Text(
      "output", "same, y4m, C and a colour space of Y4M (C420mpeg2, C444p10), or a format of raw frames");
  ParamInfo size = Text("size", "WxH: of raw frames that are read"),
            rate =
                Text("rate",
                     "frames a second, such as 24 or 30000/1001, in place of those that are read, or of 25");
  input.default_value = "y4m", output.default_value = "same";
  rows.push_back(Option(
      "stream",
      "Runs the line for every frame of standard input (-), which goes on to standard output (-o -).",
      [](const Arguments& a, Options& o) {
        StreamOptions& s = o.stream;
        s.on = true;
        s.input = a.Text("input"), s.output = a.Text("output"), s.size = a.Text("size");
        s.matrix = a.Text("matrix"), s.range = a.Text("range"), s.siting = a.Text("siting");
        s.alpha = a.Text("alpha"), s.rate = a.Text("rate");
      },
      {},
      {input, output, size,
       Word("matrix", "auto", "of Y'CbCr; auto: bt709 from 1280 columns or 720 rows on, else bt601",
            {"auto", "bt601", "bt709", "bt2020"}),
       Word("range", "auto", "of the codes; auto: as XCOLORRANGE says, else limited, of grey alone full",
            {"auto", "limited", "full"}),
       Word("siting", "auto", "of the chroma; auto: as the colour space says, else left",
            {"auto", "centre", "left", "topleft"}),
       Word("alpha", "straight", "of raw frames: straight is multiplied in and divided out",
            {"straight", "premultiplied"}),
       rate}));
  rows.back().info.help =
      "Between two FFmpegs: ffmpeg -i in.mkv -f yuv4mpegpipe - | tessera --stream - --saturate 1.2 -o - | ffmpeg -i - out.mkv "
      "(more than 8 bits: -strict -1 -f yuv4mpegpipe). Frames come, are computed and go one by one, up to three at once (--parallel-frames), in constant memory. "
      "Either end may be files: in.#.exr with -o -, or - with -o out.#.png, numbered from 1. "
      "Y4M is 4:2:0, 4:2:2, 4:4:4 and mono of 8 to 16 bits without alpha; FFmpeg's names for raw frames are rgb24, rgba, bgra, rgb48le, rgba64le, "
      "rgbf32le, rgbaf32le, gbrp10le, gray, gray16le, yuv420p, yuv422p10le and their like.\n"
      "A frame is R'G'B' as it stands, and no colour space is taken for granted; values beyond [0, 1], as limited range has them, are kept. The matrix is that of the frames that are read, by "
      "their size where nobody says, and of those that are written alone where none are read. Where chroma has half the width or height: if a sample lies amid two (centre; left and topleft "
      "say so of rows, and of neither) its value goes along the line whose slope is its neighbours', and back their mean; if it lies on the first of two, up goes the mean of it and the next, back (-1 2 6 2 -1)/8. "
      "Back undoes up: chroma that nobody changed keeps its codes.\n"
      "What commands print goes to stderr, as -o - has standard output. A stream that ends within a frame, a header in the midst, a result of another size and a reader that has gone are errors, and "
      "the frames before them are written. Not for --batch, --safe, --part, --resume; with -n and --explain the first frame alone.";
}

// So that a file is the same, and to --resume too, whatever threads made it and whatever was told meanwhile.
void MarkBearings(std::vector<Command>& rows) {
  for (Command& row : rows) {
    for (const char* const name : {"v", "q", "n", "threads", "runstats", "progress", "no-progress", "verify",
                                   "skip-bad-frames", "no-fsync", "part", "resume", "parallel-frames"}) {
      if (row.info.name == name) row.bearing = Bearing::kRun;
    }
    if (row.info.name == "frames") row.bearing = Bearing::kFrames;
  }
}

}  // namespace

bool Options::ShowsProgress() const { return progress.value_or(!quiet && isatty(fileno(Messages())) == 1); }

std::vector<Command> OptionCommands() {
  std::vector<Command> rows;
  for (auto* const add : {AddHelp, AddLine, AddEvaluation, AddGuards, AddEngine, AddFrames, AddStream})
    add(rows);
  MarkBearings(rows);
  return rows;
}

}  // namespace tessera::cli
