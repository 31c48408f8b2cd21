// Preloaded into oiiotool beside the stand-ins of the libraries that OpenImageIO seldom needs
// (cmake/stand_in.cmake), so that comparisons of hundreds of lines do not load hundreds of libraries each:
// what calls one of them starts over with the real ones.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

extern "C" [[noreturn]] __attribute__((visibility("default"))) void tessera_start_over() {
  unsetenv("LD_LIBRARY_PATH");
  unsetenv("LD_PRELOAD");
  std::string line;
  if (std::FILE* const file = std::fopen("/proc/self/cmdline", "rb")) {
    for (int c; (c = std::fgetc(file)) != EOF;) line += static_cast<char>(c);
    std::fclose(file);
  }
  std::vector<char*> words;
  for (size_t at = 0; at < line.size(); at = line.find('\0', at) + 1) words.push_back(&line[at]);
  words.push_back(nullptr);
  execv("/proc/self/exe", words.data());
  _exit(127);
}
