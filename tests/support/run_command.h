// Runs a program as a user would, and a directory of one test's own.
#ifndef TESSERA_TESTS_SUPPORT_RUN_COMMAND_H_
#define TESSERA_TESTS_SUPPORT_RUN_COMMAND_H_

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

extern char** environ;

namespace tessera::testing {

inline std::string FileText(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// Removed with all it holds.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "tessera-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "no temporary directory " << name;
    path_ = name;
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }
  // Names of everything inside, hidden files too.
  std::set<std::string> Names() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_))
      names.insert(entry.path().filename());
    return names;
  }

 private:
  std::filesystem::path path_;
};

struct CommandResult {
  int exit_code = -1;  // 128 + N when ended by signal N that the program did not catch
  std::string out, err;
};

// A running program; its streams go to files of its own.
class RunningCommand {
 public:
  RunningCommand(std::vector<std::string> words, const std::filesystem::path& directory) {
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, directory.c_str());
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, (streams_.path() / "out").c_str(), kFlags,
                                     0600);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, (streams_.path() / "err").c_str(), kFlags,
                                     0600);
    if (posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ) != 0) {
      ADD_FAILURE() << "cannot run " << words[0];
      pid_ = -1;
    }
    posix_spawn_file_actions_destroy(&actions);
  }

  pid_t pid() const { return pid_; }

  CommandResult Wait() {
    CommandResult result;
    int status = 0;
    if (pid_ < 0 || waitpid(pid_, &status, 0) != pid_) return result;
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = FileText(streams_.path() / "out");
    result.err = FileText(streams_.path() / "err");
    return result;
  }

 private:
  TemporaryDirectory streams_;
  pid_t pid_ = -1;
};

inline CommandResult RunCommand(std::vector<std::string> words, const std::filesystem::path& directory) {
  return RunningCommand(std::move(words), directory).Wait();
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_RUN_COMMAND_H_
