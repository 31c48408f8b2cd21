// Files of the fuzz targets, and their seeds as files for other fuzzers.
#include "fuzz/fuzz.h"

#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "fuzz/seed_files.h"

namespace tessera::fuzz {
namespace {

namespace fs = std::filesystem;

struct Temporary {
  Temporary() {
    std::error_code ignored;
    const fs::path memory("/dev/shm");
    const bool writable = fs::is_directory(memory, ignored) && ::access(memory.c_str(), W_OK) == 0;
    path = ((writable ? memory : fs::temp_directory_path()) / "tessera-fuzz-XXXXXX").string();
    if (::mkdtemp(path.data()) == nullptr) Fail("no folder for temporary files");
  }
  ~Temporary() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  std::string path;
};

std::string Escaped(const std::string& word) {
  std::string text;
  for (const char c : word) {
    char code[8];
    const bool plain = c >= 0x20 && c < 0x7F && c != '"' && c != '\\';
    std::snprintf(code, sizeof code, plain ? "%c" : "\\x%02X", plain ? c : static_cast<unsigned char>(c));
    text += code;
  }
  return text;
}

}  // namespace

const std::string& Folder() {
  static const Temporary kFolder;
  return kFolder.path;
}

File::File(const std::string& name) : path_(Folder() + "/" + name) {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (descriptor_ < 0) Fail("a temporary file cannot be written");
}
File::~File() { ::close(descriptor_); }

const std::string& File::Put(std::string_view bytes) {
  if (::pwrite(descriptor_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()) ||
      ::ftruncate(descriptor_, static_cast<off_t>(bytes.size())) != 0)
    Fail("a temporary file cannot be written");
  return path_;
}

std::string Contents(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void WriteSeeds(const std::string& folder) {
  fs::create_directories(folder);
  int number = 0;
  for (const std::string& seed : Seeds())
    std::ofstream(fs::path(folder) / ("seed_" + std::to_string(number++)), std::ios::binary) << seed;
}

void WriteDictionary(const std::string& file) {
  std::ofstream stream(file);
  for (const std::string& word : Words()) {
    if (!word.empty()) stream << '"' << Escaped(word) << "\"\n";
  }
}

}  // namespace tessera::fuzz
