// What the precompiled headers are compiled with.
#include "file_headers.h"  // IWYU pragma: keep
