// SPDX-License-Identifier: BSD-3-Clause
// dds.tf of the daemon's configuration: which transforms it sends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/daemon_config.hpp"
#include "tests/config/file_texts.hpp"

namespace backwash::config {
namespace {

/// The shipped file with these texts replaced.
tl::expected<Daemon, ConfigError> changed(std::initializer_list<std::pair<std::string_view, std::string>> texts) {
  std::string text = config::shipped("backwashd.daemon.toml");
  for (const auto& [from, to] : texts) {
    EXPECT_NE(text.find(from), text.npos) << from;
    text.replace(text.find(from), from.size(), to);
  }
  return load_daemon(TemporaryFile(text).path);
}

TEST(DaemonTransforms, AreSentWhereTheyAreAskedForAndNobodyElseSendsThem) {
  EXPECT_EQ(load_daemon("builtin:backwashd")->dds.tf, Transforms::none);
  const std::pair<std::string, Transforms> all[] = {
      {"none", Transforms::none}, {"map", Transforms::map}, {"vehicle", Transforms::vehicle}};
  for (const auto& [text, tf] : all) {
    const std::pair<std::string_view, std::string> asked{"domain = 0", "domain = 0\ntf = \"" + text + "\""};
    const auto read = changed({asked});
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->dds.tf, tf);
    const auto heard = changed({asked, {"profile = \"ros\"", "profile = \"custom\"\nmessage = \"tf\""}});
    EXPECT_EQ(heard.has_value(), tf == Transforms::none) << text;
    if (heard) continue;
    EXPECT_THAT(heard.error().message, testing::HasSubstr("with odometry.message = \"tf\" others send them"));
  }
  const auto other = changed({{"domain = 0", "domain = 0\ntf = \"odom\""}});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, testing::AllOf(testing::HasSubstr("'dds.tf'"), testing::HasSubstr("\"vehicle\"")));
}

}  // namespace
}  // namespace backwash::config
