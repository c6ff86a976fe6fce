// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/campaign_submit.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/backwash/campaign_run.hpp"
#include "services/backwash/campaign_shard.hpp"
#include "services/backwash/child.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

using Words = std::vector<std::string>;

/// Runs it here and returns what it prints. Throws Failure 69.
std::string answer_of(const Words& command, const char* package) {
  auto child = start(command, "", true);
  const std::string text = read_to_end(child);
  const int code = wait_for(child);
  if (code != 0)
    throw Failure(kUnavailable,
                  command.front() + ":1: " + end_in_words(code) + "; is " + package + " installed and up?");
  return text.substr(0, text.find_first_of(";\n"));  // sbatch --parsable: the job, perhaps ;cluster
}

std::string script(const std::string& folder, const std::string& name, const Words& settings, const std::string& line) {
  std::string text = "#!/bin/sh\n#SBATCH --job-name=" + name + "\n#SBATCH --ntasks=1\n#SBATCH --cpus-per-task=1\n";
  for (const auto& setting : settings) text += "#SBATCH " + setting + "\n";
  return text + "# Slurm's own file names take no spaces: the folder's name goes through the shell.\nexec " + line +
         " >>" + shell_line({folder}) + "/" + (name == "backwash-merge" ? "merge" : "task-$SLURM_ARRAY_TASK_ID") +
         ".log 2>&1\n";
}

/// Throws Failure 69 where Slurm has not ended with the array that was given to it last: its shards are missing yet.
void check_queue(const std::string& folder) {
  std::string job;
  if (!(std::ifstream(folder + "/slurm.job") >> job)) return;
  Words question(1, "squeue");
  for (const char* option : {"--noheader", "--format=%F"}) question.push_back(option);
  auto child = start(question, "", true);
  std::istringstream queue(read_to_end(child));
  const bool answered = wait_for(child) == 0;
  for (std::string other; answered && queue >> other;)
    if (other == job)
      throw Failure(kUnavailable, folder + "/slurm.job:1: array " + job + " is in Slurm's queue; wait, or scancel it");
}

void to_slurm(const std::string& folder, const std::vector<std::size_t>& missing, const Submission& how) {
  const Words program = {own_program(), "campaign"};
  const auto line = [&](const char* verb) { return shell_line(program) + " " + verb + " " + shell_line({folder}); };
  const std::string array =
                        script(folder, "backwash", {"--array=" + ranges(missing), "--requeue", "--output=/dev/null"},
                               line("run") + " \"$SLURM_ARRAY_TASK_ID\""),
                    merge = script(folder, "backwash-merge", {"--output=/dev/null"}, line("merge"));
  Words options(1, "sbatch");
  options.push_back("--parsable");
  for (const auto& [name, value] :
       {std::pair{"--partition=", &how.partition}, {"--time=", &how.time}, {"--account=", &how.account}})
    if (!value->empty()) options.push_back(name + *value);
  Words first = options, second = options;
  first.push_back(folder + "/array.sh");
  if (how.dry_run) {
    second.insert(second.end(), {"--dependency=afterany:JOB", folder + "/merge.sh"});
    std::printf("%s/array.sh:\n%s\n%s/merge.sh:\n%s\n%s\n%s\n", folder.c_str(), array.c_str(), folder.c_str(),
                merge.c_str(), shell_line(first).c_str(), shell_line(second).c_str());
    return;
  }
  check_queue(folder);
  write_file(folder + "/array.sh", array, true);
  write_file(folder + "/merge.sh", merge, true);
  const std::string job = answer_of(first, "Slurm");
  write_file(folder + "/slurm.job", job + "\n", true);
  second.insert(second.end(), {"--dependency=afterany:" + job, folder + "/merge.sh"});
  std::printf("array %s of %zu shards, merge %s after it\n", job.c_str(), missing.size(),
              answer_of(second, "Slurm").c_str());
}

void to_parallel(const std::string& folder, const CampaignPlan& plan, const std::vector<std::size_t>& missing,
                 const Submission& how) {
  Words command = {"parallel", "--joblog", folder + "/parallel.log"};
  if (how.jobs > 0) command.insert(command.end(), {"--jobs", std::to_string(how.jobs)});
  if (!how.sshlogin.empty()) command.insert(command.end(), {"--sshlogin", how.sshlogin});
  // As arguments of parallel's, which it quotes: in its command line it would run Perl that a folder's name has.
  for (const auto& word :
       Words{"--null", "exec {1} campaign run {2} {3} --quiet", ":::", own_program(), ":::", folder, ":::"})
    command.push_back(word);
  for (const auto shard : missing) command.push_back(std::to_string(shard));
  if (how.dry_run) {
    std::printf("%s\n%s\n", shell_line(command).c_str(),
                shell_line({own_program(), "campaign", "merge", folder}).c_str());
    return;
  }
  if (!missing.empty()) {
    const int code = wait_for(start(command, "", false));
    if (code != 0)
      throw Failure(kUnavailable, folder + "/parallel.log:1: GNU parallel " + end_in_words(code) +
                                      "; is it installed? else see its job log, and submit again");
  }
  std::printf("%zu rows\n", merge_shards(folder, plan, false));
}

}  // namespace

void submit(const std::string& folder, const CampaignPlan& plan, const Submission& how) {
  const auto found = survey(folder, plan);
  if (!found.wrong.empty()) throw Failure(kBadData, found.wrong.front());
  const std::string whole = std::filesystem::canonical(folder).string();
  if (how.to == Submission::To::parallel) return to_parallel(whole, plan, found.missing, how);
  if (found.missing.empty()) throw Failure(kUsage, folder + " misses no shard; merge it with backwash campaign merge");
  to_slurm(whole, found.missing, how);
}

}  // namespace backwash::services
