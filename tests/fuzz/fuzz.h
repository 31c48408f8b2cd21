// What the fuzz targets share. A target is one file: the function that libFuzzer calls, the inputs that
// mutation starts from, and words that are put into them. CONTRIBUTING.md says how one is run and added.
#ifndef TESSERA_TESTS_FUZZ_FUZZ_H_
#define TESSERA_TESTS_FUZZ_FUZZ_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "tessera/error.h"

// Nothing may crash, hang, or say what no caller expects; what is returned is 0.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace tessera::fuzz {

// Every target has these.
std::vector<std::string> Seeds();
std::vector<std::string> Words();

// Removed at the end of the program; in memory where the system has a place for that.
const std::string& Folder();

// A file of the folder that is written anew for every input.
class File {
 public:
  explicit File(const std::string& name);
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  const std::string& Put(std::string_view bytes);
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int descriptor_;
};

// The bytes of a file that was just written, for seeds.
std::string Contents(const std::string& file);

// What was found is no refusal: ends the program, and with it the run.
[[noreturn]] inline void Fail(const std::string& what) {
  std::fprintf(stderr, "finding: %s\n", what.c_str());
  std::abort();
}
inline void Require(bool holds, const char* what) {
  if (!holds) Fail(what);
}

// Calls what may refuse an input, for a reason of one line that names something. Anything else that is thrown
// is a finding.
template <typename Call>
void Try(Call&& call) {
  try {
    call();
  } catch (const Error& e) {
    Require(!e.reason().empty(), "an error without a reason");
  } catch (const std::bad_alloc&) {
  }
}

// Draws from an input: whoever asks beyond its end gets zeros.
class Input {
 public:
  Input(const uint8_t* data, size_t size) : at_(reinterpret_cast<const char*>(data)), end_(at_ + size) {}

  bool empty() const { return at_ == end_; }
  template <typename T>
  T Take() {
    T value{};
    const size_t size = std::min(sizeof value, static_cast<size_t>(end_ - at_));
    std::memcpy(&value, at_, size);
    at_ += size;
    return value;
  }
  // 0 to n - 1.
  size_t Below(size_t n) { return Take<uint8_t>() % n; }
  template <typename T>
  const T& Of(const std::vector<T>& values) {
    return values[Take<uint16_t>() % values.size()];
  }
  // As far as the sign, which is left out, or the end.
  std::string_view Until(char sign) {
    const std::string_view all(at_, static_cast<size_t>(end_ - at_));
    const std::string_view text = all.substr(0, all.find(sign));
    at_ += std::min(text.size() + 1, all.size());
    return text;
  }
  std::string_view Rest() {
    const std::string_view all(at_, static_cast<size_t>(end_ - at_));
    at_ = end_;
    return all;
  }

 private:
  const char *at_, *end_;
};

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_FUZZ_H_
