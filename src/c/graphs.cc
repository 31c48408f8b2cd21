// Graphs as JSON through the C interface.
#include <cstdlib>
#include <cstring>
#include <map>
#include <new>

#include "c/handles.h"
#include "tessera/graph_json.h"

namespace tessera::c {
namespace {

char* CopyOf(const std::string& text) {
  auto* const copy = static_cast<char*>(std::malloc(text.size() + 1));
  if (copy == nullptr) throw std::bad_alloc();
  std::memcpy(copy, text.c_str(), text.size() + 1);
  return copy;
}

}  // namespace
}  // namespace tessera::c

using namespace tessera::c;  // NOLINT: all that this file is for

extern "C" {

tessera_status tessera_image_as_input(const tessera_image* image, const char* name, tessera_image** input,
                                      tessera_error** error) {
  return Guarded(error, [&] {
    tessera_image*& result = Result(input, "input");
    const tessera_image& from = Checked(image, "image");
    result = NewImage(tessera::AsInput(from.node, Text(name, "name")), &image, 1);
  });
}

tessera_status tessera_graph_to_json(const tessera_image* image, char** text, tessera_error** error) {
  return Guarded(error, [&] {
    char*& result = Result(text, "text");
    result = CopyOf(tessera::ToJson(Checked(image, "image").node).text);
  });
}

void tessera_text_free(char* text) { std::free(text); }

tessera_status tessera_graph_input(const char* json, size_t index, char** name, tessera_error** error) {
  return Guarded(error, [&] {
    char*& result = Result(name, "name");
    const std::vector<std::string> names = tessera::GraphInputs(Text(json, "json"));
    if (index < names.size()) result = CopyOf(names[index]);
  });
}

tessera_status tessera_graph_from_json(const char* json, const char* const* names,
                                       const tessera_image* const* images, size_t count,
                                       tessera_image** image, tessera_error** error) {
  return Guarded(error, [&] {
    tessera_image*& result = Result(image, "image");
    if (count > 0 && names == nullptr) throw Misuse("names", "found NULL, expected names of open inputs");
    if (count > 0 && images == nullptr) throw Misuse("images", "found NULL, expected images");
    std::map<std::string, tessera::Node> inputs;
    for (size_t k = 0; k < count; ++k) {
      const std::string name = Text(names[k], "names");
      if (!inputs.emplace(name, Checked(images[k], "images").node).second)
        throw Misuse(name, "found twice, expected one image for it");
    }
    result = NewImage(tessera::FromJson(Text(json, "json"), inputs), images, count);
  });
}

}  // extern "C"
