// Files of numbers, a line for each: what parts them, what is refused and what the message names.
#include "base/number_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "support/run_command.h"
#include "tessera/error.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class NumberLinesTest : public ::testing::Test {
 protected:
  // Lines of one to three numbers.
  std::vector<std::vector<double>> Read(const std::string& text) {
    std::ofstream(file_, std::ios::binary) << text;
    std::vector<std::vector<double>> lines;
    base::ReadNumberLines(file_, "lines of numbers", {"one to three numbers", 1, 3},
                          [&](std::span<const double> n, int) { lines.emplace_back(n.begin(), n.end()); });
    return lines;
  }
  std::string Refusal(const std::string& text) {
    try {
      Read(text);
    } catch (const Error& e) {
      return e.what();
    }
    return "nothing";
  }

 private:
  testing::TemporaryDirectory directory_;
  const std::string file_ = (directory_.path() / "numbers.txt").string();
};

TEST_F(NumberLinesTest, BlanksCommasRemarksAndMarks) {
  EXPECT_THAT(Read("\xEF\xBB\xBF# all of them\r\n1 2\t3\r\n\n  ,4,,-5e-1 # two\n+6\n.5 1e-40"),
              ElementsAre(ElementsAre(1, 2, 3), ElementsAre(4, -.5), ElementsAre(6), ElementsAre(.5, 1e-40)));
  EXPECT_THAT(Read(""), ElementsAre());
  EXPECT_THAT(Read("# nothing\n \t\r\n"), ElementsAre());
}

TEST_F(NumberLinesTest, WhatIsNoNumberOfAFloatIsRefused) {
  for (const char* const word :
       {"x", "1x", "1;2", "nan", "inf", "-inf", "1e39", "+-1", "--1", "+", "0x10", "1 2 y"}) {
    EXPECT_THAT(
        Refusal(std::string("1\n\n") + word + "\n"),
        ::testing::AllOf(HasSubstr("numbers.txt: line 3: found \""), HasSubstr("one to three numbers")))
        << word;
  }
}

TEST_F(NumberLinesTest, TooManyAndTooFewAreRefused) {
  EXPECT_THAT(Refusal("1\n1 2 3 4\n"),
              HasSubstr("line 2: found more than 3 numbers, expected one to three numbers"));
  EXPECT_THAT(Refusal(std::string(1000, 'z')), ::testing::SizeIs(::testing::Lt(300)));
}

}  // namespace
}  // namespace tessera
