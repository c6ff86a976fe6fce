// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace backwash::report {

/// What core/report/page holds: the style of every page, and the script of those that can be looked at by cursor.
extern const char* const kStyle;
extern const char* const kScript;

}  // namespace backwash::report
