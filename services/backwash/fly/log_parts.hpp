// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace backwash::services {

/// A raw log and its later parts, as the daemon named them beside it (docs/interfaces.md, "Raw log"): NAME.mcap,
/// NAME-2.mcap … Several files are what they are: nothing is added to them.
std::vector<std::string> with_later_parts(const std::vector<std::string>& logs);

}  // namespace backwash::services
