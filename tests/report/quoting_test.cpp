// SPDX-License-Identifier: BSD-3-Clause
// Names that others chose, on their way into gnuplot and HTML: what they say is shown, and nothing of it is done.
#include <gtest/gtest.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "core/report/page/page.hpp"
#include "core/report/page/plot.hpp"

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

/// The lines that `gnuplot FILE` prints.
std::vector<std::string> printed(const std::filesystem::path& script) {
  FILE* pipe = ::popen(("gnuplot '" + script.string() + "' 2>&1").c_str(), "r");
  std::vector<std::string> lines(1);
  for (int c = 0; pipe && (c = ::fgetc(pipe)) != EOF;) {
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += static_cast<char>(c);
  }
  EXPECT_EQ(::pclose(pipe), 0);
  lines.pop_back();
  return lines;
}

TEST(Quoting, GnuplotShowsAnyNameAndDoesNothingOfIt) {
  const auto folder = std::filesystem::temp_directory_path() / ("backwash_quoting." + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const auto bait = folder / "bait", script = folder / "script.gp";
  const auto names = hostile_names(500, bait.string());
  {
    std::ofstream file(script);
    file << "set print '-'\n";
    for (const auto& name : names)
      file << "set title " << gnuplot_quoted(name) << "\nprint " << gnuplot_quoted(name) << '\n';
  }
  const auto lines = printed(script);
  ASSERT_EQ(lines.size(), names.size());
  for (std::size_t n = 0; n < names.size(); ++n) {
    std::string expected;
    for (const char c : names[n]) {
      if (c == '\'')
        expected += "’";
      else
        expected += (c >= 0 && c < ' ') || c == 127 ? '?' : c;
    }
    EXPECT_EQ(lines[n], expected);
  }
  EXPECT_FALSE(std::filesystem::exists(bait));
  std::filesystem::remove_all(folder);
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
