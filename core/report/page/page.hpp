// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backwash::report {

/// A self-contained HTML page around a body of h1, p.context, p.verdict (passed, failed), sections, tables and figures:
/// the one template of every page. Light and dark, 360 to 2,000 px wide, for print and keyboard. Each table and each
/// SVG gets the name of the heading above it, and scrolls by itself where it is too wide. `scripts` stand behind the
/// body.
std::string html_page(const std::string& title, const std::string& body, const std::string& scripts = "");
/// Text that may stand inside HTML.
std::string escaped(const std::string& text);
/// A row of a table: its name and its values, each as text.
template <class... Text>
std::string row(const std::string& name, const Text&... values) {
  return "<tr><th>" + escaped(name) + "</th>" + (("<td>" + escaped(values) + "</td>") + ... + "</tr>\n");
}
/// The first row of a table of several columns: their names.
template <class... Text>
std::string heads(const Text&... names) {
  return "<thead><tr>" + (("<th>" + escaped(names) + "</th>") + ... + "</tr></thead>\n");
}
/// A table of such rows; `wide`: of many columns.
std::string table(const std::string& rows, bool wide = false);
/// A part of a page. Its title is text, words and content are HTML; no words, no paragraph.
std::string section(const std::string& title, const std::string& words, const std::string& content);

}  // namespace backwash::report
