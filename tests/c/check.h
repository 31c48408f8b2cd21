// What the C interface's tests in C look with.
#ifndef TESSERA_TESTS_C_CHECK_H_
#define TESSERA_TESTS_C_CHECK_H_

#include <stdio.h>
#include <string.h>

#include "tessera/c.h"

static int failures = 0;
#define CHECK(condition)                                              \
  do {                                                                \
    if (!(condition)) {                                               \
      printf("%s:%d: expected %s\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                     \
    }                                                                 \
  } while (0)

/* The call succeeds. */
#define SUCCEEDS(call)                                                                       \
  do {                                                                                       \
    tessera_error* error = NULL;                                                             \
    if ((call) != TESSERA_OK || error != NULL) {                                             \
      printf("%s:%d: %s: %s: %s\n", __FILE__, __LINE__, #call, tessera_error_subject(error), \
             tessera_error_reason(error));                                                   \
      ++failures;                                                                            \
    }                                                                                        \
    tessera_error_free(error);                                                               \
  } while (0)

/* The call fails so, with an error that says the same and names `subject`. */
#define FAILS(expected, subject, call)                                                                   \
  do {                                                                                                   \
    tessera_error* error = NULL;                                                                         \
    const tessera_status got = (call);                                                                   \
    if (got != (expected) || tessera_error_status(error) != got ||                                       \
        strcmp(tessera_error_subject(error), subject) != 0 || strlen(tessera_error_reason(error)) < 5) { \
      printf("%s:%d: %s: status %d, \"%s\": \"%s\"\n", __FILE__, __LINE__, #call, (int)got,              \
             tessera_error_subject(error), tessera_error_reason(error));                                 \
      ++failures;                                                                                        \
    }                                                                                                    \
    tessera_error_free(error);                                                                           \
  } while (0)

#endif  // TESSERA_TESTS_C_CHECK_H_
