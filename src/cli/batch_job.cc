// The small grammar of a job's line, and the same in JSON.
#include "cli/batch_job.h"

#include <nlohmann/json.hpp>

#include "cli/arguments.h"

namespace tessera::cli {
namespace {

using nlohmann::json;

constexpr char kJob[] = "job", kBlanks[] = " \t\r";

// Blanks part words. '...' is taken as it is; in "..." a backslash protects $ ` " and itself; elsewhere it
// protects whatever follows. Nothing is expanded. Bytes that are no UTF-8 pass.
std::vector<std::string> ShellWords(std::string_view line) {
  std::vector<std::string> words;
  bool inside = false;  // a word, which may be empty ('')
  char quote = 0;
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote == 0 && (c == ' ' || c == '\t')) {
      inside = false;
      continue;
    }
    if (!inside) words.emplace_back(), inside = true;
    if (quote != 0 && c == quote) {
      quote = 0;
    } else if (quote == 0 && (c == '"' || c == '\'')) {
      quote = c;
    } else if (c == '\\' && quote != '\'') {
      if (i + 1 == line.size()) throw UsageError(kJob, "found a backslash at the end of the line");
      const char next = line[i + 1];
      if (quote == 0 || next == '"' || next == '\\' || next == '$' || next == '`') ++i;
      words.back() += line[i];
    } else {
      words.back() += c;
    }
  }
  if (quote != 0) throw UsageError(kJob, std::string("found an opening ") + quote + " without a closing one");
  return words;
}

std::vector<std::string> JsonWords(const json& list) {
  if (!list.is_array())
    throw UsageError(
        kJob, std::string("found the words as ") + list.type_name() + ", expected a JSON array of strings");
  std::vector<std::string> words;
  for (const json& word : list) {
    if (!word.is_string())
      throw UsageError(kJob,
                       std::string("found a word that is ") + word.type_name() + ", expected strings alone");
    words.push_back(word.get<std::string>());
  }
  return words;
}

Job ParseJson(std::string_view line) {
  json value;
  try {
    value = json::parse(line);
  } catch (const json::exception& e) {
    const std::string reason = e.what();  // "[json.exception.parse_error.101] parse error at ..."
    throw UsageError(kJob, reason.substr(std::min(reason.find("] ") + 2, reason.size())));
  }
  if (value.is_array()) return {"", JsonWords(value)};
  Job job;
  for (const auto& [key, held] : value.items()) {
    if (key == "words") {
      job.words = JsonWords(held);
    } else if (key == "id") {
      job.id = held.dump();
    } else {
      throw UsageError(kJob, "found the key \"" + key + "\", expected \"words\" and, if wanted, \"id\"");
    }
  }
  return job;
}

}  // namespace

bool IsJob(std::string_view line) {
  const size_t start = line.find_first_not_of(kBlanks);
  return start != std::string_view::npos && line[start] != '#';
}

Job ParseJob(std::string_view line) {
  line.remove_prefix(line.find_first_not_of(kBlanks));
  if (line.ends_with('\r')) line.remove_suffix(1);
  Job job = line[0] == '[' || line[0] == '{' ? ParseJson(line) : Job{"", ShellWords(line)};
  for (const std::string& word : job.words) {
    if (word.find('\0') != std::string::npos) throw UsageError(kJob, "found a byte 0, expected text");
  }
  return job;
}

}  // namespace tessera::cli
