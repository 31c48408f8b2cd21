// Configs and processors of OpenColorIO, with errors that name what was not found.
#ifndef TESSERA_OCIO_CONFIG_H_
#define TESSERA_OCIO_CONFIG_H_

#include <OpenColorIO/OpenColorIO.h>

#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/spool.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ocio.h"

namespace tessera::ocio {

namespace lib = OCIO_NAMESPACE;

// A config and the context that its variables are looked up in.
struct Config {
  lib::ConstConfigRcPtr config;
  lib::ConstContextRcPtr context;
  std::string name;  // for messages: the file, or "built-in"
};
Config LoadConfig(const OcioParams& params);

// The space's name where the config knows it (by name, alias or role); throws Error that names the nearest
// one.
std::string RequireColorSpace(const Config& config, const std::string& name);
// The space that an image is in: `name`, or where that is empty or "current" the one of its colour state, or
// scene_linear where nothing is known of it. Throws Error where the config has no space of that name.
std::string SpaceOf(const Config& config, const std::string& name, const ImageSpec& spec);
// The config's name of what `name` (an alias, a role) stands for, or the alias of it that files know.
std::string OwnName(const Config& config, const std::string& name);
void RequireOneOf(const Config& config, const std::string& kind, const std::string& name,
                  const std::vector<std::string>& known);

// OpenColorIO's preparations ask for variables of the environment, and get them in one string that all
// threads share (its header warns of it): one thread at a time. An action within another's is the same
// thread's.
inline std::recursive_mutex preparing;

// `action()`, with OpenColorIO's exceptions as one line about `subject`. Actions prepare: they compute no
// pixels and start no tasks.
std::string OneLine(const std::string& text);
template <class F>
auto Guarded(const std::string& subject, const F& action) -> decltype(action()) {
  const std::lock_guard lock(preparing);
  try {
    return action();
  } catch (const lib::Exception& e) {
    throw DataError(subject, OneLine(e.what()));
  }
}

// With its dot, "" for none.
std::string LowerExtension(const std::string& file);

// To be called before OpenColorIO is given a file: what it keeps is dropped when the file is another than the
// last time.
void ForgetIfChanged(const std::string& file);

// Refuses what OpenColorIO must not be given to read whatever it holds: what is no regular file, or would
// never end.
void RequireLutFile(const std::string& file);

// Refuses a LUT file that OpenColorIO would read wrongly, or with a message about other formats. Returns the
// file to read in its place: the same, or a copy without a byte-order mark that lives as long as the returned
// object.
class CheckedLutFile {
 public:
  explicit CheckedLutFile(const std::string& file);
  ~CheckedLutFile();
  CheckedLutFile(const CheckedLutFile&) = delete;
  CheckedLutFile& operator=(const CheckedLutFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::unique_ptr<base::Spool> copy_;
};

// A processor as nodes on top of `image`; `filter` serves its tables, null: each has its own.
Node Translate(const Node& image, const lib::ConstProcessorRcPtr& processor, const std::string& subject,
               const TableFilter* filter = nullptr);
// The part that has no nodes of its own.
Node ApplyCpuProcessor(const Node& image, const lib::ConstProcessorRcPtr& processor);

}  // namespace tessera::ocio

#endif  // TESSERA_OCIO_CONFIG_H_
