// Pipes are spooled through files: readers seek, and an output shall be whole or not be there.
#include "cli/pipes.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <system_error>

#include "base/input_file.h"
#include "base/spool.h"
#include "cli/batch_job.h"
#include "cli/signals.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

constexpr char kInput[] = "standard input", kOutput[] = "standard output";

// All of standard input in a file that has no name any more, so that nothing is left behind.
int KeepInput() {
  std::string name = std::filesystem::temp_directory_path().string() + "/tessera-XXXXXX";
  const auto fail = [](const std::string& what) {
    throw SystemError(kInput, what + std::error_code(errno, std::generic_category()).message());
  };
  int file = -1;
  {
    const SignalsWait wait;
    file = ::mkostemp(name.data(), O_CLOEXEC);
    if (file < 0) fail("cannot be kept in " + name + ": ");
    ::unlink(name.c_str());
  }
  std::array<char, 1 << 16> block;
  while (true) {
    const ssize_t n = ::read(STDIN_FILENO, block.data(), block.size());
    if (n == 0) return file;
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("cannot be read: ");
    for (ssize_t done = 0; done < n;) {
      const ssize_t written = ::write(file, block.data() + done, static_cast<size_t>(n - done));
      if (written < 0 && errno != EINTR) fail("cannot be kept in a temporary file: ");
      done += std::max<ssize_t>(written, 0);
    }
  }
}

}  // namespace

const std::string& StandardInput() {
  if (SignalsEndJob::Alive())
    throw UsageError("-", "found in a job, where standard input brings the jobs; expected a file's name");
  static const std::string kName = "/proc/self/fd/" + std::to_string(KeepInput());
  return kName;
}

bool IsStandardOutput(const std::string& file) { return file == "-" || file.ends_with(":-"); }

std::string InPlaceOfStandardOutput(const std::string& file, Session& session) {
  if (SignalsEndJob::Alive())
    throw UsageError(file,
                     "found in a job, where standard output brings the answers; expected a file's name");
  std::string extension = file == "-" ? "" : "." + file.substr(0, file.size() - 2);
  if (file == "-" && !session.inputs.empty())
    extension = std::filesystem::path(session.inputs.front()).extension().string();
  if (extension.empty())
    throw UsageError("-o " + file, "found no format, expected one before the -, such as png:-");
  const auto spool = std::make_shared<base::Spool>(Context::Default().files(), "pipe", extension);
  session.WhenInPlace([spool] {
    std::ifstream from(spool->file(), std::ios::binary);
    std::cout << from.rdbuf() << std::flush;
    if (!std::cout) throw SystemError(kOutput, "cannot be written");
  });
  return spool->file();
}

std::vector<std::string> WithWordsOfFiles(const std::vector<std::string>& words) {
  std::vector<std::string> all;
  for (const std::string& word : words) {
    std::error_code code;
    // A file of just that name is an image; @ alone is the frame's digit in one.
    if (word.size() < 2 || word[0] != '@' || std::filesystem::exists(word, code) ||
        !std::filesystem::is_regular_file(word.substr(1), code)) {
      all.push_back(word);
      continue;
    }
    base::InputFile stream(word.substr(1), "a file of words", int64_t{1} << 20);
    for (std::string line; std::getline(stream, line);) {
      if (!IsJob(line)) continue;
      const std::vector<std::string> own = ParseJob(line).words;
      all.insert(all.end(), own.begin(), own.end());
    }
  }
  return all;
}

}  // namespace tessera::cli
