// The module tessera._core, and errors on their way to Python.
#include <new>
#include <system_error>

#include "python/core.h"
#include "tessera/error_kind.h"
#include "tessera/version.h"

namespace tessera::python {
namespace {

const char* NameOf(ErrorKind kind) {
  constexpr const char* kNames[] = {"usage", "data", "system", "cancelled"};
  return kNames[static_cast<int>(kind)];
}

// tessera.errors makes the exception: which class, and what of the reason is a hint.
void Raise(const char* kind, const std::string& subject, const std::string& reason) {
  try {
    const py::object error =
        py::module_::import("tessera.errors").attr("error_of")(kind, py::str(subject), py::str(reason));
    PyErr_SetObject(py::type::of(error).ptr(), error.ptr());
  } catch (py::error_already_set& e) {
    e.restore();
  }
}

}  // namespace

void AddErrors(py::module_& core) {
  core.attr("version") = TESSERA_VERSION_STRING;
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Error& e) {
      Raise(NameOf(KindOf(e)), e.subject(), e.reason());
    } catch (const std::bad_alloc&) {
      Raise("system", "memory", "refused");
    } catch (const std::system_error& e) {
      Raise("system", "system", e.what());
    }
  });
}

}  // namespace tessera::python

PYBIND11_MODULE(_core, core) {
  using namespace tessera::python;  // NOLINT: all that this file is for
  AddErrors(core);
  AddRows(core);
  AddImages(core);
  AddParts(core);
  AddRowSources(core);
  AddEvaluation(core);
}
