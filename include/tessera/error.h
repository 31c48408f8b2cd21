/// The one exception type of the library. @file
#ifndef TESSERA_ERROR_H_
#define TESSERA_ERROR_H_

#include <stdexcept>
#include <string>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// Thrown when a node is built from bad parameters, a file cannot be opened, read or written, memory is
/// refused, or an evaluation is cancelled; never from inside a kernel. what() is "SUBJECT: REASON", where the
/// subject is the file or the argument and the reason names what was found and what was expected.
class Error : public std::runtime_error {
 public:
  /// What() is both with ": " between.
  Error(const std::string& subject, const std::string& reason)
      : std::runtime_error(subject + ": " + reason), subject_(subject), reason_(reason) {}

  /// The file or argument.
  const std::string& subject() const { return subject_; }
  /// What was found, and what was expected.
  const std::string& reason() const { return reason_; }

 private:
  std::string subject_, reason_;
};

/// Thrown by an evaluation whose progress callback returned false.
class Cancelled : public Error {
 public:
  Cancelled() : Error("evaluation", "cancelled") {}
};

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_ERROR_H_
