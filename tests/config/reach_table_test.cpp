// SPDX-License-Identifier: BSD-3-Clause
// What the daemon's file says of the clearance that is kept.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "core/config/daemon_config.hpp"

namespace backwash::config {
namespace {

TEST(ReachTable, TheWorstCaseIsKeptUnlessARiskIsStatedWithItsMethod) {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/backwashd.daemon.toml");
  const std::string text{std::istreambuf_iterator<char>(in), {}}, line = "method = \"tight\"";
  const auto at = text.find(line);
  ASSERT_NE(at, text.npos);
  const auto with = [&](const std::string& lines) {
    const std::string path = testing::TempDir() + "reach_table." + std::to_string(::getpid()) + ".toml";
    std::string changed = text;
    std::ofstream(path) << changed.replace(at, line.size(), lines);
    auto read = load_daemon(path);
    std::filesystem::remove(path);
    return read;
  };
  EXPECT_FALSE(load_daemon("builtin:backwashd").value().risk);
  EXPECT_FALSE(with("").value().risk);
  EXPECT_EQ(with("method = \"risk\"\nrisk = 0.002").value().risk, 0.002);
  for (const auto& [lines, named] : {std::pair{"method = \"risk\"", "reach.risk too"},
                                     {"risk = 0.01", "reach.method = \"risk\""},
                                     {"method = \"tight\"\nrisk = 0.01", "reach.method = \"risk\""},
                                     {"method = \"paper\"", "'reach.method'"},
                                     {"method = 1", "'reach.method'"},
                                     {"method = \"risk\"\nrisk = 0.6", "'reach.risk'"},
                                     {"method = \"risk\"\nrisk = 0", "'reach.risk'"},
                                     {"method = \"risk\"\nrisk = nan", "'reach.risk'"},
                                     {"metod = \"risk\"", "'reach.metod'"}}) {
    const auto read = with(lines);
    ASSERT_FALSE(read) << lines;
    EXPECT_THAT(read.error().message, testing::HasSubstr(named)) << lines;
  }
}

}  // namespace
}  // namespace backwash::config
