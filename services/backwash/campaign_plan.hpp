// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "services/backwash/json.hpp"

namespace backwash::services {

/// A file that a campaign reads, and what it held when the campaign was planned.
struct CampaignInput {
  std::string path;    ///< as in the commands: from the plan's folder
  std::string sha256;  ///< 64 hexadecimal digits
};

/// One command of a campaign. What it prints on standard output is lines of JSON: the campaign's rows.
struct CampaignItem {
  std::vector<std::string> command;  ///< a first word `backwash` is this program
  std::vector<std::size_t> inputs;   ///< numbers of the files that it reads
  double seconds;                    ///< estimated, of one processor
};

/// Work in shards that can be done anywhere in any order (docs/interfaces.md, "backwash campaign").
struct CampaignPlan {
  std::string version;  ///< of the program that planned it and that runs it
  std::string kind;     ///< as the specification names it
  std::string folder;   ///< absolute: where every command runs, so that paths mean what they meant
  std::vector<CampaignInput> inputs;
  std::vector<CampaignItem> items;  ///< in the order of the rows
  std::vector<std::size_t> shards;  ///< number of each shard's first item, rising
  std::vector<std::string> last;    ///< command over all rows after the merge; `{rows}` is their file; may be empty
  std::string sha256 = {};          ///< of the manifest's text: shards carry it
  std::size_t end(std::size_t shard) const { return shard + 1 < shards.size() ? shards[shard + 1] : items.size(); }
  double seconds(std::size_t shard) const;  ///< estimated, of one processor
};

/// Cuts items into shards of `least_s` or more each, as even as whole items and their order allow, and at most 1000:
/// Slurm's arrays end at 1001. Few shards are an even number where two processors end sooner so. One shard where all is
/// less than two.
std::vector<std::size_t> shards_of(const std::vector<CampaignItem>& items, double least_s);

/// The manifest: the same text for the same plan.
std::string manifest_text(const CampaignPlan& plan);
/// Path of the manifest of the campaign in `folder`.
std::string manifest_path(const std::string& folder);
/// Reads the campaign in `folder`. Throws Failure: 66 where there is none, 65 where it is damaged or another version's.
CampaignPlan read_plan(const std::string& folder);
/// Throws Failure 65 that names the first input of these items that is not what it was.
void check_inputs(const CampaignPlan& plan, std::size_t first_item, std::size_t end_item);
/// The same of the inputs that the last command names.
void check_last(const CampaignPlan& plan);

}  // namespace backwash::services
