// NumPy's array files as a format of OpenImageIO: what it has no reader and writer for itself.
#ifndef TESSERA_IO_NPY_H_
#define TESSERA_IO_NPY_H_

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::io {

// Makes "npy" a format like those that OpenImageIO brings, for readers, writers and lists; before any of
// these is asked for. Again it does nothing.
void DeclareNumPy();

}  // namespace tessera::io
TESSERA_API_END

#endif  // TESSERA_IO_NPY_H_
