// What is behind the handles of tessera/c.h, and the wall that no exception passes.
#ifndef TESSERA_C_HANDLES_H_
#define TESSERA_C_HANDLES_H_

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "ops/registry.h"
#include "tessera/c.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/node.h"
#include "tessera/prepared_graph.h"

namespace tessera::c {

// The first word of every handle, so that one of another kind, or a freed one, is recognised.
enum class Tag : uint32_t { kFreed = 0, kImage = 0x7e55e241, kParameters, kError, kContext, kPrepared };

template <Tag kTag>
struct Tagged {
  volatile Tag tag = kTag;  // volatile: cleared for whoever looks after the end
  ~Tagged() { tag = Tag::kFreed; }
};

// The caller's pixels, given back by whoever uses them last.
struct Borrowed {
  void (*release)(void* user) = nullptr;
  void* user = nullptr;
  Borrowed() = default;
  Borrowed(const Borrowed&) = delete;  // they would be given back twice
  Borrowed& operator=(const Borrowed&) = delete;
  ~Borrowed() {
    if (release != nullptr) release(user);
  }
};

}  // namespace tessera::c

struct tessera_image : tessera::c::Tagged<tessera::c::Tag::kImage> {
  tessera::Node node;
  std::vector<std::shared_ptr<tessera::c::Borrowed>> borrowed;  // everywhere in the graph below
};

struct tessera_parameters : tessera::c::Tagged<tessera::c::Tag::kParameters> {
  const tessera::ops::OpInfo* op = nullptr;
  std::map<std::string, std::string> values;  // as text, checked
};

// Prepared graphs in it keep it.
struct tessera_context : tessera::c::Tagged<tessera::c::Tag::kContext> {
  std::shared_ptr<tessera::Context> context;
};

struct tessera_prepared : tessera::c::Tagged<tessera::c::Tag::kPrepared> {
  std::vector<std::shared_ptr<tessera::c::Borrowed>> borrowed;
  std::shared_ptr<tessera::Context> context;  // null: the default one
  std::unique_ptr<const tessera::PreparedGraph> graph;
};

struct tessera_error : tessera::c::Tagged<tessera::c::Tag::kError> {
  tessera_status status = TESSERA_INTERNAL;
  std::string subject, reason;
};

namespace tessera::c {

// The call itself is wrong.
class Misuse : public Error {
 public:
  using Error::Error;
};

// Whatever is being thrown, as a status and, where `error` is not null, as a value.
tessera_status Caught(tessera_error** error) noexcept;

// `action()` with its exceptions as values.
template <class F>
tessera_status Guarded(tessera_error** error, const F& action) noexcept {
  if (error != nullptr) *error = nullptr;
  try {
    action();
    return TESSERA_OK;
  } catch (...) {
    return Caught(error);
  }
}

// The handle, or Misuse.
template <class Handle>
Handle& Checked(Handle* handle, const char* name) {
  if (handle == nullptr) throw Misuse(name, "found NULL, expected a handle");
  if (handle->tag != std::remove_const_t<Handle>().tag) {
    throw Misuse(name, "found something else or what was freed, expected a handle of this kind");
  }
  return *handle;
}

// Where a result goes: set to null first.
template <class T>
T& Result(T* result, const char* name) {
  if (result == nullptr) throw Misuse(name, "found NULL, expected where the result goes");
  *result = T();
  return *result;
}

std::string Text(const char* text, const char* name);  // Misuse for null

inline void CheckSize(size_t size, const char* name) {
  constexpr size_t kLargest = 4096;
  if (size < sizeof(size_t) || size > kLargest)
    throw Misuse(name, "found a struct_size of " + std::to_string(size) + ", expected its sizeof");
}

// A caller's structure as this version knows it: members beyond its size are 0. Null: all of them are.
template <class T>
T Taken(const T* given, const char* name) {
  T taken = {};
  if (given == nullptr) return taken;
  CheckSize(given->struct_size, name);
  std::memcpy(static_cast<void*>(&taken), given, std::min(given->struct_size, sizeof(T)));
  return taken;
}

// Into a caller's structure, as much of it as there is.
template <class T>
void Fill(T* to, T from, const char* name) {
  if (to == nullptr) throw Misuse(name, "found NULL, expected a structure to fill");
  const size_t size = to->struct_size;
  CheckSize(size, name);
  from.struct_size = size;
  std::memcpy(static_cast<void*>(to), &from, std::min(size, sizeof(T)));
}

// Checks window, channels, type, strides and alignment; null strides are filled in.
ConstImageView ViewOf(const tessera_pixels* pixels, const char* name);
Roi RoiOf(const tessera_window& window, const char* name);
PixelType TypeOf(tessera_type type, const char* name);
tessera_type TypeOf(PixelType type);

// A handle for a node that is made from these.
tessera_image* NewImage(Node node, const tessera_image* const* from, size_t count);

// A tessera_operation is a row.
const ops::OpInfo& RowOf(const tessera_operation* operation);
const ops::OpInfo& RowNamed(const std::string& name);
ops::Arguments ArgumentsOf(const tessera_parameters& parameters);

}  // namespace tessera::c

#endif  // TESSERA_C_HANDLES_H_
