// Commands of oiiotool that are not here, and what to use.
#ifndef TESSERA_CLI_LEFT_OUT_H_
#define TESSERA_CLI_LEFT_OUT_H_

#include <string>

namespace tessera::cli {

// What to say of that command of oiiotool 2.4; empty where it has none of that name, or we have it.
std::string WhyLeftOut(const std::string& name);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_LEFT_OUT_H_
