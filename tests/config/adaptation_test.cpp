// SPDX-License-Identifier: BSD-3-Clause
// What the daemon's file says of the air in flight, and what a model file says of its correlation time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "core/config/daemon_config.hpp"

namespace backwash::config {
namespace {

using testing::HasSubstr;

std::string shipped_text(const std::string& file) {
  std::ifstream in(std::string(BACKWASH_SOURCE_DIR) + "/core/config/files/" + file);
  return {std::istreambuf_iterator<char>(in), {}};
}
template <typename Load>
auto read_as_file(const std::string& text, const Load& load) {
  const std::string path = testing::TempDir() + "adaptation." + std::to_string(::getpid()) + ".toml";
  std::ofstream(path) << text;
  auto read = load(path);
  std::filesystem::remove(path);
  return read;
}

TEST(AdaptationTable, NothingIsLearntOfTheAirUnlessItIsAskedFor) {
  const auto plain = load_daemon("builtin:backwashd").value();
  EXPECT_FALSE(plain.adaptation.enabled);
  EXPECT_EQ(plain.adaptation.alpha, 0.01);
  EXPECT_TRUE(plain.adaptation.file.empty());
  std::string text = shipped_text("backwashd.daemon.toml");
  const auto at = text.find("enabled = false");
  ASSERT_NE(at, text.npos);
  const auto with = [&](const std::string& lines) {
    std::string changed = text;
    return read_as_file(changed.replace(at, std::string("enabled = false").size(), lines), load_daemon);
  };
  const auto on = with("enabled = true\nalpha = 0.05\nfile = \"/tmp/air\"");
  ASSERT_TRUE(on) << on.error().message;
  EXPECT_TRUE(on->adaptation.enabled);
  EXPECT_EQ(on->adaptation.alpha, 0.05);
  EXPECT_EQ(on->adaptation.file, "/tmp/air");
  EXPECT_EQ(plain.adaptation.calmest, 1) << "no set shrinks";
  EXPECT_EQ(with("enabled = true\ncalmest = 0.4")->adaptation.calmest, 0.4);
  for (const auto& [lines, named] : {std::pair{"enabled = 1", "adaptation.enabled"},
                                     {"calmest = 0.05", "adaptation.calmest"},
                                     {"calmest = 1.5", "adaptation.calmest"},
                                     {"calmest = nan", "adaptation.calmest"},
                                     {"alpha = 0.2", "adaptation.alpha"},
                                     {"alpha = 0", "adaptation.alpha"},
                                     {"alpha = nan", "adaptation.alpha"},
                                     {"file = \"\"", "adaptation.file"},
                                     {"calmer = true", "adaptation.calmer"}}) {
    const auto read = with(lines);
    ASSERT_FALSE(read) << lines;
    EXPECT_THAT(read.error().message, HasSubstr(named));
  }
}

TEST(TauInterval, IsWhatCalibrationWroteElseTheModelsOwnTime) {
  const auto of = [](const std::string& lines) {
    return read_as_file(shipped_text("quad-5in.model.toml") + lines, load_tau_interval);
  };
  EXPECT_EQ(load_tau_interval("builtin:quad-5in").value(), (std::array{0.15, 0.15}));
  EXPECT_EQ(of("").value(), (std::array{0.15, 0.15}));
  EXPECT_EQ(of("\n[confidence]\n\"bound.tau_w\" = [0.14, 0.2]\n").value(), (std::array{0.14, 0.2}));
  EXPECT_EQ(of("\n[confidence]\n\"bound.kappa\" = [1, 2]\n").value(), (std::array{0.15, 0.15}));
  for (const char* bad : {"[0.2, 0.14]", "[0, 0.1]", "[0.1]", "[0.1, nan]", "[0.1, inf]", "[0.1, \"x\"]", "[]"}) {
    const auto read = of("\n[confidence]\n\"bound.tau_w\" = " + std::string(bad) + "\n");
    ASSERT_FALSE(read) << bad;
    EXPECT_THAT(read.error().message, testing::AllOf(HasSubstr("adaptation."), HasSubstr("bound.tau_w")));
  }
  EXPECT_FALSE(load_tau_interval("/nowhere"));
}

}  // namespace
}  // namespace backwash::config
