// SPDX-License-Identifier: BSD-3-Clause
// What the study's page says of its own method, against the published tables.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "core/study/effects/table.hpp"
#include "core/study/findings/self_test.hpp"

namespace {

using namespace backwash::study;

TEST(SelfTest, HasEveryCauseOfTheCatalogueAndWhatIsNone) {
  std::map<std::string, const SelfTestRow*> rows = {{"unknown", self_test().of(backwash::study::Hidden::structure)},
                                                    {"none", self_test().of(backwash::study::Hidden::nothing)}};
  for (const auto& effect : effects()) rows[effect.name] = self_test().of(effect.name);
  EXPECT_EQ(self_test().rows.size(), rows.size());
  for (const auto& [name, r] : rows) {
    ASSERT_TRUE(r) << name;
    EXPECT_GE(r->worlds, 100) << name;
    EXPECT_LE(r->alone, r->in_set) << name;
    EXPECT_LE(r->in_set, r->worlds) << name;
    EXPECT_LE(r->wrong, r->worlds - r->alone) << name;
  }
  EXPECT_EQ(self_test().of("gremlins"), nullptr);
  EXPECT_EQ(self_test().of("none"), nullptr) << "a cause of that name";
}

TEST(SelfTest, AgreesWithTheConfusionTable) {
  std::ifstream file(BACKWASH_SOURCE_DIR "/docs/measurements/confusion.md");
  std::stringstream text;
  text << file.rdbuf();
  const std::string table = text.str();
  EXPECT_NE(table.find("--seed " + std::to_string(self_test().seed)), std::string::npos);
  for (const auto& r : self_test().rows) {
    const auto of = [&](int count) { return std::to_string(count) + "/" + std::to_string(r.worlds); };
    const std::string hidden = r.hidden == backwash::study::Hidden::nothing     ? "none"
                               : r.hidden == backwash::study::Hidden::structure ? "unknown"
                                                                                : r.cause;
    const auto begin = table.find("\n| " + hidden + " | " + of(r.alone) + " (");
    ASSERT_NE(begin, std::string::npos) << hidden;
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
