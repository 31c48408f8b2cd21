// Records of frames as lines of JSON.
#include "cli/frame_record.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <system_error>

#include "base/directory.h"
#include "base/input_file.h"
#include "cli/frame_files.h"
#include "cli/frame_names.h"
#include "tessera/error_kind.h"
#include "tessera/version.h"

namespace tessera::cli {
namespace {

using nlohmann::ordered_json;

constexpr char kInfix[] = "frames.", kSuffix[] = ".jsonl", kCheck[] = ",\"check\":\"";
constexpr size_t kCheckSize = 16;  // of the hash; "} follows it

std::string NameOf(const std::string& output, int padding) {
  std::string name = output.substr(0, output.find('{'));
  if (const auto frame = FindFrame(output, padding)) name = frame->before;
  if (!name.empty() && std::string_view("/._-").find(name.back()) == std::string_view::npos) name += '.';
  return name + kInfix;
}

std::string Written(const FrameRecord& record) {
  ordered_json json;
  json["frame"] = record.frame;
  json["made_by"] = record.made_by;
  json["inputs"] = ordered_json::array();
  json["outputs"] = ordered_json::array();
  for (const FileState& f : record.inputs) json["inputs"].push_back({f.name, f.size, f.time});
  for (const auto& [name, content] : record.outputs)
    json["outputs"].push_back({name, content.size, content.hash});
  // A name that is no UTF-8 will be taken for another: its frame is made again.
  std::string text = json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  text.pop_back();
  return text + kCheck + HashOf(text) + "\"}\n";
}

// Empty for what is torn, or no record at all.
std::optional<FrameRecord> Read(const std::string& line) try {
  constexpr size_t kTail = std::size(kCheck) - 1 + kCheckSize + 2;
  if (line.size() <= kTail) return std::nullopt;
  const std::string text = line.substr(0, line.size() - kTail);
  if (line.substr(text.size()) != kCheck + HashOf(text) + "\"}") return std::nullopt;
  const ordered_json json = ordered_json::parse(text + "}");
  FrameRecord record;
  json.at("frame").get_to(record.frame);
  json.at("made_by").get_to(record.made_by);
  for (const auto& f : json.at("inputs"))
    record.inputs.push_back({f.at(0).get<std::string>(), f.at(1).get<int64_t>(), f.at(2).get<int64_t>()});
  for (const auto& f : json.at("outputs")) {
    record.outputs.emplace_back(f.at(0).get<std::string>(),
                                FileContent{f.at(1).get<int64_t>(), f.at(2).get<std::string>()});
  }
  return record;
} catch (const ordered_json::exception&) {
  return std::nullopt;  // of a version to come
}

[[noreturn]] void Fail(const std::string& file, const std::string& what) {
  throw SystemError(file, what + ": " + std::error_code(errno, std::generic_category()).message());
}

}  // namespace

std::string MadeBy(const std::vector<std::string>& words, const Line& line) {
  std::string text = "tessera " TESSERA_VERSION_STRING;
  const auto add = [&](const std::string& word) { text += '\0' + word; };
  for (size_t i = 0; i < words.size(); ++i) {
    const auto is_of = [i](const std::vector<size_t>& list) {
      return std::find(list.begin(), list.end(), i) != list.end();
    };
    if (!is_of(line.run_words) && !is_of(line.frame_words)) add(words[i]);
  }
  const char* const config = std::getenv("OCIO");
  add(config == nullptr ? "" : config);
  return HashOf(text);
}

std::vector<FileState> InputsNamed(const std::vector<std::string>& words, const std::vector<bool>& outputs) {
  std::vector<FileState> inputs;
  const auto add = [&](const std::string& word) {
    for (const std::string& name : NamesIn(word)) {
      if (const auto state = StateOf(name)) inputs.push_back(*state);
    }
  };
  for (size_t i = 0; i < words.size(); ++i) {
    if (!outputs[i]) add(words[i]);
  }
  if (const char* const config = std::getenv("OCIO"); config != nullptr) add(config);
  return inputs;
}

FrameRecords::FrameRecords(const std::string& output, int padding, const FramePart& part) {
  const std::string name = NameOf(output, padding);
  file_ = name + part.Name() + kSuffix;
  const std::string start = std::filesystem::path(name).filename().string(), folder = base::DirectoryOf(name);
  for (const std::string& found : base::NamesIn(folder)) {
    if (found.starts_with(start) && found.ends_with(kSuffix)) ReadAll(folder + "/" + found);
  }
}

FrameRecords::~FrameRecords() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void FrameRecords::ReadAll(const std::string& file) {
  base::InputFile stream(file, "records of frames");
  for (std::string line; std::getline(stream, line);) {
    if (auto record = Read(line)) records_.emplace(record->made_by, std::move(*record));
  }
}

bool FrameRecords::IsDone(const std::string& made_by, const std::vector<FileState>& inputs) const {
  const auto [first, last] = records_.equal_range(made_by);
  return std::any_of(first, last, [&](const auto& item) {
    const FrameRecord& r = item.second;
    const auto held = [&](const FileState& f) {
      return std::find(r.inputs.begin(), r.inputs.end(), f) != r.inputs.end();
    };
    return !r.outputs.empty() && std::all_of(inputs.begin(), inputs.end(), held) &&
           std::all_of(r.inputs.begin(), r.inputs.end(),
                       [](const FileState& f) { return StateOf(f.name) == f; }) &&
           std::all_of(r.outputs.begin(), r.outputs.end(), [](const auto& output) {
             const auto state = StateOf(output.first);  // most that differ do in size
             return state && state->size == output.second.size && ContentOf(output.first) == output.second;
           });
  });
}

void FrameRecords::Add(const FrameRecord& record) {
  std::string text = Written(record);
  if (descriptor_ < 0) {
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0666);
    struct stat found {};
    if (descriptor_ < 0 || ::fstat(descriptor_, &found) != 0) Fail(file_, "cannot be written");
    // Behind a line that was torn another one begins.
    char end = '\n';
    if (found.st_size > 0 && ::pread(descriptor_, &end, 1, found.st_size - 1) == 1 && end != '\n')
      text.insert(text.begin(), '\n');
  }
  if (::write(descriptor_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    Fail(file_, "cannot be written");
}

}  // namespace tessera::cli
