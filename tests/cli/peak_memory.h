// What a line took at most, as the program says itself.
#ifndef TESSERA_TESTS_CLI_PEAK_MEMORY_H_
#define TESSERA_TESTS_CLI_PEAK_MEMORY_H_

#include <cstdlib>
#include <string>

#include "cli/cli_test.h"

namespace tessera::testing {

class PeakMemoryTest : public CliTest {
 protected:
  // In MB, mapped pages included.
  double Peak(const std::string& line) {
    const std::string out = Works(line + " --runstats -o out.tif");
    const std::string before = "peak memory ";
    const size_t at = out.find(before);
    return at == std::string::npos ? 1e9 : std::strtod(out.c_str() + at + before.size(), nullptr);
  }
};

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_CLI_PEAK_MEMORY_H_
