// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "services/backwash/campaign_plan.hpp"

namespace backwash::services {

/// Plans what the specification asks for (docs/interfaces.md, "Campaign specification"): items in the order of the
/// rows, the hash of every file that they read, shards. Paths in it are from the folder in which the program runs.
/// Throws Failure: 66 for a file that is not there, 78 with file and line for a key that is not right.
CampaignPlan read_campaign_spec(const std::string& path);

}  // namespace backwash::services
