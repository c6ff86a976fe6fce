// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bench/playing.hpp"

namespace backwash::autopilots {
namespace {
TEST(Smoke, Plays) {
  played(Kind::ardupilot, "ardupilot-flight");
  played(Kind::px4, "px4-flight");
}
}  // namespace
}  // namespace backwash::autopilots
