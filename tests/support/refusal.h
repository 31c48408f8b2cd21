// What a refused call says.
#ifndef TESSERA_TESTS_SUPPORT_REFUSAL_H_
#define TESSERA_TESTS_SUPPORT_REFUSAL_H_

#include <string>

#include "tessera/error.h"

namespace tessera {

// The message of the Error that `build` throws; "accepted" when it throws none.
template <class F>
std::string Refusal(F build) {
  try {
    build();
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace tessera

#endif  // TESSERA_TESTS_SUPPORT_REFUSAL_H_
