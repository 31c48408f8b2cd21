/// Whose turn it is when something fails. @file
#ifndef TESSERA_ERROR_KIND_H_
#define TESSERA_ERROR_KIND_H_

#include <cstdint>

#include "tessera/error.h"
#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// What programs turn into an exit code or a status.
enum class ErrorKind : uint8_t {
  kUsage,      ///< what was asked for is wrong, whatever the images and files are
  kData,       ///< it does not suit these images, or a file is missing or does not hold what it should
  kSystem,     ///< a file cannot be read or written, memory is refused
  kCancelled,  ///< the caller ended it
};

/// An Error of kind kData.
class DataError : public Error {
 public:
  using Error::Error;
};

/// An Error of kind kSystem.
class SystemError : public Error {
 public:
  using Error::Error;
};

/// The kind of an error: that of its class, and kUsage for a plain Error.
inline ErrorKind KindOf(const Error& error) {
  if (dynamic_cast<const DataError*>(&error) != nullptr) return ErrorKind::kData;
  if (dynamic_cast<const SystemError*>(&error) != nullptr) return ErrorKind::kSystem;
  if (dynamic_cast<const Cancelled*>(&error) != nullptr) return ErrorKind::kCancelled;
  return ErrorKind::kUsage;
}

/// The same failure about another subject.
[[noreturn]] inline void ThrowAbout(const std::string& subject, const Error& error) {
  switch (KindOf(error)) {
    case ErrorKind::kData:
      throw DataError(subject, error.reason());
    case ErrorKind::kSystem:
      throw SystemError(subject, error.reason());
    case ErrorKind::kCancelled:
      throw Cancelled();
    case ErrorKind::kUsage:
      break;
  }
  throw Error(subject, error.reason());
}

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_ERROR_KIND_H_
