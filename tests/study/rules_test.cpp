// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rules.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "core/study/design/design_rules.hpp"

namespace backwash::study {
namespace {

TEST(Rules, EachHasANameOfItsOwnAUnitAndAReasonOfAKnownKind) {
  std::set<std::string_view> names;
  auto all = rules();
  for (const Rule& r : design_rules()) all.push_back(r);
  for (const Rule& r : all) {
    EXPECT_TRUE(names.insert(r.name).second) << r.name << " twice";
    EXPECT_FALSE(r.unit.empty()) << r.name;
    const std::string_view kind = r.reason.substr(0, r.reason.find(':'));
    EXPECT_TRUE(kind == "derived" || kind == "measured" || kind == "chosen") << r.name << ": " << r.reason;
    EXPECT_GT(r.reason.size(), kind.size() + 10) << r.name << " says no reason";
  }
  EXPECT_TRUE(names.contains("flips") && names.contains("manoeuvre_nats")) << "first and last of the struct";
  EXPECT_TRUE(names.contains("design_flight_time") && names.contains("design_wall_distance")) << "and of the design";
  EXPECT_TRUE(names.contains("window_length") && names.contains("same_time")) << "and of the windows";
}

/// Numbers of formulas: halves of ½ xᵀAx, roots of the turned axes, the contrasts of four rotors.
const std::set<std::string> kOfFormulas = {"0.0", "0.25", "0.5", "1.0", "2.0", "3.0", "6.0"};

class NoConstant : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(OfARoom, NoConstant, testing::Values("inference", "windows"));

TEST_P(NoConstant, StandsOutsideTheRoomsRules) {
  const std::regex number("(^|[^A-Za-z_0-9.])([0-9]+\\.[0-9]+(e-?[0-9]+)?|[0-9]+e-?[0-9]+)");
  const std::regex constant("constexpr (double|int) k\\w+ = [-0-9]");
  std::size_t files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(BACKWASH_SOURCE_DIR "/core/study/" + std::string(GetParam()))) {
    if (entry.path().extension() != ".cpp") continue;
    ++files;
    std::ifstream file(entry.path());
    for (std::string line; std::getline(file, line);) {
      line = line.substr(0, line.find("//"));
      EXPECT_FALSE(std::regex_search(line, constant)) << entry.path().filename() << ": " << line;
      for (std::sregex_iterator at(line.begin(), line.end(), number), end; at != end; ++at)
        EXPECT_TRUE(kOfFormulas.contains((*at)[2])) << entry.path().filename() << ": " << line;
    }
  }
  EXPECT_GE(files, 8u);
}

}  // namespace
}  // namespace backwash::study
