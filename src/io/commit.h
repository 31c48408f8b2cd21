// Finished files get their names: all of them or none.
#ifndef TESSERA_IO_COMMIT_H_
#define TESSERA_IO_COMMIT_H_

#include <functional>
#include <string>
#include <vector>

namespace tessera::io {

struct Finished {
  std::string temporary;
  std::string file;  // the name it is to have
  bool sync = true;  // on the disk before it has it
};

// Gives every file its name and the permissions of the one it replaces, in order. When one of them cannot be
// given its, those before it are taken back and what was there before is there again. Throws Error naming the
// file. The temporaries are gone afterwards, or are what they were. `look` as PendingOutput::CommitTogether
// has it.
using CommitLook = std::function<void(const std::string& temporary, const std::string& file)>;
void CommitAll(const std::vector<Finished>& files, const CommitLook& look);

}  // namespace tessera::io

#endif  // TESSERA_IO_COMMIT_H_
