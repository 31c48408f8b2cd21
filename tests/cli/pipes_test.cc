// Standard input and output as images, words from files.
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "cli/cli_test.h"

namespace tessera::testing {
namespace {

class PipesTest : public CliTest {
 protected:
  void SetUp() override {
    MakePicture("a.exr", 61, 43, 3, OIIO::TypeHalf, 3);
    Works("a.exr --clamp:min=0:max=1 -d uint8 -o a.png");
  }
  // `tool` stands for the program.
  CommandResult Shell(std::string line) {
    for (size_t at; (at = line.find("tool ")) != std::string::npos;)
      line.replace(at, 4, "'" TESSERA_PROGRAM "'");
    return RunCommand({"sh", "-c", line}, directory_.path());
  }
  std::string Bytes(const std::string& name) const {
    std::ifstream file(Path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

TEST_F(PipesTest, BytesAreThoseOfFiles) {
  Works("--nosoftwareattrib a.png --saturate 0.5 -o file.png");
  const CommandResult piped = Shell("tool --nosoftwareattrib - --saturate 0.5 -o png:- < a.png > piped.png");
  EXPECT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(Bytes("piped.png"), Bytes("file.png"));
  const CommandResult chain = Shell(
      "cat a.exr | tool --nosoftwareattrib - --flip -o exr:- | tool --nosoftwareattrib - --flip -o exr:- > chain.exr");
  EXPECT_EQ(chain.exit_code, 0) << chain.err;
  EXPECT_EQ(Oiiotool("a.exr chain.exr --fail 0 --diff").exit_code, 0);
  const CommandResult same = Shell("tool --nosoftwareattrib a.png --saturate 0.5 -o - > same.png");
  EXPECT_EQ(same.exit_code, 0) << same.err;
  EXPECT_EQ(Bytes("same.png"), Bytes("file.png"));
}

TEST_F(PipesTest, WhatIsWrongIsTold) {
  EXPECT_NE(Shell("tool --pattern checker 8x8 3 -o - ").err.find("png:-"), std::string::npos);
  const CommandResult none = Shell("tool - -o x.png < /dev/null");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("error"), std::string::npos);
  const CommandResult failed = Shell("tool a.png gone.png --add -o png:- > kept");
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_EQ(Bytes("kept"), "");
  EXPECT_NE(Shell("echo '- -o x.png' | tool --batch").out.find("in a job"), std::string::npos);
}

TEST_F(PipesTest, NothingIsLeftBehind) {
  std::filesystem::create_directory(Path("tmp"));
  EXPECT_EQ(Shell("TMPDIR=tmp tool - -o png:- < a.png > x.png").exit_code, 0);
  EXPECT_EQ(Shell("TMPDIR=tmp tool - gone.png --add -o png:- < a.png").exit_code, 1);
  EXPECT_TRUE(std::filesystem::is_empty(Path("tmp")));
}

TEST_F(PipesTest, WordsComeFromFiles) {
  std::ofstream(Path("grade")) << "# a look\n--saturate 0.5\n--attrib Comment 'two words'\n";
  Works("a.exr @grade -o x.exr");
  Works("a.exr --saturate 0.5 -o y.exr");
  EXPECT_EQ(Oiiotool("x.exr y.exr --fail 0 --diff").exit_code, 0);
  EXPECT_EQ(Load("x.exr").spec().get_string_attribute("Comment"), "two words");
  EXPECT_NE(Tessera("a.exr @gone -o x.exr").exit_code, 0);
}

// What stands in for a pipe goes with the process, or with the next one that writes to a pipe.
TEST_F(PipesTest, NothingStaysOfAnInterruptedOutput) {
  std::filesystem::create_directory(Path("scratch"));
  const auto wait = [&] {
    for (int i = 0; i < 6000; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      for (const auto& entry : std::filesystem::recursive_directory_iterator(Path("scratch"))) {
        std::error_code gone;
        if (entry.is_regular_file(gone) && entry.file_size(gone) > 100000 && !gone) return;
      }
    }
    ADD_FAILURE() << "no temporary file grew";
  };
  const std::string scratch = "TMPDIR=" + Path("scratch");
  for (const int signal : {SIGTERM, SIGINT, SIGKILL}) {
    RunningCommand running({"env", scratch, TESSERA_PROGRAM, "--pattern", "ramp", "30000x30000", "3", "-d",
                            "float", "-o", "tif:-"},
                           directory_.path());
    wait();
    kill(running.pid(), signal);
    EXPECT_EQ(running.Wait().exit_code, 128 + signal);
    EXPECT_EQ(std::filesystem::is_empty(Path("scratch")), signal != SIGKILL) << signal;
  }
  EXPECT_EQ(
      RunCommand({"env", scratch, TESSERA_PROGRAM, "a.png", "-o", "png:-"}, directory_.path()).exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_empty(Path("scratch")));
}

}  // namespace
}  // namespace tessera::testing
