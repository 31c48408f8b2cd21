// What a context keeps: how much, for whom, and until when.
#include "tessera/context.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/file_names.h"
#include "base/pool.h"
#include "tessera/error.h"

namespace tessera {
namespace {

std::shared_ptr<const int> Number(Context& context, const std::string& key, size_t bytes, int value,
                                  int* made = nullptr) {
  return context.Cached<int>(key, bytes, [&] {
    if (made != nullptr) ++*made;
    return std::make_shared<int>(value);
  });
}

// What each thread frees the others look at; under sanitizers that was seen.
TEST(FileNamesTest, ThreadsRememberAndForgetTheirOwn) {
  base::FileNames names;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&names, t] {
      for (int i = 0; i < 2000; ++i) {
        const std::string first = std::to_string(t) + "/" + std::to_string(i), second = first + "+";
        names.Remember(first), names.Remember(second);
        names.Forget(first);
        if (i % 1000 != 0) names.Forget(second);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::vector<std::string> left;
  names.TakeEach([&](const char* name) { left.emplace_back(name); });
  EXPECT_THAT(left, ::testing::UnorderedElementsAre("0/0+", "0/1000+", "1/0+", "1/1000+", "2/0+", "2/1000+",
                                                    "3/0+", "3/1000+"));
}

TEST(ContextTest, AThingIsMadeOnceForItsKeyAndItsType) {
  Context context;
  int made = 0;
  EXPECT_EQ(*Number(context, "a", 10, 1, &made), 1);
  EXPECT_EQ(*Number(context, "a", 10, 2, &made), 1);
  EXPECT_EQ(*Number(context, "b", 10, 3, &made), 3);
  EXPECT_EQ(made, 2);
  const auto other = context.Cached<std::string>("a", 10, [] { return std::make_shared<std::string>("a"); });
  EXPECT_EQ(*other, "a");
  EXPECT_EQ(context.Use().entries, 3u);
  EXPECT_EQ(context.Use().cache, 30u);
}

TEST(ContextTest, WhatWasAskedForLongestAgoGoesFirst) {
  Context context({.memory = 0, .cache = 30});
  for (const char* key : {"a", "b", "c"}) Number(context, key, 10, 1);
  Number(context, "a", 10, 1);
  const auto held = Number(context, "b", 10, 7);
  Number(context, "d", 10, 1);  // in place of c
  int made = 0;
  for (const char* key : {"a", "b", "d"}) Number(context, key, 10, 1, &made);
  EXPECT_EQ(made, 0);
  Number(context, "c", 10, 1, &made);
  EXPECT_EQ(made, 1);
  EXPECT_LE(context.Use().cache, 30u);
  Number(context, "large", 31, 1, &made);
  Number(context, "large", 31, 1, &made);
  EXPECT_EQ(made, 3) << "larger than all that may be kept";
  context.Limit({.memory = 0, .cache = 10});
  EXPECT_EQ(context.Use().entries, 1u);
  context.Release();
  EXPECT_EQ(context.Use().entries, 0u);
  EXPECT_EQ(*held, 1) << "somebody holds it";
}

TEST(ContextTest, WhatCannotBeMadeIsNotKept) {
  Context context;
  EXPECT_THROW(context.Cached<int>("a", 1, []() -> std::shared_ptr<int> { throw Error("a", "bad"); }), Error);
  EXPECT_EQ(*Number(context, "a", 1, 4), 4);
}

TEST(ContextTest, ThreadsGetTheSame) {
  Context context;
  std::vector<std::shared_ptr<const int>> got(8);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < got.size(); ++i)
    threads.emplace_back([&, i] { got[i] = Number(context, "a", 1, static_cast<int>(i)); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& g : got) EXPECT_EQ(g, got[0]);
}

TEST(ContextTest, ContextsShareNothingAndMemoryOutlivesThem) {
  constexpr size_t kBytes = size_t{64} << 20;
  std::optional<Context> one(std::in_place), other(std::in_place);
  std::shared_ptr<std::byte> memory = one->pool().Allocate(kBytes);
  memory.reset();
#ifndef __SANITIZE_ADDRESS__
  EXPECT_GE(one->Use().memory, kBytes);
#endif
  EXPECT_EQ(other->Use().memory, 0u);
  memory = one->pool().Allocate(kBytes);
  EXPECT_EQ(one->Use().memory, 0u);
  one.reset();
  memory.get()[kBytes - 1] = std::byte{1};
}

// Bands, arenas and small pictures go round too, in an eighth of the memory.
TEST(ContextTest, SmallMemoryIsKeptInASmallPart) {
  constexpr size_t kBytes = size_t{1} << 19, kMost = size_t{16} << 20;
  Context context({.memory = kMost, .cache = 0});
  const std::byte* const first = context.pool().Allocate(kBytes).get();
  const size_t kept = context.Use().memory;
  if (kept == 0) GTEST_SKIP() << "nothing is kept under a sanitizer";
  EXPECT_GE(kept, kBytes);
  {
    const auto again = context.pool().Allocate(kBytes);
    EXPECT_EQ(again.get(), first);
    EXPECT_EQ(context.Use().memory, 0u);
    EXPECT_NE(context.pool().Allocate(kBytes / 2).get(), nullptr);
  }
  context.pool().Allocate(1000);
  EXPECT_GE(context.Use().memory, kBytes * 3 / 2);
  std::vector<std::shared_ptr<std::byte>> many;
  for (int k = 0; k < 16; ++k) many.push_back(context.pool().Allocate(kBytes));
  many.clear();
  EXPECT_LE(context.Use().memory, kMost / 8);
  EXPECT_GE(context.Use().memory, kMost / 16);
  context.Release();
  EXPECT_EQ(context.Use().memory, 0u);
}

TEST(ContextTest, NamesOfUnfinishedFilesAreTakenOnce) {
  base::FileNames names;
  names.Remember("a"), names.Remember("b"), names.Remember("c");
  names.Forget("b");
  std::vector<std::string> taken;
  const auto take = [&](const char* name) { taken.emplace_back(name); };
  names.TakeEach(take);
  names.TakeEach(take);
  EXPECT_THAT(taken, ::testing::UnorderedElementsAre("a", "c"));
  EXPECT_NE(names.Next(), names.Next());
}

int kept_signal = 0;

TEST(ContextTest, ASignalThatComesInAStepIsKeptUntilTheLastEnds) {
  base::FileNames names;
  names.OnKept([](int signal) { kept_signal = signal; });
  std::optional<base::FileNames::Step> one(std::in_place, names), other(std::in_place, names);
  EXPECT_FALSE(names.MayEnd(15));
  EXPECT_FALSE(names.MayEnd(2)) << "the first is kept";
  one.reset();
  EXPECT_EQ(kept_signal, 0);
  other.reset();
  EXPECT_EQ(kept_signal, 15);
  kept_signal = 0;
  one.emplace(names), one.reset();
  EXPECT_EQ(kept_signal, 0) << "once";
  EXPECT_TRUE(names.MayEnd(15));
  EXPECT_FALSE(names.MayEnd(15)) << "one alone ends the process";
}

TEST(ContextDeathTest, NoStepBeginsOnceTheProcessEnds) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // libraries have threads
  const auto end = [] {
    static base::FileNames names;
    static std::atomic<bool> begun = false;
    if (!names.MayEnd(15)) ::_exit(1);
    std::thread([] {
      const base::FileNames::Step step(names);
      begun = true;
    }).detach();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ::_exit(begun ? 2 : 3);
  };
  EXPECT_EXIT(end(), ::testing::ExitedWithCode(3), "");
}

}  // namespace
}  // namespace tessera
