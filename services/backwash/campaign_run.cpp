// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/campaign_run.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>
#include <utility>

#include "services/backwash/campaign_shard.hpp"
#include "services/backwash/child.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// The code of a command's end as one of our own.
ExitCode code_as_ours(int code) { return code >= kUsage && code <= kConfiguration ? ExitCode(code) : kUnavailable; }

/// What one command prints, which must be lines of JSON.
std::string rows_of(const std::string& folder, const CampaignPlan& plan, std::size_t number) {
  const auto wrong = [&](ExitCode code, const std::string& what) {
    return Failure(code, manifest_path(folder) + ":1: item " + std::to_string(number) + ", " +
                             shell_line(plan.items[number].command) + ", " + what);
  };
  auto child = start(plan.items[number].command, plan.folder, true);
  const std::string text = read_to_end(child);
  const int code = wait_for(child);
  if (code != 0) throw wrong(code_as_ours(code), end_in_words(code) + "; it must end with 0");
  for (std::size_t at = 0; at < text.size();) {
    const auto end = text.find('\n', at);
    if (end == text.npos ||
        !Json::accept(text.begin() + static_cast<std::ptrdiff_t>(at), text.begin() + static_cast<std::ptrdiff_t>(end)))
      throw wrong(kBadData, "printed what is no line of JSON; it must print nothing else");
    at = end + 1;
  }
  if (text.empty()) throw wrong(kBadData, "printed no row; it must print one or more");
  return text;
}

/// What was done and what is left, before more is begun. Throws Failure 65 for files that must be looked at first.
Survey good_survey(
    const std::string& folder, const CampaignPlan& plan,
    const std::function<void(ShardRows&&)>& take = [](ShardRows&&) {}) {
  auto found = survey(folder, plan, take);
  if (found.wrong.empty()) return found;
  std::string line = found.wrong.front();
  for (std::size_t k = 1; k < found.wrong.size(); ++k) line += "; " + found.wrong[k];
  throw Failure(kBadData, line);
}

void write_same(const std::string& path, const std::string& content, bool force) {
  std::error_code none;
  const bool same = std::filesystem::is_regular_file(path, none) && sha256_of_file(path) == sha256(content);
  if (!same) write_file(path, content, force);
}

/// One text of all: each part is let go when it is in.
std::string joined(std::vector<std::string> parts) {
  std::size_t size = 0;
  for (const auto& part : parts) size += part.size();
  std::string all;
  all.reserve(size);
  for (auto& part : parts) all += std::exchange(part, std::string());
  return all;
}

/// Throws Failure, as run_missing does, or says what other processes do.
void tell_end(const std::string& folder, const CampaignPlan& plan, std::vector<std::size_t> failed, int first_code,
              std::vector<std::size_t> elsewhere) {
  std::ranges::sort(failed);
  if (interrupted())
    throw Failure(kInterrupted, "interrupted; " + std::to_string(survey(folder, plan).done.size()) + " of " +
                                    std::to_string(plan.shards.size()) + " shards are done, and stay; run it again");
  if (!failed.empty())
    throw Failure(code_as_ours(first_code), folder + ": shards " + ranges(failed) + " failed, the first " +
                                                end_in_words(first_code) + "; see what they said above");
  std::erase_if(elsewhere, [&](auto k) { return std::filesystem::exists(shard_path(folder, k)); });
  std::ranges::sort(elsewhere);
  if (!elsewhere.empty())
    std::printf("shards %s are at work in other processes; wait for them before the merge\n",
                ranges(elsewhere).c_str());
}

}  // namespace

bool run_shard(const std::string& folder, const CampaignPlan& plan, std::size_t shard) {
  if (shard >= plan.shards.size())
    throw Failure(kUsage, "there is no shard " + std::to_string(shard) + "; give one of 0 to " +
                              std::to_string(plan.shards.size() - 1));
  if (std::filesystem::exists(shard_path(folder, shard))) {
    const auto rows = read_shard(shard_path(folder, shard), plan);
    if (!rows) throw Failure(kBadData, rows.error());
    return false;
  }
  const std::size_t first = plan.shards[shard], end = plan.end(shard);
  check_inputs(plan, first, end);
  auto writer = ShardWriter::begin(folder, plan, shard);
  if (!writer) return false;
  const auto begun = std::chrono::steady_clock::now();
  progress("shard " + std::to_string(shard));
  for (std::size_t k = first; k < end; ++k) {
    progress(k - first, end - first);
    writer->add(rows_of(folder, plan, k));
  }
  check_inputs(plan, first, end);  // one that was edited meanwhile is in some of the rows
  writer->finish(std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  return true;
}

void run_missing(const std::string& folder, const CampaignPlan& plan, std::size_t jobs) {
  const auto begin = good_survey(folder, plan);
  const auto& todo = begin.missing;
  std::map<pid_t, std::size_t> at_work;
  std::vector<std::size_t> failed, elsewhere;
  int first_code = 0;
  finish_what_is_done();
  progress("campaign, shards");
  progress(0, todo.size());
  for (std::size_t next = 0; next < todo.size() || !at_work.empty();) {
    for (; next < todo.size() && at_work.size() < jobs && !interrupted(); ++next) {
      if (taken(folder, todo[next])) {
        elsewhere.push_back(todo[next]);
        continue;
      }
      const auto child =
          start({"backwash", "campaign", "run", folder, std::to_string(todo[next]), "--quiet"}, "", false);
      at_work.emplace(child.process, todo[next]);
    }
    if (interrupted()) {
      for (const auto& [process, shard] : at_work) ::kill(process, SIGTERM);
      next = todo.size();
    }
    if (at_work.empty()) break;
    int status = 0;
    const pid_t ended = ::waitpid(-1, &status, 0);
    if (ended < 0) {
      if (errno == ECHILD) break;
      continue;
    }
    const int code = code_of(status);
    if (code == kUnavailable && taken(folder, at_work[ended])) {
      elsewhere.push_back(at_work[ended]);
    } else if (code != 0 && !interrupted()) {
      failed.push_back(at_work[ended]);
      if (first_code == 0) first_code = code;
    }
    at_work.erase(ended);
    progress(next - at_work.size(), todo.size());
  }
  tell_end(folder, plan, failed, first_code, elsewhere);
}

std::size_t merge_shards(const std::string& folder, const CampaignPlan& plan, bool force) {
  std::vector<std::string> parts(plan.shards.size());
  std::size_t count = 0;
  const auto found = good_survey(folder, plan, [&](ShardRows&& rows) {
    parts[rows.shard] = std::move(rows.text);
    count += rows.count;
  });
  std::vector<std::size_t> missing = found.missing;
  missing.insert(missing.end(), found.running.begin(), found.running.end());
  std::ranges::sort(missing);
  if (!missing.empty())
    throw Failure(kBadData, folder + ": shards " + ranges(missing) + " of 0-" + std::to_string(plan.shards.size() - 1) +
                                " are missing; run them first");
  const std::string rows = std::filesystem::absolute(folder + "/rows.jsonl").string();
  write_same(rows, joined(std::move(parts)), force);
  if (plan.last.empty()) return count;
  check_last(plan);
  auto command = plan.last;
  for (auto& word : command)
    if (word == "{rows}") word = rows;
  auto child = start(command, plan.folder, true);
  const std::string result = read_to_end(child);
  const int code = wait_for(child);
  if (code != 0)
    throw Failure(code_as_ours(code), manifest_path(folder) + ":1: the last command, " + shell_line(command) + ", " +
                                          end_in_words(code) + "; it must end with 0");
  write_same(folder + "/result", result, force);
  return count;
}

}  // namespace backwash::services
