// The compiled half of the Python package: images, evaluation, the registry as data. What a user sees of it
// is made in tessera/*.py.
#ifndef TESSERA_PYTHON_CORE_H_
#define TESSERA_PYTHON_CORE_H_

#include <pybind11/pybind11.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/render.h"

namespace tessera::python {

namespace py = pybind11;

// What a Python image is.
struct Held {
  Node node;
};

using Values = std::vector<std::pair<std::string, std::string>>;

// "uint8", "uint16", "half", "float".
PixelType TypeNamed(const std::string& name);

// Somebody's pixels in rows: h x w x c samples with byte strides, as Python's buffers and arrays have them.
struct Samples {
  uintptr_t address = 0;
  std::vector<int64_t> shape, strides;
  std::string type;
};
ImageView ViewOf(const Samples& samples, int x0, int y0);

py::tuple TupleOf(const Roi& r);

// Throws Error for another number of names than channels.
void NameChannels(const std::vector<std::string>& channels, ImageSpec& spec);

// Keeps a Python object; whoever lets go last may be any thread.
std::shared_ptr<const void> Kept(py::object object);

// Runs `work` without the interpreter's lock. Python's signals and its progress function are looked after all
// the while, by whoever called: an exception of theirs cancels the work and is thrown. `options` holds
// members of RenderOptions by name.
void Evaluate(const py::dict& options, const std::function<void(const RenderOptions&)>& work);

void AddErrors(py::module_& core);
void AddRows(py::module_& core);
void AddImages(py::module_& core);
void AddParts(py::module_& core);
void AddRowSources(py::module_& core);
void AddEvaluation(py::module_& core);

}  // namespace tessera::python

#endif  // TESSERA_PYTHON_CORE_H_
