// What the precompiled headers are compiled with.
#include "headers.h"  // IWYU pragma: keep
