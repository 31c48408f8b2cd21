// What the writer and the reader of graphs agree on.
#ifndef TESSERA_JSON_FORMAT_H_
#define TESSERA_JSON_FORMAT_H_

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

namespace tessera::json {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr size_t kMostBytes = size_t{64} << 20;
constexpr size_t kMostNodes = size_t{1} << 16;
constexpr size_t kLongestName = 256;

}  // namespace tessera::json

#endif  // TESSERA_JSON_FORMAT_H_
