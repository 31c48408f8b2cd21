// Files that appear whole or not at all: a temporary name beside the target, and a stream that remembers
// failures.
#ifndef TESSERA_IO_OUTPUT_FILE_H_
#define TESSERA_IO_OUTPUT_FILE_H_

#include <OpenImageIO/filesystem.h>

#include <cstdint>
#include <cstdio>
#include <mutex>
#include <string>
#include <vector>

namespace tessera::io {

// The file that an output name stands for: symbolic links are followed, so that replacing it does not replace
// the link. Throws Error when it is a directory, a device, or exists and cannot be written.
std::string ResolveTarget(const std::string& file);

// Creates an empty file of a unique hidden name beside `target`, with its extension, known to
// RemoveUnfinishedOutputs. Throws Error naming `shown` when the directory is missing or cannot be written.
std::string CreateTemporary(const std::string& target, const std::string& shown);
// Throws Error, as CreateTemporary would, for a directory that is not there or that takes no files.
void RequireDirectory(const std::string& target, const std::string& shown);
// Unlinks and forgets it; does nothing for an empty name.
void RemoveTemporary(const std::string& temporary) noexcept;
// Whether a file that an encoder wrote without a stream of ours could still have grown: the errno that a
// further write meets, 0 for none. The file is left as it was. A disk that was full while it was written says
// so here.
int GrowthFailure(const std::string& name);

// The stream that encoders write to. Some overlook a full disk (OpenEXR when it closes a file), some end the
// process (libjpeg), so that this stream accepts every write and remembers the first that failed; whoever
// owns it asks.
class CheckedFile final : public OIIO::Filesystem::IOProxy {
 public:
  explicit CheckedFile(const std::string& name);
  ~CheckedFile() override;

  // Not "file": OpenImageIO would take it for its own IOFile.
  const char* proxytype() const override { return "checked"; }
  void close() override;
  bool seek(int64_t offset) override;
  int64_t tell() override;
  size_t read(void* buffer, size_t size) override;
  size_t write(const void* buffer, size_t size) override;
  size_t pread(void* buffer, size_t size, int64_t offset) override;
  size_t pwrite(const void* buffer, size_t size, int64_t offset) override;
  size_t size() const override;
  void flush() const override;

  // errno of the first failure, 0 for none.
  int failure() const { return failure_; }

 private:
  void Note(bool ok) const;

  std::FILE* file_ = nullptr;
  mutable int failure_ = 0;
  mutable std::recursive_mutex mutex_;
};

}  // namespace tessera::io

#endif  // TESSERA_IO_OUTPUT_FILE_H_
