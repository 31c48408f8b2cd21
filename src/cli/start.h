// What is loaded before the line runs: libraries for rare files only where it names such files.
#ifndef TESSERA_CLI_START_H_
#define TESSERA_CLI_START_H_

#include <string>
#include <vector>

namespace tessera::cli {

// The first thing that main() does. The program is linked with libraries that stand in for OpenVDB, FFmpeg
// and OpenCV (cmake/stand_in.cmake); a line that names a file of theirs, and --batch, starts over with the
// real ones.
void Start(char** argv);

// Whether no variable of the environment can be read from here on: the program's line asked for --safe.
bool HasLeftEnvironment();
// Whether the program's own line has --no-sandbox.
bool HasWaivedSandbox();

// Whether the line names a file that OpenVDB or FFmpeg reads, or a mesh.
bool AsksForRareLibraries(const std::vector<std::string>& words);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_START_H_
