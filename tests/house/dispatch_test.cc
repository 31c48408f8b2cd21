// Where kernels of this CPU are asked for: once, when a stage is made, never per tile or row. Fails on a
// dispatch in a function that is not named as one that makes or hands out kernels.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

namespace tessera::house {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kDispatch = "HWY_DYNAMIC_DISPATCH";

bool IsName(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// The text with comments, directives and what stands in quotes blanked, line by line where it was.
std::string Code(const std::string& text) {
  std::string code = text;
  enum { kCode, kLine, kBlock, kString, kCharacter } state = kCode;
  for (size_t i = 0; i < code.size(); ++i) {
    const char c = code[i], next = i + 1 < code.size() ? code[i + 1] : '\0';
    if (state == kCode) {
      const bool digits = c == '\'' && i > 0 && IsName(code[i - 1]);
      if (c == '/' && next == '/') state = kLine;
      if (c == '/' && next == '*') state = kBlock;
      if (c == '#') state = kLine;
      if (c == '"') state = kString;
      if (c == '\'' && !digits) state = kCharacter;
      if (state != kCode) code[i] = ' ';
      continue;
    }
    if (state == kLine && c == '\n') {
      if (i > 0 && text[i - 1] != '\\') state = kCode;
      continue;
    }
    const bool ends = (state == kBlock && c == '/' && text[i - 1] == '*') || (state == kString && c == '"') ||
                      (state == kCharacter && c == '\'');
    if ((state == kString || state == kCharacter) && c == '\\' && next != '\n') code[i++] = ' ';
    if (ends) state = kCode;
    if (code[i] != '\n') code[i] = ' ';
  }
  return code;
}

// The function that a block begins, from what stands before its brace; empty for a block inside of one; "-"
// where it holds declarations.
std::string FunctionOf(const std::string& header) {
  std::string first;
  for (const char c : header) {
    if (IsName(c)) {
      first += c;
    } else if (!first.empty()) {
      break;
    }
  }
  for (const std::string word : {"namespace", "class", "struct", "enum", "union", "extern"}) {
    if (first == word) return "-";
  }
  for (const std::string word :
       {"if", "else", "for", "while", "switch", "do", "try", "catch", "return", "case"}) {
    if (first == word) return "";
  }
  size_t end = header.find('(');
  if (end == std::string::npos) return header.find("struct") == std::string::npos ? "" : "-";
  while (end > 0 && !IsName(header[end - 1])) --end;
  size_t begin = end;
  while (begin > 0 && IsName(header[begin - 1])) --begin;
  return header.substr(begin, end - begin);
}

bool HandsOutKernels(const std::string& function) {
  return function.starts_with("Make") || function.starts_with("Choose") || function.starts_with("Find") ||
         function.ends_with("Functions");
}

// What breaks the rule in a file, one line each, as PATH:LINE: WHAT.
std::vector<std::string> Offences(const std::string& path, const std::string& text) {
  const std::string code = Code(text);
  std::vector<std::string> blocks, offences;
  int line = 1;
  size_t header = 0;
  for (size_t i = 0; i < code.size(); ++i) {
    const char c = code[i];
    if (c == '\n') ++line;
    if (c == '{') blocks.push_back(FunctionOf(code.substr(header, i - header)));
    if (c == '}' && !blocks.empty()) blocks.pop_back();
    if (c == '{' || c == '}' || c == ';') header = i + 1;
    if (code.compare(i, kDispatch.size(), kDispatch) != 0 || (i > 0 && IsName(code[i - 1]))) continue;
    const auto offence = [&](const std::string& what) {
      offences.push_back(path + ":" + std::to_string(line) + ": " + what);
    };
    const auto named = std::find_if(blocks.rbegin(), blocks.rend(), [](const auto& b) { return !b.empty(); });
    if (named == blocks.rend() || *named == "-") {
      offence("dispatches outside of a function");
    } else if (!HandsOutKernels(*named)) {
      offence("dispatches in " + *named + "(), expected Make..., Choose..., Find... or ...Functions");
    }
    // Before the first dispatch of a program an address is that of a function that dispatches on every call.
    const size_t close = code.find(')', i);
    const size_t after = close == std::string::npos ? close : code.find_first_not_of(" \n", close + 1);
    if (after == std::string::npos || code[after] != '(') offence("takes the address of a dispatch");
  }
  return offences;
}

std::string Read(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(DispatchTest, KernelsAreChosenWhenStagesAreMade) {
  const fs::path root = TESSERA_SOURCE_DIR;
  std::vector<std::string> offences;
  int found = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root / "src")) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".h" && extension != ".cc") continue;
    const std::string text = Read(entry.path());
    found += text.find(kDispatch) != std::string::npos ? 1 : 0;
    for (std::string& o : Offences(fs::relative(entry.path(), root).generic_string(), text)) {
      offences.push_back(std::move(o));
    }
  }
  EXPECT_GT(found, 50) << "the tree was not found";
  EXPECT_THAT(offences, IsEmpty());
}

