// The same for tests of files and of the command line, which read what was written by OpenImageIO's own
// means; loading its headers takes the others a second each.
#ifndef TESSERA_TESTS_SUPPORT_FILE_HEADERS_H_
#define TESSERA_TESTS_SUPPORT_FILE_HEADERS_H_

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include "headers.h"

#endif  // TESSERA_TESTS_SUPPORT_FILE_HEADERS_H_
