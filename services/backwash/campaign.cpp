// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "services/backwash/campaign_plan.hpp"
#include "services/backwash/campaign_run.hpp"
#include "services/backwash/campaign_shard.hpp"
#include "services/backwash/campaign_spec.hpp"
#include "services/backwash/campaign_submit.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

struct CampaignOptions {
  std::string spec, folder;
  std::optional<std::uint64_t> shard;
  std::uint64_t jobs = 0;
  Submission how;
  bool slurm = false, parallel = false, json = false, force = false;
};

double estimate_s(const CampaignPlan& plan) {
  double all = 0;
  for (std::size_t k = 0; k < plan.shards.size(); ++k) all += plan.seconds(k);
  return all;
}

double longest_shard_s(const CampaignPlan& plan) {
  double longest = 0;
  for (std::size_t k = 0; k < plan.shards.size(); ++k) longest = std::max(longest, plan.seconds(k));
  return longest;
}

int plan(const CampaignOptions& options) {
  const auto made = read_campaign_spec(options.spec);
  std::error_code wrong;
  std::filesystem::create_directories(options.folder, wrong);
  if (!options.force && std::filesystem::exists(manifest_path(options.folder)))
    throw Failure(kCannotCreate, manifest_path(options.folder) + ":1: exists already; give another folder or --force");
  write_file(manifest_path(options.folder), manifest_text(made), options.force);
  const auto read = read_plan(options.folder);
  const double all_s = estimate_s(read), each_s = all_s / static_cast<double>(read.shards.size());
  const double longest_s = longest_shard_s(read);
  if (options.json) {
    print({{"manifest", read.sha256},
           {"kind", read.kind},
           {"inputs", read.inputs.size()},
           {"items", read.items.size()},
           {"shards", read.shards.size()},
           {"estimate_s", all_s},
           {"longest_s", longest_s}});
  } else {
    std::printf(
        "manifest %s\n%zu items that read %zu files\n%zu shards of about %.0f s; estimated %.0f s on one core "
        "of a laptop, %.0f s at best: on %zu cores\n",
        read.sha256.c_str(), read.items.size(), read.inputs.size(), read.shards.size(), each_s, all_s, longest_s,
        read.shards.size());
  }
  return kOk;
}

int run(const CampaignOptions& options) {
  const auto planned = read_plan(options.folder);
  if (options.shard.has_value() == (options.jobs > 0))
    throw Failure(kUsage, "give the number of one shard, or --jobs for all that are missing");
  if (options.jobs > 0) {
    run_missing(options.folder, planned, options.jobs);
  } else if (!run_shard(options.folder, planned, *options.shard)) {
    std::printf("shard %zu is there already\n", static_cast<std::size_t>(*options.shard));
  }
  return kOk;
}

int status(const CampaignOptions& options) {
  const auto planned = read_plan(options.folder);
  const auto found = survey(options.folder, planned);
  if (options.json) {
    print({{"manifest", planned.sha256},
           {"shards", planned.shards.size()},
           {"done", found.done},
           {"running", found.running},
           {"missing", found.missing},
           {"wrong", found.wrong},
           {"took_s", found.done_s},
           {"left_s", found.left_s}});
    return kOk;
  }
  std::printf("%zu shards: %zu done, %zu running, %zu missing\n", planned.shards.size(), found.done.size(),
              found.running.size(), found.missing.size());
  if (!found.running.empty()) std::printf("running: %s\n", ranges(found.running).c_str());
  if (!found.missing.empty()) std::printf("missing: %s\n", ranges(found.missing).c_str());
  for (const auto& line : found.wrong) std::printf("%s\n", line.c_str());
  if (found.done.size() == planned.shards.size()) return kOk;
  std::printf("left: %.0f s of one processor", found.left_s);
  if (const auto n = found.running.size(); n > 0)
    std::printf(", %.0f s for the %zu at work", found.left_s / static_cast<double>(n), n);
  std::printf("\n");
  return kOk;
}

