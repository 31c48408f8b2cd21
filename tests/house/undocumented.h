// A declaration that nobody documented: the check of the public headers has to find it.
#ifndef TESSERA_TESTS_HOUSE_UNDOCUMENTED_H_
#define TESSERA_TESTS_HOUSE_UNDOCUMENTED_H_

/// Documented, as the rule wants it.
namespace planted {

int Planted();

}  // namespace planted

#endif  // TESSERA_TESTS_HOUSE_UNDOCUMENTED_H_
