// --batch through real pipes: answers, words, failures, signals, and files equal to those of a process per
// job.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/cli_test.h"
#include "support/sanitized.h"

namespace tessera::testing {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// The program with pipes to and from it.
class Batch {
 public:
  Batch(const std::filesystem::path& directory, std::vector<std::string> options = {},
        const std::string& batch = "--batch") {
    options.insert(options.begin(), {TESSERA_PROGRAM, batch});
    int in[2], out[2];
    EXPECT_EQ(pipe2(in, O_CLOEXEC), 0);
    EXPECT_EQ(pipe2(out, O_CLOEXEC), 0);
    std::vector<char*> argv;
    for (std::string& word : options) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, directory.c_str());
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    EXPECT_EQ(posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(in[0]), close(out[1]);
    to_ = in[1], from_ = out[0];
  }
  ~Batch() {
    CloseInput(), CloseOutput();
    if (pid_ > 0) kill(pid_, SIGKILL), Wait();
  }

  void Send(const std::string& text) const {
    EXPECT_EQ(write(to_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  // The next answer; null when there are no more.
  json Answer() {
    size_t end = 0;
    while ((end = text_.find('\n')) == std::string::npos) {
      char bytes[4096];
      const ssize_t count = read(from_, bytes, sizeof bytes);
      if (count <= 0) return nullptr;
      text_.append(bytes, static_cast<size_t>(count));
    }
    json answer = json::parse(text_.substr(0, end), nullptr, /*allow_exceptions=*/false);
    EXPECT_TRUE(answer.is_object()) << text_.substr(0, end);
    text_.erase(0, end + 1);
    return answer;
  }
  json Ask(const std::string& line) {
    Send(line + "\n");
    return Answer();
  }
  pid_t process() const { return pid_; }
  void CloseInput() { Close(to_); }
  void CloseOutput() { Close(from_); }
  void Signal(int signal) const { kill(pid_, signal); }
  // The exit code; 128 + N when ended by signal N that the program did not catch.
  int Wait() {
    int status = 0;
    if (waitpid(pid_, &status, 0) != pid_) return -1;
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  static void Close(int& descriptor) {
    if (descriptor >= 0) close(descriptor);
    descriptor = -1;
  }

  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
  std::string text_;
};

class BatchTest : public CliTest {};

TEST_F(BatchTest, EveryJobHasOneAnswer) {
  Batch batch(directory_.path());
  const json made = batch.Ask("--pattern ramp 8x6 3 -d uint8 -o a.tif");
  EXPECT_EQ(made["job"], 1);
  EXPECT_EQ(made["ok"], true);
  EXPECT_EQ(made["exit_code"], 0);
  EXPECT_THAT(made["outputs"], ElementsAre("a.tif"));
  EXPECT_GE(made["seconds"], 0.0);
  EXPECT_GT(made["cpu_seconds"], 0.0);
  EXPECT_EQ(made["output"], "");
  EXPECT_EQ(made["messages"], "");
  EXPECT_FALSE(made.contains("error") || made.contains("id"));
  EXPECT_TRUE(std::filesystem::exists(Path("a.tif")));

  const json told =
      batch.Ask("\n# none of these is a job\n \t\n-v a.tif --runstats --printstats --dup -o b.tif -o c.tif");
  EXPECT_EQ(told["job"], 5);
  EXPECT_THAT(told["outputs"], ElementsAre("b.tif", "c.tif"));
  EXPECT_THAT(std::string(told["output"]), AllOf(HasSubstr("Stats Max: "), HasSubstr("runstats c.tif:")));
  EXPECT_THAT(std::string(told["messages"]), HasSubstr("tessera: reading a.tif: 8 x 6"));
  EXPECT_EQ(batch.Ask("a.tif --printstats")["messages"], "");

  const json frames = batch.Ask("--frames 1-3 --pattern clouds 4x4 3 -o f.#.png");
  EXPECT_THAT(frames["outputs"], ElementsAre("f.0001.png", "f.0002.png", "f.0003.png"));
  EXPECT_THAT(std::string(batch.Ask("--version")["output"]), HasSubstr("tessera "));

  batch.Send("a.tif -o last.tif");  // the end of the input ends the line
  batch.CloseInput();
  EXPECT_THAT(batch.Answer()["outputs"], ElementsAre("last.tif"));
  EXPECT_EQ(batch.Answer(), nullptr);
  EXPECT_EQ(batch.Wait(), 0);
}

TEST_F(BatchTest, WordsOfAnyKind) {
  Batch batch(directory_.path());
  const auto writes = [&](const std::string& line, const std::string& name) {
    const json answer = batch.Ask(line);
    EXPECT_EQ(answer["ok"], true) << line << "\n" << answer;
    EXPECT_THAT(answer["outputs"], ElementsAre(name)) << line;
    EXPECT_TRUE(std::filesystem::exists(Path(name))) << line;
    return answer;
  };
  const std::string make = "--pattern constant 2x2 3 --wildcardoff -o ";
  writes(make + "'one $two.png'", "one $two.png");
  writes(make + "\"a \\\"b\\\" \\c \\\\ \\$d 'e'.png\"", "a \"b\" \\c \\ $d 'e'.png");
  writes(make + "x\\ y\\'z.png\r", "x y'z.png");
  writes(make + "\t p''q\"r\"'s'.png ", "pqrs.png");
  writes(make + "~*.png", "~*.png");
  writes(make + "'it'\"'\"'s.png'", "it's.png");  // as Python's shlex.quote writes it
  writes(R"( ["--pattern","constant","2x2","3","-o","new\nline \u00e9.png"])", "new\nline \u00e9.png");
  const json named = writes(
      R"({"words":["--pattern","constant","2x2","3","-o","n.png"],"id":{"ticket":[7,"seven"]}})", "n.png");
  EXPECT_EQ(named["id"], json::parse(R"({"ticket":[7,"seven"]})"));
  // A name that is no text: the file has it, the answer something like it.
  const json odd = batch.Ask(make + "odd\xff.png");
  EXPECT_EQ(odd["ok"], true);
  EXPECT_TRUE(std::filesystem::exists(Path("odd\xff.png")));
}

TEST_F(BatchTest, FailuresEndNothingButTheirJob) {
  MakePicture("a.tif", 40, 30, 3, OIIO::TypeUInt8);
  std::ofstream(Path("bad.png")) << "\x89PNG\r\n\x1a\n and no more";
  Batch batch(directory_.path());
  const std::string longest(size_t{1} << 20, 'x');
  const struct {
    std::string line, kind, message;
    int exit_code;
  } cases[] = {
      {"--hue", "usage", "expected DEG", 2},
      {"a.tif --nothing -o x.tif", "usage", "unknown command", 2},
      {"a.tif", "usage", "no output", 2},
      {"''", "usage", "empty word", 2},
      {"[]", "usage", "no image and no command", 2},
      {"--batch", "usage", "found in a job", 2},
      {"a.tif 'b", "usage", "opening '", 2},
      {"a.tif \"b\\\"", "usage", "opening \"", 2},
      {"a.tif \\", "usage", "backslash", 2},
      {"[\"a.tif\",", "usage", "parse error", 2},
      {"[\"a.tif\",1]", "usage", "number", 2},
      {"[\"a\\u0000b.tif\"]", "usage", "byte 0", 2},
      {"[\"\xff.tif\"]", "usage", "UTF-8", 2},
      {"{\"words\":{}}", "usage", "object", 2},
      {"{\"word\":[]}", "usage", "\"word\"", 2},
      {std::string(100000, '['), "usage", "parse error", 2},
      {longest + "xx", "data", "more than 1048576 bytes", 1},
      {"--simd NONE a.tif -o x.tif", "usage", "--simd NONE", 2},
      {"absent.tif -o x.tif", "data", "absent.tif: no such file", 1},
      {"bad.png -o x.tif", "data", "bad.png", 1},
      {"/dev/stdin -o x.tif", "system", "/dev/stdin", 1},  // which the jobs do not come from
      {"a.tif -o nowhere/x.tif", "data", "no directory", 1},
      {"a.tif a.tif --mulc 2 --diff", "result", "verdict", 1},
      {"--skip-bad-frames --frames 1-2 absent.#.tif -o x.#.tif", "result", "verdict", 1},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.line.substr(0, 80));
    const json answer = batch.Ask(c.line);
    ASSERT_TRUE(answer.is_object());
    EXPECT_EQ(answer["ok"], false);
    EXPECT_EQ(answer["exit_code"], c.exit_code);
    EXPECT_EQ(answer["error"]["kind"], c.kind);
    EXPECT_THAT(std::string(answer["error"]["message"]), HasSubstr(c.message));
    EXPECT_THAT(answer["outputs"], IsEmpty());
  }
  EXPECT_EQ(directory_.Names(), (std::set<std::string>{"a.tif", "bad.png"}));
  EXPECT_EQ(batch.Ask("a.tif -o x.tif")["ok"], true);
  batch.CloseInput();
  EXPECT_EQ(batch.Wait(), 0);
}

// What a job sets ends with it.
TEST_F(BatchTest, FilesAreThoseOfAProcessPerJob) {
  MakePicture("photo.exr", 150, 90, 4, OIIO::TypeFloat);
  std::ofstream(Path("small.ocio"))
      << "ocio_profile_version: 2\nroles: {default: a, scene_linear: a}\n"
         "displays: {d: [!<View> {name: v, colorspace: a}]}\nfile_rules:\n  - !<Rule> {name: Default, colorspace: default}\n"
         "colorspaces:\n  - !<ColorSpace> {name: a}\n"
         "  - !<ColorSpace> {name: sRGB, from_scene_reference: !<MatrixTransform> "
         "{offset: [.25, 0, 0, 0]}}\n";
  std::vector<std::string> lines = {
      "photo.exr --threads 1 -d half --saturate 1.4 -o half.exr",
      "photo.exr --hue 40 -o float.exr",
      "photo.exr --colorconfig small.ocio --colorconvert a sRGB -o config.tif",
      "photo.exr --iscolorspace ACEScg --colorconvert ACEScg sRGB -d uint8 -o built_in.png",
      "photo.exr --simd SSE4 --blur:sigma=3 --contrast 1.2 -o sse.exr",
      "photo.exr --blur:sigma=3 --contrast 1.2 -o best.exr",
      "photo.exr --max-memory 1 --rules-off all --resize 60% -o small.exr",
      "photo.exr --resize 60% -o large.exr",
      "photo.exr --nosoftwareattrib --attrib Artist somebody --codec oiio -o artist.tif",
      "photo.exr --ch R,G --addc -0.5 --lic:length=9 -o flow.tif",
      "--pattern perlin 60x40 3 -d uint16 -o noise.png",
      "photo.exr --ch R,G,B -d uint8 -o photo.jpg",
  };
  std::vector<std::string> names;
  for (const std::string& line : lines) names.push_back(line.substr(line.rfind(' ') + 1));
  const auto kept = [&] {
    std::vector<std::string> files;
    for (const std::string& name : names) {
      files.push_back(FileText(Path(name)));
      EXPECT_FALSE(files.back().empty()) << name;
      std::filesystem::remove(Path(name));
    }
    return files;
  };
  for (const std::string& line : lines) Works(line);
  const std::vector<std::string> alone = kept();
  for (const char* order : {"forwards", "backwards", "twice"}) {
    Batch batch(directory_.path());
    for (const int round : {1, 2}) {
      if (round == 2 && std::string(order) != "twice") break;
      for (const std::string& line : lines) EXPECT_EQ(batch.Ask(line)["ok"], true) << line;
    }
    std::reverse(lines.begin(), lines.end());
    const std::vector<std::string> files = kept();
    for (size_t i = 0; i < names.size(); ++i) EXPECT_TRUE(files[i] == alone[i]) << order << " " << names[i];
  }
}

TEST_F(BatchTest, OptionsBesideItHoldForEveryJob) {
  Batch batch(directory_.path(), {"--nosoftwareattrib", "--threads", "1", "-v"});
  for (const char* name : {"a.tif", "b.tif"}) {
    const json answer = batch.Ask(std::string("--pattern constant 2x2 3 -o ") + name);
    EXPECT_THAT(std::string(answer["messages"]), HasSubstr(std::string("writing ") + name));
    EXPECT_EQ(Load(name).spec().get_string_attribute("Software"), "");
  }
  const CommandResult wrong = Tessera("--batch a.tif");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("a.tif: found beside --batch"));
}

TEST_F(BatchTest, SignalsEndTheJobUnderWay) {
  for (const int signal : {SIGTERM, SIGINT}) {
    Batch batch(directory_.path());
    EXPECT_EQ(batch.Ask("--pattern constant 2x2 3 -o a.tif")["ok"], true);
    batch.Send("--pattern clouds:octaves=12 16384x16384 3 -o b.tif\n--pattern constant 2x2 3 -o c.tif\n");
    while (directory_.Names().size() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    batch.Signal(signal);
    const json answer = batch.Answer();
    EXPECT_EQ(answer["job"], 2);
    EXPECT_EQ(answer["ok"], false);
    EXPECT_EQ(answer["exit_code"], 128 + signal);
    EXPECT_EQ(answer["error"]["kind"], "cancelled");
    EXPECT_EQ(batch.Answer(), nullptr);
    EXPECT_EQ(batch.Wait(), 128 + signal);
    EXPECT_EQ(directory_.Names(), std::set<std::string>{"a.tif"});
  }
  // ThreadSanitizer of gcc 12 keeps a signal back until a read has come to its end.
  if (testing::kThreadSanitized) return;
  Batch idle(directory_.path());
  EXPECT_EQ(idle.Ask("--pattern constant 2x2 3 -o a.tif")["ok"], true);
  idle.Signal(SIGTERM);
  EXPECT_EQ(idle.Answer(), nullptr);
  EXPECT_EQ(idle.Wait(), 128 + SIGTERM);
}

TEST_F(BatchTest, NobodyReadsTheAnswers) {
  Batch batch(directory_.path());
  EXPECT_EQ(batch.Ask("--pattern constant 2x2 3 -o a.tif")["ok"], true);
  batch.CloseOutput();
  batch.Send("--pattern constant 2x2 3 -o b.tif\n--pattern constant 2x2 3 -o c.tif\n");
  EXPECT_EQ(batch.Wait(), 128 + SIGPIPE);
  EXPECT_EQ(directory_.Names(), (std::set<std::string>{"a.tif", "b.tif"}));
}

// Those of one after the other but for the times, in the lines' order, whoever is done first.
TEST_F(BatchTest, SeveralAtOnceHaveTheSameAnswersInOrder) {
  std::string lines = "# no job\n\n--pattern clouds:octaves=9 900x700 3 -o large.png\n";
  for (int i = 0; i < 12; ++i)
    lines += "--pattern clouds:seed=" + std::to_string(i) + " 9x7 3 -o " + std::to_string(i) + ".png\n";
  lines += "--frobnicate\nmissing.png -o x.png\n";
  lines += R"({"id":[1,"two"],"words":["--version"]})"
           "\n'\n";
  lines += "--pattern constant 2x2 3 --printstats -o last.png";
  const auto run = [&](const std::string& option) {
    Batch batch(directory_.path(), {}, option);
    batch.Send(lines);
    batch.CloseInput();
    std::vector<json> answers;
    for (json answer = batch.Answer(); answer != nullptr; answer = batch.Answer()) {
      answer.erase("seconds"), answer.erase("cpu_seconds");
      answers.push_back(answer);
    }
    EXPECT_EQ(batch.Wait(), 0);
    std::vector<std::string> bytes;
    for (const char* name : {"large.png", "11.png", "last.png"}) bytes.push_back(FileText(Path(name)));
    return std::pair{answers, bytes};
  };
  const auto expected = run("--batch");
  EXPECT_EQ(expected.first.size(), 18U);
  EXPECT_EQ(expected.first.at(0)["job"], 3);
  for (const std::string option : {"--batch:jobs=2", "-batch:jobs=5", "--batch:jobs=0", "--batch:jobs=1"})
    EXPECT_EQ(run(option), expected) << option;
}

TEST_F(BatchTest, SeveralAtOnceAreAnsweredAsTheyCome) {
  Batch batch(directory_.path(), {"--threads", "1"}, "--batch:jobs=2");
  EXPECT_EQ(batch.Ask("--pattern constant 2x2 3 -o a.tif")["job"], 1);
  EXPECT_EQ(batch.Ask("a.tif -o b.tif")["ok"], true);
  batch.Send("--pattern clouds:octaves=12 16384x16384 3 -o c.tif\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  batch.Signal(SIGTERM);
  const json answer = batch.Answer();
  EXPECT_EQ(answer["job"], 3);
  EXPECT_EQ(answer["error"]["kind"], "cancelled");
  EXPECT_EQ(batch.Answer(), nullptr);
  EXPECT_EQ(batch.Wait(), 128 + SIGTERM);
  EXPECT_EQ(directory_.Names(), (std::set<std::string>{"a.tif", "b.tif"}));
}

// The process that runs it is gone, as by a fault of a library: that job fails, those after it do not.
TEST_F(BatchTest, ACrashIsTheAnswerOfItsJob) {
  Batch batch(directory_.path(), {"--threads", "1"}, "--batch:jobs=2");
  EXPECT_EQ(batch.Ask("--pattern constant 2x2 3 -o a.tif")["ok"], true);
  batch.Send(R"({"id":"x","words":["--pattern","clouds:octaves=12","16384x16384","3","-o","c.tif"]})"
             "\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const std::string id = std::to_string(batch.process());
  std::ifstream children("/proc/" + id + "/task/" + id + "/children");
  for (pid_t child = 0; children >> child;) kill(child, SIGKILL);
  const json answer = batch.Answer();
  EXPECT_EQ(answer["job"], 2);
  EXPECT_EQ(answer["id"], "x");
  EXPECT_EQ(answer["exit_code"], 128 + SIGKILL);
  EXPECT_EQ(answer["error"]["kind"], "internal");
  EXPECT_EQ(batch.Ask("a.tif -o b.tif")["ok"], true);
  batch.CloseInput();
  EXPECT_EQ(batch.Wait(), 0);
}

// What another line would start the program over for.
TEST_F(BatchTest, RareFilesInTheMiddle) {
  std::ofstream(Path("tetrahedron.obj"))
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  std::ofstream(Path("volume.dat")) << std::string(" BDV\0\0\0\0", 8) + std::string(92, 'a');
  Batch batch(directory_.path());
  EXPECT_EQ(batch.Ask("--pattern constant 2x2 3 -o a.tif")["ok"], true);
  EXPECT_EQ(batch.Ask("volume.dat -o x.png")["error"]["kind"], "data");
  const json mesh = batch.Ask("--volume:mesh=tetrahedron.obj:mode=iso:size=8x6:dims=24 -o v.png");
  EXPECT_EQ(mesh["job"], 3);
  EXPECT_EQ(mesh["ok"], true) << mesh;
  EXPECT_EQ(batch.Ask("a.tif -o b.tif")["ok"], true);
}

}  // namespace
}  // namespace tessera::testing
