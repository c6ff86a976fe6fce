// SPDX-License-Identifier: BSD-3-Clause
// The template of every page, what its scripts are given, and what they are copied from.
#include "core/report/page/page.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "core/report/page/interactive.hpp"
#include "core/report/page/page_data.hpp"
#include "core/report/page/timeline.hpp"

namespace backwash::report {
namespace {

namespace fs = std::filesystem;

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++found;
  return found;
}

PageData data_with_a_plot() {
  PageData data;
  data.tables.push_back({"height", {"t_s", "z_m"}, {{0, 1.25}, {1, kNoValue}, {2, 0.1 + 0.2}}, 0});
  data.plots.push_back({"height", "height", "height", "m", {{"z_m", "flown", Kind::flown}}});
  return data;
}

TEST(Page, NamesEachTableAndFigureByTheHeadingAboveIt) {
  const auto page = html_page("t",
                              "<h1>A</h1><section><h2>First &lt;b&gt;</h2><table><tr><th>a</th><td>1</td></tr></table>"
                              "</section><h2>Second</h2><svg viewBox=\"0 0 1 1\"><title>x</title><table></svg>"
                              "<table class=\"wide\"><thead><tr><th></th><th>c</th></tr></thead></table>");
  EXPECT_EQ(count(page, "<caption>First &lt;b&gt;</caption>"), 1u);
  EXPECT_EQ(count(page, "<caption>Second</caption>"), 1u);
  EXPECT_EQ(count(page, "<svg role=\"img\" aria-label=\"Second\" viewBox=\"0 0 1 1\"><title>x</title><table></svg>"),
            1u);
  EXPECT_EQ(count(page, "<th scope=\"row\">a</th>"), 1u);
  EXPECT_EQ(count(page, "<tr><td></td><th scope=\"col\">c</th></tr>"), 1u);
  EXPECT_EQ(count(page, "<div"), count(page, "</div>"));
  for (const char* owed : {"name=\"viewport\"", "prefers-color-scheme: dark", "@media print", "class=\"skip\"",
                           "default-src 'none'", ":focus-visible", "lang=\"en\""})
    EXPECT_NE(page.find(owed), page.npos) << owed;
}

TEST(ScriptQuoted, GivesBackAnyTextAndEndsNoScript) {
  const std::vector<std::string> parts = {"</script>", "<!--", "<script>", "\"", "\\",     "\n",
                                          "'",         "]]>",  "&",        "ä",  "\u2028", "x"};
  std::mt19937 random(20261125);
  for (int n = 0; n < 500; ++n) {
    std::string text;
    for (std::size_t k = random() % 9; k > 0; --k) text += parts[random() % parts.size()];
    const auto quoted = script_quoted(text);
    EXPECT_EQ(quoted.find('<'), quoted.npos) << quoted;
    EXPECT_EQ(nlohmann::json::parse(quoted).get<std::string>(), text);
  }
  EXPECT_EQ(nlohmann::json::parse(script_quoted("a\xff")).get<std::string>(), "a\ufffd") << "no UTF-8";
}

TEST(PageData, IsJsonWithNineDigitsAndNullForNothing) {
  auto data = data_with_a_plot();
  data.modes.push_back({0, 2, "hold", "</script>"});
  data.scene = Scene{"height",
                     {{{1, 2, 3}, {0.1, 0.2, 0.3, 9, 9}}},
                     MapFaces{{0, 0, 0}, 0.1, 12, 0, 0, {{5, 7, {1, 2}, {3, 4}}}},
                     0.2};
  const auto json = nlohmann::json::parse(to_json(data));
  EXPECT_EQ(json["tables"][0]["rows"][0][1], 1.25);
  EXPECT_TRUE(json["tables"][0]["rows"][1][1].is_null());
  EXPECT_EQ(json["tables"][0]["rows"][2][1], 0.3) << "nine digits";
  EXPECT_EQ(json["modes"][0][3], "</script>");
  EXPECT_EQ(json["scene"]["map"]["faces"], nlohmann::json({5, 7, 1, 2, 3, 4}));
  EXPECT_EQ(json["scene"]["tube"][0][2].size(), 8u) << "four corners where the diagonals do not bind";
}

TEST(Thinned, KeepsEachPeakAndEachRowAsItWas) {
  std::mt19937 random(4);
  std::normal_distribution<double> draw;
  DataTable whole{"a", {"t_s", "x", "y"}, {}, 0};
  for (int n = 0; n < 20000; ++n) whole.rows.push_back({0.02 * n, draw(random), n % 1000 == 7 ? 50.0 + n : kNoValue});
  whole.rows[12345][1] = -99;
  const auto few = thinned(whole, 1000);
  EXPECT_EQ(few.before, 20000u);
  EXPECT_LE(few.rows.size(), 1100u);
  EXPECT_GE(few.rows.size(), 500u);
  std::size_t at = 0, peaks = 0;
  double least = 0, greatest = 0;
  for (const auto& row : few.rows) {
    while (at < whole.rows.size() && whole.rows[at][0] != row[0]) ++at;
    ASSERT_LT(at, whole.rows.size()) << "a row that was not there, or out of order";
    EXPECT_EQ(whole.rows[at][1], row[1]);
    peaks += row[2] > 0;
    least = std::min(least, row[1]);
    greatest = std::max(greatest, row[1]);
  }
  EXPECT_EQ(least, -99);
  EXPECT_EQ(greatest,
            (*std::max_element(whole.rows.begin(), whole.rows.end(), [](auto& a, auto& b) { return a[1] < b[1]; }))[1]);
  EXPECT_EQ(peaks, 20u) << "what is there in few rows stays";
  EXPECT_EQ(thinned(few, 5000).rows.size(), few.rows.size());
}

TEST(Interactive, SaysWhatToInstallWhereTheLibraryIsMissing) {
  auto data = data_with_a_plot();
  EXPECT_EQ(interactive(data, {}).notes.find("libjs-three"), std::string::npos) << "nothing on the page needs it";
  data.scene = Scene{"height", {}, {}, 0.2};
  EXPECT_NE(interactive(data, {"/nonexistent"}).notes.find("install Debian's libjs-three"), std::string::npos);
}

TEST(Interactive, CopiesTheLibraryInWithItsLicenceAndNothingInItEndsTheScript) {
  const auto folder = fs::temp_directory_path() / ("backwash_libraries." + std::to_string(::getpid()));
  fs::create_directories(folder / "three");
  std::ofstream(folder / "three/three.min.js") << "var a = '</script>', b = /</.test('<');";
  auto data = data_with_a_plot();
  data.scene = Scene{"height", {}, {}, 0.2};
  const auto page = interactive(data, {"/nonexistent", folder});
  fs::remove_all(folder);
  EXPECT_NE(page.scripts.find("var a = '<\\/script>', b = /</.test('<');"), std::string::npos);
  EXPECT_EQ(count(page.scripts, "<script"), count(page.scripts, "</script"));
  EXPECT_NE(page.scripts.find("MIT licence"), std::string::npos);
  EXPECT_NE(page.notes.find("Permission is hereby granted"), std::string::npos);
  EXPECT_EQ(page.notes.find("install"), std::string::npos);
}

TEST(Plotted, IsOneChartAPlotWithItsTableOnceAndABandBetweenBounds) {
  PageData data;
  const DataTable table{"error", {"t_s", "e_m", "h_m"}, {{0, 0.1, 0.2}, {1, kNoValue, 0.3}, {2, 0.2, 0.2}}, 0};
  const TimePlot plot{"a", "error", "error", "m", {{"e_m", "e", Kind::flown}, {"h_m", "h", Kind::bound, true}}};
  auto other = plot;
  other.id = "b";
  const auto html = plotted(data, table, {plot, other});
  EXPECT_EQ(count(html, "<svg"), 2u);
  EXPECT_EQ(count(html, "data-plot=\"a\""), 1u);
  EXPECT_EQ(count(html, "class=\"band\""), 2u);
  EXPECT_EQ(data.tables.size(), 1u);
  EXPECT_EQ(data.plots.size(), 2u);
  const auto line = html.substr(html.find("<path class=\"flown\"", html.find("class=\"area\"")), 400);
  EXPECT_EQ(count(line.substr(0, line.find("/>")), "M"), 2u) << "a gap is none that a line crosses: " << line;
}

TEST(Timeline, ShowsWhatOthersChoseAsText) {
  const Timeline timeline{{{0, 10, "hold", "<img src=x onerror=alert(1)>"}}, {{5, "command", "asked to \"><script>"}}};
  const auto html = timeline_html(timeline);
  EXPECT_EQ(html.find("<script"), html.npos);
  EXPECT_EQ(html.find("<img"), html.npos);
  EXPECT_NE(html.find("left:50.000%"), html.npos);
  EXPECT_NE(html.find("<td data-time=\"5.00\">5.00</td>"), html.npos);
}

}  // namespace
}  // namespace backwash::report
