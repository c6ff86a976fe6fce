// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/backwash/campaign_plan.hpp"
#include "services/backwash/spec_table.hpp"

namespace backwash::services {

using Words = std::vector<std::string>;

inline constexpr double kLeastShard = 60;  ///< s of estimated work: a task of Slurm costs 0.4 to 1 s of its own
inline constexpr double kDay = 86'400;     ///< s

/// Throws Failure 65 for a name that no manifest can hold: it is JSON, whose texts are UTF-8.
void check_name(const std::string& name);
void append(Words& words, const Words& more);
/// A verb of this program as an item: one thread, no progress.
CampaignItem verb_item(const Words& words, double seconds);

/// The plan while it is made: each file is hashed once.
class Draft {
 public:
  explicit Draft(CampaignPlan& plan) : plan_(plan) {}
  /// Notes that an item reads a file; nothing for what is built in.
  void read(CampaignItem& item, const std::string& path);
  void add(CampaignItem item);

 private:
  CampaignPlan& plan_;
  std::map<std::string, std::size_t> number_;
};

/// The kinds whose inputs are flight logs (docs/interfaces.md, "Campaign specification").
void plan_study(const SpecTable& spec, CampaignPlan& plan, Draft& draft);
void plan_calibrate(const SpecTable& spec, CampaignPlan& plan, Draft& draft);
void plan_adapt(const SpecTable& spec, CampaignPlan& plan, Draft& draft);

}  // namespace backwash::services
