// SPDX-License-Identifier: BSD-3-Clause
// Names that others chose, on their way into HTML: what they say is shown, and nothing of it is done.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "core/report/page/page.hpp"

namespace backwash::report {
namespace {

/// Made of what ends strings, runs commands and opens tags, in any order.
std::vector<std::string> hostile_names(std::size_t count, const std::string& bait) {
  const std::vector<std::string> parts = {
      "'",  "\"", "`",    "\\", "\n", "\r", ";",        "$(touch " + bait + ")",
      "''", "#",  "{/",   "}",  "|",  "<",  "</title>", "`touch " + bait + "`",
      "%",  "&",  "\x7f", "ä",  "@",  "!",  "<script>", "system('touch " + bait + "')",
      " ",  "\t", "a.bt"};
  std::mt19937 random(20261122);
  std::vector<std::string> names = {"", "'", "x'; system('touch " + bait + "'); set title 'x", "!touch " + bait};
  while (names.size() < count) {
    std::string name;
    for (std::size_t n = random() % 9; n > 0; --n) name += parts[random() % parts.size()];
    names.push_back(name);
  }
  return names;
}

TEST(Quoting, HtmlHoldsAnyNameAsText) {
  for (const auto& name : hostile_names(500, "/bait")) {
    std::string text = escaped(name);
    EXPECT_EQ(text.find_first_of("<>\""), text.npos) << name;
    const std::vector<std::pair<std::string, std::string>> references = {
        {"&lt;", "<"},
        {"&gt;", ">"},
        {"&quot;", "\""},
        {"&amp;", "&"}};  // the ampersand last: it may begin none of them
    for (const auto& [reference, character] : references)
      for (auto at = text.find(reference); at != text.npos; at = text.find(reference, at + 1))
        text.replace(at, reference.size(), character);
    EXPECT_EQ(text, name);
  }
}

}  // namespace
}  // namespace backwash::report
