// Who looks at finished files before they get their names.
#ifndef TESSERA_BASE_COMMIT_WITNESS_H_
#define TESSERA_BASE_COMMIT_WITNESS_H_

#include <functional>
#include <string>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// While one lives, `look` is called on its thread for every file that is finished there, when no other
// process can have replaced it yet. What it throws ends the commit before a name is given. They nest; the
// latest looks.
class CommitWitness {
 public:
  using Look = std::function<void(const std::string& temporary, const std::string& file)>;
  explicit CommitWitness(Look look);
  ~CommitWitness();
  CommitWitness(const CommitWitness&) = delete;
  CommitWitness& operator=(const CommitWitness&) = delete;

  // For who gives the names.
  static void Show(const std::string& temporary, const std::string& file);

 private:
  Look look_;
  CommitWitness* before_;
};

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_COMMIT_WITNESS_H_
