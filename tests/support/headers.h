// The headers that tests have in common, compiled once: none of the project's own, or a line in one of them
// would have every test compiled again. Tests include what they use all the same.
#ifndef TESSERA_TESTS_SUPPORT_HEADERS_H_
#define TESSERA_TESTS_SUPPORT_HEADERS_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#endif  // TESSERA_TESTS_SUPPORT_HEADERS_H_
