// SPDX-License-Identifier: BSD-3-Clause
// Only where clang's RealtimeSanitizer is built in (tests/nightly/realtime.sh rtsan).
#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <vector>

#include "tests/daemon/lockstep/traps.hpp"

namespace backwash::test {
namespace {

/// What a tick that breaks its promise would do, in the scope that the rig puts around each tick.
template <typename Act>
void in_a_tick(Act act) {
  const Watched watched;
  act();
}

// That the run below it can fail: each of these is reported and ends the program.
TEST(RealtimeSanitizerDeathTest, EndsTheRunAtWhatATickMustNotDo) {
  static std::mutex mutex;
  static void* volatile sink;
  EXPECT_DEATH(in_a_tick([] { sink = std::malloc(8); }), "unsafe function .malloc.");
  EXPECT_DEATH(in_a_tick([] { sink = new std::vector<int>(9); }), "unsafe function .(malloc|_Znwm|operator new)");
  EXPECT_DEATH(in_a_tick([] { const std::lock_guard lock(mutex); }), "unsafe function .pthread_mutex_lock.");
  EXPECT_DEATH(in_a_tick([] { ::usleep(1); }), "unsafe function .usleep.");
  EXPECT_DEATH(in_a_tick([] { std::puts("x"); }), "unsafe function .puts.");
  char byte = 0;
  EXPECT_DEATH(in_a_tick([&] { (void)!::read(0, &byte, 1); }), "unsafe function .read.");
}

TEST(RealtimeSanitizer, AllowsTheSameOutsideOfATick) {
  in_a_tick([] {});
  void* volatile block = std::malloc(8);
  std::free(block);
}

struct Count : testing::Environment {
  void TearDown() override { std::printf("RealtimeSanitizer: %ld scopes watched\n", watched_scopes()); }
};
[[maybe_unused]] const auto* const count = testing::AddGlobalTestEnvironment(new Count);

}  // namespace
}  // namespace backwash::test

#endif
#endif
