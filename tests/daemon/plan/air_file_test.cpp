// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/plan/air_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "core/config/file_hash.hpp"
#include "services/backwashd/channels.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::daemon {
namespace {

const AirFactors kLearnt{1, 1.1892071150027211, 2.0, 1, 1};
constexpr std::uint64_t kFiles = 0x0123456789abcdef;

class AirFileTest : public testing::Test {
 protected:
  std::string folder_ = testing::TempDir() + "backwash_air." + std::to_string(::getpid());
  std::string path_ = folder_ + "/air.factors";
  AirFileTest() { std::filesystem::create_directory(folder_); }
  ~AirFileTest() override { std::filesystem::remove_all(folder_); }
  std::string text() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& text) const { std::ofstream(path_, std::ios::binary) << text; }
  /// What a start that is refused says.
  std::pair<int, std::string> refused(std::uint64_t files) const {
    try {
      AirFile file(path_, files);
    } catch (const StartError& e) {
      return {e.code, e.what()};
    }
    return {0, ""};
  }
};

TEST_F(AirFileTest, WhatWasLearntIsThereAfterARestartBitForBit) {
  {
    const AirFile file(path_, kFiles);
    EXPECT_EQ(file.start(), kModelledAir);
    EXPECT_TRUE(file.keep(kLearnt));
  }
  EXPECT_EQ(AirFile(path_, kFiles).start(), kLearnt);
  EXPECT_EQ(AirFile(path_, kFiles).start(), kLearnt) << "a start in which nothing is learnt forgets nothing";
}

TEST_F(AirFileTest, OneOfAnotherVehicleOrModelIsRefusedByNameAndStaysAsItIs) {
  ASSERT_TRUE(AirFile(path_, kFiles).keep(kLearnt));
  const std::string before = text();
  const auto [code, what] = refused(kFiles + 1);
  EXPECT_EQ(code, kConfiguration);
  EXPECT_EQ(what.find(path_), 0u) << what;
  EXPECT_NE(what.find("0123456789abcdef"), std::string::npos) << what;
  EXPECT_EQ(text(), before);
}

// Every byte of it, every length, and factors that no flight learns.
TEST_F(AirFileTest, OneThatIsDamagedIsNamedMovedAsideAndBegunAnew) {
  ASSERT_TRUE(AirFile(path_, kFiles).keep(kLearnt));
  const std::string good = text();
  std::vector<std::string> damaged{"", "another file of somebody\n", good + "\n", std::string(10000, '1')};
  for (std::size_t n = 0; n < good.size(); ++n) {
    damaged.push_back(good.substr(0, n));
    damaged.push_back(good);
    damaged.back()[n] ^= 1;
  }
  for (const std::string& bad : damaged) {
    write(bad);
    EXPECT_EQ(AirFile(path_, kFiles).start(), kModelledAir) << bad;
    std::ifstream aside(path_ + ".damaged", std::ios::binary);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(aside), {}), bad);
  }
}

TEST_F(AirFileTest, WhatIsNoFileOrCannotBeWrittenStopsTheStart) {
  std::filesystem::create_directory(path_);
  EXPECT_EQ(refused(kFiles).first, kConfiguration);
  path_ = folder_ + "/nowhere/air.factors";
  EXPECT_EQ(refused(kFiles).first, kCannotCreate);
  EXPECT_EQ(refused(kFiles).second.find(path_), 0u);
  path_ = folder_ + "/link";
  std::filesystem::create_symlink("/dev/null", path_);
  EXPECT_EQ(refused(kFiles).first, kConfiguration);
}

TEST_F(AirFileTest, TheThreadKeepsTheNewestFactorsAndThoseOfTheEnd) {
  const AirFile file(path_, kFiles);
  auto channels = std::make_unique<Channels>();
  channels->air_kept.write(kLearnt);
  std::atomic<bool> end{true};
  run_air_file(file, *channels, end);
  EXPECT_EQ(AirFile(path_, kFiles).start(), kLearnt);
}

TEST(HashOfFiles, DiffersByVehicleAndByModel) {
  const auto hash = [](const char* vehicle, const char* model) {
    return config::hash_of_files(vehicle, model).value();
  };
  const auto five = hash("builtin:quad-5in", "builtin:quad-5in");
  EXPECT_EQ(five, hash("builtin:quad-5in", "builtin:quad-5in"));
  EXPECT_NE(five, hash("builtin:quad-7in", "builtin:quad-5in"));
  EXPECT_NE(five, hash("builtin:quad-5in", "builtin:quad-7in"));
  EXPECT_FALSE(config::hash_of_files("builtin:quad-5in", "/nowhere"));
}

}  // namespace
}  // namespace backwash::daemon
