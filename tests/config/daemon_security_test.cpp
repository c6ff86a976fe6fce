// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/daemon_config.hpp"
#include "tests/config/file_texts.hpp"

namespace backwash::config {
namespace {

/// The shipped file with these lines before its [link].
tl::expected<Daemon, ConfigError> with_lines(const std::string& lines) {
  std::string text = config::shipped("backwashd.daemon.toml");
  text.insert(text.find("[link]"), lines);
  return load_daemon(TemporaryFile(text).path);
}

TEST(DaemonFile, CredentialsMayBeLeftOutOrHaveAFolder) {
  EXPECT_EQ(with_lines("").value().dds.security, "");
  EXPECT_EQ(with_lines("security = \"/etc/backwash/security\"\n").value().dds.security, "/etc/backwash/security");
  for (const std::string bad : {"\"\"", "true", "7", "\"/etc\\u001b[2J\""}) {
    const auto refused = with_lines("security = " + bad + "\n");
    ASSERT_FALSE(refused) << bad;
    EXPECT_THAT(refused.error().message, testing::HasSubstr(".toml:14: key 'dds.security' = ")) << bad;
  }
}

}  // namespace
}  // namespace backwash::config
