// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backwash::report {

/// A self-contained HTML page around a body of h1, p.context, p.verdict (passed, failed), sections, tables and figures.
std::string html_page(const std::string& title, const std::string& body);
/// Text that may stand inside HTML.
std::string escaped(const std::string& text);

}  // namespace backwash::report
