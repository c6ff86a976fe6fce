// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "services/backwash/campaign_plan.hpp"

// A shard's file is lines of JSON: which shard of which campaign it is, the rows, and the hash of all before it.
namespace backwash::services {

/// Path of shard `shard` of the campaign in `folder`, whole.
std::string shard_path(const std::string& folder, std::size_t shard);

/// Whether there is nothing to begin: it is whole, or another process does it.
bool taken(const std::string& folder, std::size_t shard);

/// A shard while it is being done: `shard-I.part`, locked against others who would do it, of this machine or over a
/// file system whose locks reach them.
class ShardWriter {
 public:
  /// Begins it anew. Nothing where it is whole already. Throws Failure: 69 where another process does it, 73 or 74.
  static std::optional<ShardWriter> begin(const std::string& folder, const CampaignPlan& plan, std::size_t shard);
  ShardWriter(ShardWriter&& other) noexcept;
  ShardWriter(const ShardWriter&) = delete;
  ShardWriter& operator=(const ShardWriter&) = delete;
  ~ShardWriter();  ///< takes the part away, unless it was finished

  /// Appends rows, each with its newline.
  void add(const std::string& rows);
  /// Its hash, then to the disk, then its name. `seconds`: what it took, kept beside it for estimates.
  void finish(double seconds);

 private:
  ShardWriter(std::string folder, std::size_t shard, int file)
      : folder_(std::move(folder)), shard_(shard), file_(file) {}
  void write(const std::string& text);

  std::string folder_;
  std::size_t shard_;
  int file_;  ///< −1: finished, or another one's now
  std::string text_;
  std::size_t rows_ = 0;
};

/// A shard's rows, each with its newline.
struct ShardRows {
  std::size_t shard;
  std::size_t count;
  std::string text;
};
/// Reads a file that should be a shard of this campaign. The error: what is wrong with it and what would be right.
tl::expected<ShardRows, std::string> read_shard(const std::string& path, const CampaignPlan& plan);

/// How far a campaign is.
struct Survey {
  std::vector<std::size_t> done, running, missing;  ///< numbers of shards, rising
  std::vector<std::string> wrong;                   ///< `FILE:1: what is wrong`, a line each
  double done_s = 0;                                ///< what the shards took that are done and have been timed
  double done_estimate_s = 0;                       ///< what they were estimated at
  double left_s = 0;                                ///< estimate of those not done, by the clock of those that are
};
/// Looks at every file in the campaign's folder that is called like a shard. `take` is given each good shard once.
Survey survey(
    const std::string& folder, const CampaignPlan& plan,
    const std::function<void(ShardRows&&)>& take = [](ShardRows&&) {});

/// Rising numbers as Slurm writes them: `0-3,7`.
std::string ranges(const std::vector<std::size_t>& numbers);

}  // namespace backwash::services
