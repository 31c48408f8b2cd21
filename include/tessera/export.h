/// What the shared libraries export. Readable by C too. @file
#ifndef TESSERA_EXPORT_H_
#define TESSERA_EXPORT_H_

/// Everything that is not named here is hidden in the shared libraries. A function of C carries TESSERA_API;
/// a header of C++ has TESSERA_API_BEGIN and TESSERA_API_END around its namespace, once, so that nothing that
/// is declared in it can be forgotten. Static libraries carry the marks too, to no effect.
#if defined(__GNUC__)
#define TESSERA_API __attribute__((visibility("default")))
#define TESSERA_API_BEGIN _Pragma("GCC visibility push(default)")
#define TESSERA_API_END _Pragma("GCC visibility pop")
#else
#define TESSERA_API
#define TESSERA_API_BEGIN  ///< before the namespace
#define TESSERA_API_END    ///< behind it
#endif

#endif  // TESSERA_EXPORT_H_
