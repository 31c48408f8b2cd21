// What XMP (ISO 16684-1) costs its reader: OpenImageIO 2.4.7 calls itself for every level of elements, joins
// a list anew for every item and looks through all names for every value.
#ifndef TESSERA_IO_XMP_BUDGET_H_
#define TESSERA_IO_XMP_BUDGET_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>

namespace tessera::io {

// The packets of one image. What is left out by the reader, Photoshop's ancestors of a document and what
// lists hold beyond 64 KiB, costs nothing here either, so that pictures of long histories pass.
class XmpBudget {
 public:
  static constexpr size_t kMostLevels = 256, kMostNames = 4096;
  static constexpr int64_t kMostBytes = int64_t{1} << 28;

  // Takes another packet; why it is refused, empty where it is not: "found elements in more than 256 levels".
  std::string Take(std::string_view packet);

 private:
  class Scan;
  struct Hash {
    using is_transparent = void;
    size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
  };
  std::unordered_map<std::string, int64_t, Hash, std::equal_to<>> held_;  // bytes by name
  int64_t joined_ = 0;  // bytes, of every value and what its name held before
};

}  // namespace tessera::io

#endif  // TESSERA_IO_XMP_BUDGET_H_
