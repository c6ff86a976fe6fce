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

}  // namespace backwash::report
