// Commands in words: synopsis, operands, what a parameter may be.
#ifndef TESSERA_CLI_DESCRIBE_H_
#define TESSERA_CLI_DESCRIBE_H_

#include <string>
#include <vector>

#include "cli/command.h"

namespace tessera::cli {

// "--saturate[:weights=rec709] S"; modifiers that find no room in a line are left out.
std::string Synopsis(const Command& command, size_t columns = 100);
// "checker[:width=16]".
std::string GeneratorSynopsis(const ops::OpInfo& generator, size_t columns = 100);
// "Takes two images and gives one."; empty where the stack is not concerned.
std::string Operands(const Command& command);
// How many images are on the stack for it (-1: as many as its arguments say), and how many it leaves in their
// place.
int Taken(const Command& command);
int Given(const Command& command);
// An operation's or a pattern's examples as lines of the shell, "tessera in.exr --saturate 0.5 -o out.exr".
std::vector<std::string> ExampleLines(const ops::OpInfo& row);
// The same of a command of any kind.
std::vector<std::string> ExampleLines(const Command& command);
// "A number from 0 to 1; default 0.5."
std::string AllowedValues(const ops::ParamInfo& param);
// The name of a parameter's type: number, integer, flag, numbers, choice, text.
std::string TypeName(ops::ParamType type);
// "-o" or "--name".
std::string Dashed(const std::string& name);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_DESCRIBE_H_
