// Whether a sanitizer of memory or threads is in: several times slower, and its shadow is resident.
#ifndef TESSERA_TESTS_SUPPORT_SANITIZED_H_
#define TESSERA_TESTS_SUPPORT_SANITIZED_H_

namespace tessera::testing {

#ifdef __SANITIZE_THREAD__
inline constexpr bool kThreadSanitized = true;
#else
inline constexpr bool kThreadSanitized = false;
#endif
#ifdef __SANITIZE_ADDRESS__
inline constexpr bool kAddressSanitized = true;
#else
inline constexpr bool kAddressSanitized = false;
#endif
inline constexpr bool kSanitized = kThreadSanitized || kAddressSanitized;

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_SANITIZED_H_
