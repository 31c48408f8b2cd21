// Files of frames, each by one name.
#include "cli/frame_files.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include "cli/session.h"

namespace tessera::cli {
namespace {

// Files by one name each, whatever words name them.
class Names {
 public:
  std::string Of(const std::string& word) {
    namespace fs = std::filesystem;
    std::error_code code;
    fs::path path(word);
    if (fs::is_symlink(fs::symlink_status(path, code))) path = fs::weakly_canonical(path, code);
    const std::string directory = path.parent_path().string();
    auto at = directories_.find(directory);
    if (at == directories_.end()) {
      const fs::path whole = fs::weakly_canonical(directory.empty() ? "." : directory, code);
      at = directories_.emplace(directory, whole.string()).first;
    }
    return at->second + "/" + path.filename().string();
  }

 private:
  std::map<std::string, std::string> directories_;
};

}  // namespace

bool IsOutput(const Step& step) { return step.command->run == WriteOutput; }

std::vector<bool> OutputWords(const Line& line, const std::vector<std::string>& words) {
  std::vector<bool> outputs(words.size());
  for (size_t i = 1; i < words.size(); ++i) {
    for (const Step& step : line.steps)
      outputs[i] = outputs[i] || (IsOutput(step) && words[i - 1] == step.written);
  }
  return outputs;
}

std::vector<std::string> NamesIn(const std::string& word) {
  std::vector<std::string> parts = {word};
  for (size_t begin = 0; word.find_first_of(":=,") != std::string::npos && begin <= word.size();) {
    const size_t end = std::min(word.find_first_of(":=,", begin), word.size());
    if (end > begin) parts.push_back(word.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

bool MayReadWritten(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs) {
  Names names;
  std::map<std::string, size_t> writers;  // the first of each file
  for (size_t frame = 0; frame < frames.size(); ++frame) {
    for (size_t i = 0; i < outputs.size(); ++i) {
      if (outputs[i]) writers.emplace(names.Of(frames[frame].words[i]), frame);
    }
  }
  for (size_t frame = 0; frame < frames.size(); ++frame) {
    const std::vector<std::string>& words = frames[frame].words;
    for (size_t i = 0; i < outputs.size(); ++i) {
      // Of frames with the same word the last has the most before it.
      if (outputs[i] || (frame + 1 < frames.size() && frames[frame + 1].words[i] == words[i])) continue;
      for (const std::string& part : NamesIn(words[i])) {
        const auto writer = writers.find(names.Of(part));
        if (writer != writers.end() && writer->second < frame) return true;
      }
    }
  }
  return false;
}

std::string OutputOfSeveral(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs) {
  Names names;
  std::map<std::string, size_t> writers;
  for (size_t frame = 0; frame < frames.size(); ++frame) {
    for (size_t i = 0; i < outputs.size(); ++i) {
      if (!outputs[i]) continue;
      const auto [at, first] = writers.emplace(names.Of(frames[frame].words[i]), frame);
      if (!first && at->second != frame) return frames[frame].words[i];
    }
  }
  return "";
}

std::string OutputThatIsRead(const std::vector<FrameLine>& frames, const std::vector<bool>& outputs) {
  Names names;
  for (const FrameLine& frame : frames) {
    std::set<std::string> read;
    for (size_t i = 0; i < outputs.size(); ++i) {
      if (outputs[i]) continue;
      for (const std::string& part : NamesIn(frame.words[i])) read.insert(names.Of(part));
    }
    for (size_t i = 0; i < outputs.size(); ++i) {
      if (outputs[i] && read.contains(names.Of(frame.words[i]))) return frame.words[i];
    }
  }
  return "";
}

}  // namespace tessera::cli
