// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backwash::services {

/// Writes a file that nobody but its owner can read at any time (mode 0600). One that is there is replaced, whole, with
/// `force` alone. Throws Failure 73 or 74.
void write_private(const std::string& path, const std::string& content, bool force);

}  // namespace backwash::services
