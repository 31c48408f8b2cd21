// Errors of the C interface: exceptions become values here.
#include <filesystem>
#include <system_error>
#include <utility>

#include "c/handles.h"
#include "tessera/error_kind.h"
#include "tessera/version.h"

namespace tessera::c {
namespace {

// Handed out where there is no memory for another; never freed.
tessera_error& OutOfMemory() {
  static tessera_error error;
  return error;
}
// Made while there is memory.
const bool kReady = [] {
  OutOfMemory().status = TESSERA_SYSTEM;
  OutOfMemory().subject = "memory", OutOfMemory().reason = "refused";
  return true;
}();

tessera_status Leave(tessera_status status, const std::string& subject, const std::string& reason,
                     tessera_error** error) noexcept {
  if (error == nullptr) return status;
  try {
    auto made = std::make_unique<tessera_error>();
    made->status = status, made->subject = subject, made->reason = reason;
    *error = made.release();
  } catch (...) {
    *error = kReady ? &OutOfMemory() : nullptr;
  }
  return status;
}

tessera_status StatusOf(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
      return TESSERA_USAGE;
    case ErrorKind::kData:
      return TESSERA_DATA;
    case ErrorKind::kSystem:
      return TESSERA_SYSTEM;
    case ErrorKind::kCancelled:
      return TESSERA_CANCELLED;
  }
  return TESSERA_INTERNAL;
}

}  // namespace

tessera_status Caught(tessera_error** error) noexcept {
  try {
    throw;
  } catch (const Error& e) {
    return Leave(StatusOf(KindOf(e)), e.subject(), e.reason(), error);
  } catch (const std::bad_alloc&) {
    return Leave(TESSERA_SYSTEM, "memory", "refused", error);
  } catch (const std::system_error& e) {
    return Leave(TESSERA_SYSTEM, "system", e.what(), error);
  } catch (const std::exception& e) {
    return Leave(TESSERA_INTERNAL, "tessera", e.what(), error);
  } catch (...) {
    return Leave(TESSERA_INTERNAL, "tessera", "an exception of an unknown kind", error);
  }
}

std::string Text(const char* text, const char* name) {
  if (text == nullptr) throw Misuse(name, "found NULL, expected text");
  return text;
}

}  // namespace tessera::c

using tessera::c::Tag;

extern "C" {

uint32_t tessera_c_version(void) { return TESSERA_C_VERSION; }
const char* tessera_version(void) { return TESSERA_VERSION_STRING; }

tessera_status tessera_error_status(const tessera_error* error) {
  if (error == nullptr) return TESSERA_OK;
  return error->tag == Tag::kError ? error->status : TESSERA_USAGE;
}
const char* tessera_error_subject(const tessera_error* error) {
  return error == nullptr || error->tag != Tag::kError ? "" : error->subject.c_str();
}
const char* tessera_error_reason(const tessera_error* error) {
  return error == nullptr || error->tag != Tag::kError ? "" : error->reason.c_str();
}
void tessera_error_free(tessera_error* error) {
  if (error == nullptr || error->tag != Tag::kError || error == &tessera::c::OutOfMemory()) return;
  delete error;
}

}  // extern "C"
