// Follows the image stack through a line without running it.
#ifndef TESSERA_CLI_VALIDATE_H_
#define TESSERA_CLI_VALIDATE_H_

#include <vector>

#include "cli/arguments.h"

namespace tessera::cli {

// Images that a command wants on the stack.
int Needs(const Step& step);

// As in oiiotool, a command may stand before its operands (`--diff a.exr b.exr`): it is moved behind the
// images that follow it when the stack is too short for it where it stands.
std::vector<Step> OperandsFirst(std::vector<Step> steps);

// `tells_inputs`: of files that are read something is printed, so that no other output is needed (--info).
// Throws UsageError for too few images, an image that no output uses, a line without output, a file that is
// both written and read or written twice, a setting that comes after all it could hold for.
void CheckStack(const std::vector<Step>& steps, bool tells_inputs = false);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_VALIDATE_H_
