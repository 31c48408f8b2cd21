// What is checked of a LUT file before OpenColorIO reads it: sizes, domains, numbers that are none, entries
// given twice.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "base/input_file.h"
#include "base/number_text.h"
#include "base/spool.h"
#include "ocio/config.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::ocio {
namespace {

namespace fs = std::filesystem;

constexpr int kMostEntries1D = 1024 * 1024, kLongestEdge3D = 129;  // as OpenColorIO has them
constexpr size_t kLongestNarrowLine = 4096;
constexpr char kByteOrderMark[] = "\xef\xbb\xbf";

std::vector<std::string> WordsOf(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

// The number that the whole word is, infinities and NaN included.
bool IsNumber(const std::string& word, double& value) {
  const char* const first = word.data() + (word.size() > 1 && word[0] == '+' ? 1 : 0);
  const auto [end, error] = std::from_chars(first, word.data() + word.size(), value);
  return error != std::errc::invalid_argument && end == word.data() + word.size();
}

// A text file line by line, with what every check needs to say.
class Checker {
 public:
  Checker(const std::string& file, std::istream& stream, size_t longest_line)
      : file_(file), stream_(stream), longest_(longest_line) {}

  // .cube of Iridas and Resolve.
  void Cube() {
    while (Next()) {
      if (words_[0] == "LUT_1D_SIZE") {
        RequireSize(words_[0], kMostEntries1D);
      } else if (words_[0] == "LUT_3D_SIZE") {
        RequireSize(words_[0], kLongestEdge3D);
      } else if (words_[0] == "DOMAIN_MIN") {
        Triple(low_);
      } else if (words_[0] == "DOMAIN_MAX") {
        Triple(high_);
      } else if (words_[0] == "LUT_1D_INPUT_RANGE" || words_[0] == "LUT_3D_INPUT_RANGE") {
        RequireRange(words_[0], 1);
      } else {
        RequireNumbersWhereAny();
      }
    }
    for (int c = 0; c < 3; ++c) {
      if (!(low_[c] < high_[c])) {
        Refuse("found a domain from " + base::NumberText(low_[c]) + " to " + base::NumberText(high_[c]) +
               ", expected it to increase");
      }
    }
  }

  // Entries between braces.
  void Spi1d() {
    int open = 0;
    while (Next()) {
      if (words_[0] == "From") {
        RequireRange("From", 1);
      } else if (words_[0] == "{" || words_[0] == "}") {
        open = words_[0] == "{" ? line_ : 0;
      } else if (open > 0) {
        RequireNumbers(0);
      }
    }
    if (open > 0) RefuseUnclosed(open);
  }

  // Houdini's: groups of entries between braces.
  void Lut() {
    std::vector<int> open;
    while (Next()) {
      for (const std::string& word : words_) {
        if (word == "{") open.push_back(line_);
        if (word == "}" && !open.empty()) open.pop_back();
      }
      if (!open.empty() && words_[0] != "{" && words_.back() != "{") RequireNumbers(0);
    }
    if (!open.empty()) RefuseUnclosed(open.back());
  }

  void Spi3d() {
    std::map<std::array<int, 3>, int> seen;
    while (Next()) {
      if (words_.size() != 6) continue;
      std::array<int, 3> at{};
      for (size_t i = 0; i < 3; ++i) {
        const std::string& word = words_[i];
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), at[i]);
        if (error != std::errc() || end != word.data() + word.size())
          Refuse("found \"" + word + "\"" + Where() + ", expected the index of an entry");
      }
      RequireNumbers(3);
      if (const auto [first, added] = seen.emplace(at, line_); !added) {
        Refuse("found the entry " + words_[0] + " " + words_[1] + " " + words_[2] + " twice" + Where() +
               " and in line " + std::to_string(first->second));
      }
    }
  }

  // Cinespace's: metadata, then for each channel a curve of N inputs that increase and N outputs, then the
  // table.
  void Csp() {
    bool metadata = false;
    int curve_lines = 0;
    for (int line = 0; Next(); ++line) {
      if (words_[0] == "BEGIN" || words_[0] == "END") {
        metadata = words_[0] == "BEGIN";
        continue;
      }
      if (metadata || line < 2) continue;
      RequireNumbers(0);
      if (++curve_lines > 9 || curve_lines % 3 != 2) continue;
      for (size_t i = 1; i < words_.size(); ++i) {
        double before = 0, value = 0;
        IsNumber(words_[i - 1], before), IsNumber(words_[i], value);
        if (!(before < value))
          Refuse("found inputs of a curve from " + words_[i - 1] + " to " + words_[i] + Where() +
                 ", expected them to increase");
      }
    }
  }

