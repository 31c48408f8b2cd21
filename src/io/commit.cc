// Exchanges of names, and their undoing.
#include "io/commit.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <set>
#include <system_error>

#include "base/file_names.h"
#include "io/output_file.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

std::string DirectoryOf(const std::string& file) {
  const size_t slash = file.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : file.substr(0, slash);
}

[[noreturn]] void Fail(const Finished& f, const std::string& what, int code) {
  throw SystemError(f.file, what + ": " + std::error_code(code, std::generic_category()).message());
}

// The errno of a failure, 0 for none. Files that cannot be flushed (EINVAL) need not be.
int Flush(const std::string& name, int flags) {
  const int descriptor = ::open(name.c_str(), flags | O_CLOEXEC);
  if (descriptor < 0) return errno;
  int failure = ::fsync(descriptor) == 0 || errno == EINVAL || errno == EROFS ? 0 : errno;
  if (::close(descriptor) != 0 && failure == 0) failure = errno;
  return failure;
}

enum class Done : uint8_t { kNothing, kNew, kExchanged, kReplaced };

// Its final name. What was there has the temporary name then, where the file system can exchange two names.
Done Rename(const Finished& f, const std::string& target, bool keep) {
  struct stat old;
  const bool replaces = ::stat(target.c_str(), &old) == 0;
  if (replaces && ::chmod(f.temporary.c_str(), old.st_mode & 07777) != 0)
    Fail(f, "cannot be given the permissions of the file it replaces", errno);
  if (replaces && keep && S_ISREG(old.st_mode) &&
      ::renameat2(AT_FDCWD, f.temporary.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0) {
    return Done::kExchanged;
  }
  if (::rename(f.temporary.c_str(), target.c_str()) != 0) Fail(f, "cannot be written", errno);
  return replaces ? Done::kReplaced : Done::kNew;
}

}  // namespace

void CommitAll(const std::vector<Finished>& files, const CommitLook& look) {
  std::vector<std::string> targets;
  std::set<std::string> directories;
  for (const Finished& f : files) {
    targets.push_back(ResolveTarget(f.file));
    if (look) look(f.temporary, f.file);
    if (!f.sync) continue;
    if (const int code = Flush(f.temporary, O_RDONLY); code != 0) Fail(f, "cannot be written", code);
    directories.insert(DirectoryOf(targets.back()));
  }
  std::vector<Done> done(files.size(), Done::kNothing);
  base::FileNames& unfinished = Context::Default().files();
  try {
    for (size_t i = 0; i < files.size(); ++i) done[i] = Rename(files[i], targets[i], files.size() > 1);
  } catch (...) {
    for (size_t i = files.size(); i-- > 0;) {
      const char *name = files[i].temporary.c_str(), *target = targets[i].c_str();
      if (done[i] == Done::kNew) ::rename(target, name);
      if (done[i] == Done::kExchanged) ::renameat2(AT_FDCWD, name, AT_FDCWD, target, RENAME_EXCHANGE);
    }
    throw;
  }
  for (size_t i = 0; i < files.size(); ++i) {
    if (done[i] == Done::kExchanged) ::unlink(files[i].temporary.c_str());
    unfinished.Forget(files[i].temporary);
  }
  // They have their names; a directory that cannot be flushed is no reason to call them failed.
  for (const std::string& directory : directories) Flush(directory, O_RDONLY | O_DIRECTORY);
}

}  // namespace tessera::io