TEST(DispatchTest, WhatHandsOutKernelsMayDispatch) {
  const char* const text = R"text(
namespace ops {
std::unique_ptr<Stage> MakeAdd(const Plan& p) {
  if (p.fast) return HWY_DYNAMIC_DISPATCH(Fast)(p);
  for (int i = 0; i < 3; ++i) { HWY_DYNAMIC_DISPATCH(Slow)(p); }
  return HWY_DYNAMIC_DISPATCH(NewAdd)(p);
}
Kernel ChooseSum() { return HWY_DYNAMIC_DISPATCH(SumOfTarget)(); }
static Kernel FindSum(int n) { return HWY_DYNAMIC_DISPATCH(SumOfTarget)(n); }
PixelFunctions CurrentPixelFunctions() { return HWY_DYNAMIC_DISPATCH(Functions)(); }
class Op : public Base {
  std::unique_ptr<Stage> MakePointStage(const Context&) const override { return HWY_DYNAMIC_DISPATCH(New)(p_); }
};
}  // HWY_DYNAMIC_DISPATCH(InAComment)(x)
const char* const kNotCode = "HWY_DYNAMIC_DISPATCH(InAString)(x)";
)text";
  EXPECT_THAT(Offences("a.cc", text), IsEmpty());
}

TEST(DispatchTest, OffendersAreNamedWithTheirLines) {
  EXPECT_THAT(Offences("a.cc", "void Run(const Tile& t) {\n  HWY_DYNAMIC_DISPATCH(Sum)(t);\n}\n"),
              ElementsAre(HasSubstr("a.cc:2: dispatches in Run()")));
  EXPECT_THAT(Offences("a.cc",
                       "void Sum::Rows(int n) const {\n  for (int y = 0; y < n; ++y) {\n"
                       "    if (y > 2) {\n      HWY_DYNAMIC_DISPATCH(Sum)(y);\n    }\n  }\n}\n"),
              ElementsAre(HasSubstr("a.cc:4: dispatches in Rows()")));
  EXPECT_THAT(Offences("a.cc", "void Slide(const Block& b) { HWY_DYNAMIC_DISPATCH(SlideFloats)(b); }"),
              ElementsAre(HasSubstr("a.cc:1: dispatches in Slide()")));
  EXPECT_THAT(Offences("a.cc", "auto MakeIt() {\n  return HWY_DYNAMIC_DISPATCH(Sum);\n}\n"),
              ElementsAre(HasSubstr("a.cc:2: takes the address")));
  EXPECT_THAT(Offences("a.cc", "class S : public T {\n  S() : run_(&HWY_DYNAMIC_DISPATCH(Sum)) {}\n};\n"),
              ElementsAre(HasSubstr("outside of a function"), HasSubstr("takes the address")));
  EXPECT_THAT(Offences("a.cc", "namespace a {\nconst auto kSum = HWY_DYNAMIC_DISPATCH(Sum)();\n}\n"),
              ElementsAre(HasSubstr("a.cc:2: dispatches outside of a function")));
}

}  // namespace
}  // namespace tessera::house