  // Formats of lines that are words, or numbers from end to end.
  void Lines() {
    while (Next()) {
      if (words_[0] == "LUT_3D_SIZE") RequireSize(words_[0], kLongestEdge3D);  // of .itx
      if (words_[0] == "grid_size") RequireSizes(words_[0], kLongestEdge3D);   // of .vf
      if (words_[0] != "3DMESH") RequireNumbersWhereAny();                     // a word of Lustre's .3dl
    }
  }

 private:
  [[noreturn]] void Refuse(const std::string& reason) const { throw DataError(file_, reason); }
  std::string Where() const { return " in line " + std::to_string(line_); }

  // The next line that has words, comments left out.
  bool Next() {
    for (std::string line; base::GetLine(stream_, line, file_, line_ + 1, longest_);) {
      ++line_;
      if (line_ == 1 && line.starts_with(kByteOrderMark)) line.erase(0, 3);
      words_ = line.starts_with("#") ? std::vector<std::string>() : WordsOf(line);
      if (!words_.empty()) return true;
    }
    return false;
  }

  void RequireSize(const std::string& name, int most) const { RequireSizes(name, most, 1); }
  void RequireSizes(const std::string& name, int most, size_t count = 3) const {
    std::string word = "nothing";
    bool right = words_.size() == count + 1;
    for (size_t i = 1; i < words_.size() && (right || i == 1); ++i) {
      double size = 0;
      word = words_[i];
      right = right && IsNumber(word, size) && size == std::floor(size) && size >= 2 && size <= most;
    }
    if (right) return;
    Refuse("found " + name + " " + base::Shown(word) + Where() + ", expected a size from 2 to " +
           std::to_string(most));
  }
  void RequireRange(const std::string& name, size_t at) const {
    double low = 0, high = 0;
    if (words_.size() < at + 2 || !IsNumber(words_[at], low) || !IsNumber(words_[at + 1], high)) return;
    if (!(low < high)) {
      Refuse("found " + name + " " + words_[at] + " " + words_[at + 1] + Where() +
             ", expected a range that increases");
    }
  }
  void Triple(double (&values)[3]) const {
    if (words_.size() != 4)
      Refuse("found " + std::to_string(words_.size() - 1) + " numbers after " + words_[0] + Where() +
             ", expected 3");
    for (size_t c = 0; c < 3; ++c) {
      if (!IsNumber(words_[c + 1], values[c]))
        Refuse("found \"" + base::Shown(words_[c + 1]) + "\"" + Where() + ", expected a number");
    }
  }
  // Every word a finite number as C++ writes them: OpenColorIO reads the start of a word and drops the rest.
  void RequireNumbers(size_t from) const {
    for (size_t i = from; i < words_.size(); ++i) {
      double value = 0;
      if (!IsNumber(words_[i], value))
        Refuse("found \"" + base::Shown(words_[i]) + "\"" + Where() + ", expected a number");
      if (!std::isfinite(value)) Refuse("found " + words_[i] + Where() + ", expected finite numbers");
    }
  }
  // The same of a line that begins with a number or what looks like one; OpenColorIO judges the others.
  void RequireNumbersWhereAny() const {
    double value = 0;
    if (std::string("+-.0123456789").find(words_[0][0]) != std::string::npos || IsNumber(words_[0], value))
      RequireNumbers(0);
  }
  [[noreturn]] void RefuseUnclosed(int line) const {
    Refuse("found { in line " + std::to_string(line) +
           " and the end of the file, expected } after the last entry");
  }

  const std::string& file_;
  std::istream& stream_;
  std::vector<std::string> words_;
  size_t longest_;
  int line_ = 0;
  double low_[3] = {0, 0, 0}, high_[3] = {1, 1, 1};
};

