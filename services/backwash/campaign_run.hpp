// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "services/backwash/campaign_plan.hpp"

namespace backwash::services {

/// Does shard `shard` of the campaign in `folder`, one command after another; one that is whole is left as it is.
/// Whether there was something to do. Throws Failure: an input that changed, a command that fails, a shard that another
/// process does.
bool run_shard(const std::string& folder, const CampaignPlan& plan, std::size_t shard);

/// Does every shard that is missing, `jobs` processes at a time, and shows how far it is and how long it takes yet.
/// What another process does meanwhile is left to it. Ctrl-C ends those at work; what is done stays. Throws Failure:
/// 130 then, or what the first shard failed with once all others were tried.
void run_missing(const std::string& folder, const CampaignPlan& plan, std::size_t jobs);

/// Puts the rows together in their order, into `rows.jsonl`, and runs the campaign's last command over them, into
/// `result`. Files of the same bytes stay; others are replaced with `force` alone. Returns the number of rows. Throws
/// Failure 65 that names what is missing, doubled, foreign, cut short or changed.
std::size_t merge_shards(const std::string& folder, const CampaignPlan& plan, bool force);

}  // namespace backwash::services
