// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "services/backwashd/daemon.hpp"

namespace backwash::daemon {
namespace {

TEST(Start, TheConfigurationThatShipsIsGoodAndAMissingOneIsNamed) {
  EXPECT_TRUE(load_settings("builtin:backwashd"));
  const auto missing = load_settings("/nowhere.toml");
  ASSERT_FALSE(missing);
  EXPECT_NE(std::string(missing.error().what()).find("/nowhere.toml"), std::string::npos);
  EXPECT_EQ(missing.error().code, 66);
}

}  // namespace
}  // namespace backwash::daemon
