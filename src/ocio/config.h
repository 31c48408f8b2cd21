// Configs and processors of OpenColorIO, with errors that name what was not found.
#ifndef TESSERA_OCIO_CONFIG_H_
#define TESSERA_OCIO_CONFIG_H_

#include <OpenColorIO/OpenColorIO.h>

#include <exception>
#include <string>
#include <vector>

#include "tessera/error.h"
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
// An empty name: the image's own colour space, else scene_linear.
std::string SpaceOrDefault(const Config& config, const std::string& name, const ImageSpec& spec);
void RequireOneOf(const Config& config, const std::string& kind, const std::string& name,
                  const std::vector<std::string>& known);

// `action()`, with OpenColorIO's exceptions as one line about `subject`.
std::string OneLine(const std::string& text);
template <class F>
auto Guarded(const std::string& subject, const F& action) -> decltype(action()) {
  try {
    return action();
  } catch (const lib::Exception& e) {
    throw Error(subject, OneLine(e.what()));
  }
}

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
  bool temporary_ = false;
};

// A processor as nodes on top of `image`; `filter` serves its tables, null: each has its own.
Node Translate(const Node& image, const lib::ConstProcessorRcPtr& processor, const std::string& subject,
               const TableFilter* filter = nullptr);
// The part that has no nodes of its own.
Node ApplyCpuProcessor(const Node& image, const lib::ConstProcessorRcPtr& processor);

}  // namespace tessera::ocio

#endif  // TESSERA_OCIO_CONFIG_H_