int merge(const CampaignOptions& options) {
  const auto planned = read_plan(options.folder);
  progress("merging");
  const auto rows = merge_shards(options.folder, planned, options.force);
  if (options.json) {
    print({{"manifest", planned.sha256}, {"shards", planned.shards.size()}, {"rows", rows}});
  } else {
    std::printf("manifest %s\n%zu rows of %zu shards in %s/rows.jsonl%s\n", planned.sha256.c_str(), rows,
                planned.shards.size(), options.folder.c_str(), planned.last.empty() ? "" : ", what they say in result");
  }
  return kOk;
}

int hand_over(CampaignOptions options) {
  if (options.slurm == options.parallel) throw Failure(kUsage, "give one of --slurm and --parallel");
  options.how.to = options.slurm ? Submission::To::slurm : Submission::To::parallel;
  submit(options.folder, read_plan(options.folder), options.how);
  return kOk;
}

Command& add_folder(Command& command, CampaignOptions& options) {
  command.add_option("folder", options.folder, "of the campaign, made by plan").required();
  return command;
}

Command& add_submit(Command& group, CampaignOptions& options) {
  auto& command =
      add_folder(group.add_subcommand("submit", "Gives the missing shards to Slurm or GNU parallel"), options);
  command.add_flag("--slurm", options.slurm, "one array over them, and a merge after it");
  command.add_option("--partition", options.how.partition, "as sbatch takes it");
  command.add_option("--time", options.how.time, "of one shard and of the merge, as sbatch takes it");
  command.add_option("--account", options.how.account, "as sbatch takes it");
  command.add_flag("--parallel", options.parallel, "GNU parallel, and the merge after it");
  command.add_option("-j", options.how.jobs, "of GNU parallel, at a time and machine; default one a processor")
      .check(within(1, 10'000));
  command.add_option("--sshlogin", options.how.sshlogin, "machines, as GNU parallel takes them");
  command.add_flag("--dry-run", options.how.dry_run, "print what would run, and run nothing");
  command.footer("Example:\n  backwash campaign submit table1 --slurm --partition day --time 20");
  return command;
}

}  // namespace

Verb campaign_verb(Command& app) {
  auto& group = app.add_subcommand("campaign", "Work that outgrows one process: planned, done in shards, merged");
  group.require_subcommand();
  const auto options = std::make_shared<CampaignOptions>();
  auto& planning = group.add_subcommand("plan", "A manifest of everything to be done, with the hash of every input");
  planning.add_option("spec", options->spec, "specification, TOML").required();
  planning.add_option("-o,--out", options->folder, "folder of the campaign").required();
  planning.add_flag("--json", options->json, "one JSON object on stdout");
  planning.add_flag("--force", options->force, "replace a manifest; shards of another are refused");
  planning.footer("Example:\n  backwash campaign plan table1.toml -o table1");
  auto& running = add_folder(group.add_subcommand("run", "Does one shard, or all that are missing"), *options);
  running.add_option("shard", options->shard, "number, from 0");
  running.add_option("--jobs", options->jobs, "all that are missing, so many at a time").check(within(1, 10'000));
  running.footer("Example:\n  backwash campaign run table1 --jobs 2");
  auto& telling = add_folder(group.add_subcommand("status", "What is done, running and missing"), *options);
  telling.add_flag("--json", options->json, "one JSON object on stdout");
  telling.footer("Example:\n  backwash campaign status table1");
  auto& merging = add_folder(group.add_subcommand("merge", "All rows in their order, and what they say"), *options);
  merging.add_flag("--json", options->json, "one JSON object on stdout");
  merging.add_flag("--force", options->force, "replace other rows and results");
  merging.footer("Example:\n  backwash campaign merge table1");
  auto& submitting = add_submit(group, *options);
  return {&group, [options, &planning, &running, &telling, &merging, &submitting] {
            if (planning.parsed()) return plan(*options);
            if (running.parsed()) return run(*options);
            if (telling.parsed()) return status(*options);
            return merging.parsed() || !submitting.parsed() ? merge(*options) : hand_over(*options);
          }};
}

}  // namespace backwash::services
