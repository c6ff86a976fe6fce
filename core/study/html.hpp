// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backwash::study {

/// Text for HTML: < > & " escaped.
std::string escaped(const std::string& text);

/// Beginning of a self-contained page, up to and with its heading; classes of its style: context, verdict with passed
/// or failed, section, table. Nothing in it refers to another file or host.
std::string page_begin(const std::string& title, const std::string& heading);
std::string page_end();

}  // namespace backwash::study