// OpenColorIO tries the readers of all formats, and that of .csp looks for the end of the metadata beyond the
// file's.
void RequireMetadataEnds(const std::string& file, std::istream& stream) {
  stream.clear();
  stream.seekg(0);
  constexpr std::string_view kMagic = "CSPLUTV100";
  const auto upper = [](std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
  };
  std::string start(4096, '\0');  // others may be one line from end to end
  stream.read(start.data(), std::ssize(start));
  if (upper(start).find(kMagic) == std::string::npos) return;
  stream.clear();
  stream.seekg(0);
  std::string line;
  int number = 0, open = 0;
  while (base::GetLine(stream, line, file, ++number)) {
    line.erase(std::min(line.find_last_not_of(" \t\r") + 1, line.size()));
    if (line == "END METADATA") {
      open = 0;
    } else if (open == 0 && upper(line).find("BEGIN METADATA") != std::string::npos) {
      open = number;
    }
  }
  if (open == 0) return;
  throw DataError(file, "found BEGIN METADATA in line " + std::to_string(open) +
                            " and the end of the file, expected END METADATA");
}

// Color Transform Format files may name others, which OpenColorIO then reads. Names of elements do not depend
// on case; bytes of 0 are left out for what UTF-16 makes of them.
void RequireNoReferences(const std::string& file, std::istream& stream) {
  if (!Context::Default().policy().configs_inside) return;
  stream.clear();
  stream.seekg(0);
  constexpr std::string_view kElement = "<reference";
  std::string held;
  for (std::array<char, 1 << 16> bytes; stream.read(bytes.data(), bytes.size()) || stream.gcount() > 0;) {
    held.erase(0, held.size() - std::min(held.size(), kElement.size()));
    for (std::streamsize i = 0; i < stream.gcount(); ++i) {
      const auto byte = static_cast<unsigned char>(bytes[static_cast<size_t>(i)]);
      if (byte != 0) held += static_cast<char>(std::tolower(byte));
    }
    if (held.find(kElement) != std::string::npos)
      throw DataError(file, "refers to other files, expected a LUT that holds all of itself");
  }
}

// What the stream holds from `skip` on, in a file of its own with the same extension.
std::unique_ptr<base::Spool> CopyWithout(const std::string& file, std::istream& stream, std::streamoff skip) {
  auto spool =
      std::make_unique<base::Spool>(Context::Default().files(), "lut", fs::path(file).extension().string());
  stream.clear();
  stream.seekg(skip);
  std::ofstream copy(spool->file(), std::ios::binary);
  copy << stream.rdbuf();
  copy.close();
  if (!copy) throw SystemError(file, "cannot write a temporary copy without its byte-order mark");
  return spool;
}

}  // namespace

std::string LowerExtension(const std::string& file) {
  std::string extension = fs::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

void RequireLutFile(const std::string& file) {
  ForgetIfChanged(file);
  base::InputFile stream(file, "a LUT that OpenColorIO reads", base::kMostText);
  RequireMetadataEnds(file, stream);
  RequireNoReferences(file, stream);
}

CheckedLutFile::CheckedLutFile(const std::string& file) : path_(file) {
  ForgetIfChanged(file);
  base::InputFile stream(file, "a LUT that OpenColorIO reads", base::kMostText);
  if (stream.peek() == std::ifstream::traits_type::eof()) throw DataError(file, "is empty, expected a LUT");
  const std::string extension = LowerExtension(file);
  // Lines of these hold three numbers or a title.
  const bool narrow = extension == ".cube" || extension == ".spi1d" || extension == ".spi3d";
  Checker checker(path_, stream, narrow ? kLongestNarrowLine : base::kLongestLine);
  if (extension == ".cube") checker.Cube();
  if (extension == ".spi1d") checker.Spi1d();
  if (extension == ".spi3d") checker.Spi3d();
  if (extension == ".csp") checker.Csp();
  if (extension == ".lut" && stream.peek() != 'L') checker.Lut();
  if (extension == ".itx" || extension == ".3dl" || extension == ".spimtx" || extension == ".vf")
    checker.Lines();
  RequireMetadataEnds(path_, stream);
  RequireNoReferences(path_, stream);
  char start[4] = {};
  stream.clear();
  stream.seekg(0);
  stream.read(start, 3);
  if (std::string(start) == kByteOrderMark && extension != ".icc" && extension != ".icm") {
    copy_ = CopyWithout(file, stream, 3);
    path_ = copy_->file();
  }
}

CheckedLutFile::~CheckedLutFile() {
  if (copy_ != nullptr) lib::ClearAllCaches();  // nobody asks for it again
}

}  // namespace tessera::ocio
