// SPDX-License-Identifier: BSD-3-Clause
// What the study's page says of its own method, against the published tables.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "core/study/effects/table.hpp"
#include "core/study/findings/self_test.hpp"

namespace {

using namespace backwash::study;

TEST(SelfTest, HasEveryCauseOfTheCatalogueAndWhatIsNone) {
  std::vector<std::string> names;
  for (const auto& effect : effects()) names.push_back(effect.name);
  names.insert(names.end(), {"unknown", "none"});
  EXPECT_EQ(self_test().rows.size(), names.size());
  for (const auto& name : names) {
    const auto* r = self_test().of(name);
    ASSERT_TRUE(r) << name;
    EXPECT_GE(r->worlds, 100) << name;
    EXPECT_LE(r->alone, r->in_set) << name;
    EXPECT_LE(r->in_set, r->worlds) << name;
    EXPECT_LE(r->wrong, r->worlds - r->alone) << name;
  }
  EXPECT_EQ(self_test().of("gremlins"), nullptr);
}

TEST(SelfTest, AgreesWithTheConfusionTable) {
  std::ifstream file(BACKWASH_SOURCE_DIR "/core/study/confusion.md");
  std::stringstream text;
  text << file.rdbuf();
  const std::string table = text.str();
  EXPECT_NE(table.find("--seed " + std::to_string(self_test().seed)), std::string::npos);
  for (const auto& r : self_test().rows) {
    const auto of = [&](int count) { return std::to_string(count) + "/" + std::to_string(r.worlds); };
    const auto begin = table.find("\n| " + std::string(r.hidden) + " | " + of(r.alone) + " (");
    ASSERT_NE(begin, std::string::npos) << r.hidden;
    const std::string line = table.substr(begin + 1, table.find('\n', begin + 1) - begin);
    EXPECT_NE(line.find("| " + of(r.in_set) + " ("), std::string::npos) << line;
    EXPECT_NE(line.find("| " + of(r.wrong) + " ("), std::string::npos) << line;
  }
}

TEST(SelfTest, ShowsTheCausesThatWereToldBeforeFoldingTheRest) {
  const std::string page = self_test_section({"wall_attraction"});
  const std::string open = page.substr(0, page.find("<details>"));
  EXPECT_NE(open.find("wall attraction hidden"), std::string::npos);
  EXPECT_NE(open.find("Nothing hidden"), std::string::npos);
  EXPECT_EQ(open.find("ceiling hidden"), std::string::npos);
  EXPECT_NE(page.find("ceiling hidden"), std::string::npos);
}

}  // namespace
