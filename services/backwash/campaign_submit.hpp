// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "services/backwash/campaign_plan.hpp"

namespace backwash::services {

/// How the shards that are missing are given to others.
struct Submission {
  enum class To { slurm, parallel } to = To::slurm;
  std::string partition, time, account;  ///< as sbatch takes them; empty: its own
  int jobs = 0;                          ///< of GNU parallel at a time and machine; 0: one a processor
  std::string sshlogin;                  ///< as GNU parallel takes it
  bool dry_run = false;                  ///< print what would run, and run nothing
};

/// Slurm: writes `array.sh` and `merge.sh` into the campaign's folder and gives both to sbatch, one array over the
/// missing shards and a merge after it. GNU parallel: runs it over the missing shards, with its job log in
/// `parallel.log`, and merges. Throws Failure: 69 where the program is not there, or fails, or Slurm has the array that
/// was submitted before.
void submit(const std::string& folder, const CampaignPlan& plan, const Submission& how);

}  // namespace backwash::services
