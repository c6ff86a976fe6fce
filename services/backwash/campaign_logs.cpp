// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>

#include "services/backwash/campaign_draft.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// Seconds of one processor for a log, and for each byte of it, measured on one of 3 GHz in November 2026; `seconds` of
/// a specification replaces the first.
struct LogCost {
  double log, byte;
};
constexpr LogCost kWhole{1, 0.5e-6}, kRow{0.02, 0.02e-6};  // a study's or adapt's; what is kept of a log for one later
constexpr std::size_t kMostLogs = 1000;                    // of a command: its words have to fit

/// The files of a folder, sorted by name; a file is itself.
Words files_in(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return {path};
  Words files;
  for (const auto& entry : std::filesystem::directory_iterator(path))
    if (entry.is_regular_file()) files.push_back(entry.path().string());
  std::ranges::sort(files);
  if (files.empty()) throw Failure(kNoInput, path + ":1: has no file; name a folder of flight logs");
  return files;
}

/// Estimated seconds of one log.
double log_seconds(const SpecTable& spec, const std::string& path, const LogCost& cost) {
  std::error_code unknown;
  const auto bytes = std::filesystem::file_size(path, unknown);
  return spec.number("seconds", 1e-3, kDay, cost.log) + (unknown ? 0 : cost.byte * static_cast<double>(bytes));
}

/// What every verb over logs is given.
Words with_files(const SpecTable& table, CampaignItem& item, Draft& draft) {
  Words words;
  for (const auto& [key, option] : {std::pair{"map", "--map"}, {"vehicle", "--vehicle"}, {"model", "--model"}}) {
    const auto path = table.text(key, "");
    if (!path.empty()) {
      append(words, {option, path});
      draft.read(item, path);
    }
  }
  return words;
}

/// Commands over so many logs each as make a shard's work, in the order of the logs.
void add_in_parts(const SpecTable& spec, const Words& logs, const Words& before, const std::vector<std::size_t>& files,
                  Draft& draft) {
  const double least_s = spec.number("shard_seconds", kLeastShard, kDay, kLeastShard);
  for (std::size_t k = 0; k < logs.size();) {
    Words words = before;
    CampaignItem own{{}, files, 0};
    for (std::size_t n = 0; k < logs.size() && n < kMostLogs && own.seconds < least_s; ++n, ++k) {
      words.push_back(logs[k]);
      own.seconds += log_seconds(spec, logs[k], kRow);
      draft.read(own, logs[k]);
    }
    auto item = verb_item(words, own.seconds);
    item.inputs = own.inputs;
    draft.add(std::move(item));
  }
}

/// All logs that are named, or that named folders hold.
Words logs_of(const Words& places) {
  Words logs;
  for (const auto& place : places) append(logs, files_in(place));
  return logs;
}

/// One study of all logs: what it keeps of each, then one process over that.
void plan_one_study(const SpecTable& spec, const SpecTable& table, CampaignPlan& plan, Draft& draft) {
  const auto logs = logs_of(table.texts("logs", std::nullopt));
  CampaignItem files{{}, {}, 0};
  Words given = with_files(table, files, draft);
  const auto group = table.text("group", "");
  if (!group.empty()) append(given, {"--group", group});
  Words rows = {"study", "--rows"};
  append(rows, given);
  rows.push_back("--log");
  add_in_parts(spec, logs, rows, files.inputs, draft);
  plan.last = {"backwash", "study", "--from", "{rows}", "--json", "--quiet"};
  append(plan.last, given);
  append(plan.last, table.texts("options", Words{}));
}

}  // namespace

void plan_study(const SpecTable& spec, CampaignPlan& plan, Draft& draft) {
  const auto table = spec.table("study", {"folders", "logs", "group", "map", "vehicle", "model", "options"});
  if (!table.texts("logs", Words{}).empty()) {
    if (!table.texts("folders", Words{}).empty())
      table.wrong("logs", "is one study of all, folders one of each: give one of them");
    return plan_one_study(spec, table, plan, draft);
  }
  for (const auto& folder : table.texts("folders", std::nullopt)) {
    const auto logs = files_in(folder);
    CampaignItem files{{}, {}, 0};
    Words words = {"study", "--json"};
    append(words, with_files(table, files, draft));
    append(words, table.texts("options", Words{}));
    words.push_back("--log");
    append(words, logs);
    double seconds = 0;
    for (const auto& path : logs) seconds += log_seconds(spec, path, kWhole);
    auto item = verb_item(words, seconds);
    item.inputs = files.inputs;
    for (const auto& path : logs) draft.read(item, path);
    draft.add(std::move(item));
  }
}

void plan_calibrate(const SpecTable& spec, CampaignPlan& plan, Draft& draft) {
  const auto table = spec.table("calibrate", {"logs", "maps", "vehicle", "base_model", "options"});
  const auto maps = table.texts("maps", Words{});
  const auto places = table.texts("logs", std::nullopt);
  if (maps.size() > 1 && maps.size() != places.size())
    table.wrong("maps", "must be none, one, or one for each of logs");
  CampaignItem files{{}, {}, 0};
  Words given;
  for (const auto& [key, option] : {std::pair{"vehicle", "--vehicle"}, {"base_model", "--base-model"}}) {
    const auto path = table.text(key, "");
    if (!path.empty()) {
      append(given, {option, path});
      draft.read(files, path);
    }
  }
  plan.last = {"backwash", "calibrate", "--from", "{rows}", "--json", "--quiet"};
  append(plan.last, given);
  std::vector<std::string> listed;
  for (std::size_t k = 0; k < places.size(); ++k) {
    CampaignItem own = files;
    Words rows = {"calibrate", "--rows"};
    append(rows, given);
    if (!maps.empty()) {
      const auto& map = maps[std::min(k, maps.size() - 1)];
      append(rows, {"--map", map});
      draft.read(own, map);
      if (std::ranges::find(listed, map) == listed.end()) {
        listed.push_back(map);
        append(plan.last, {"--map", map});
      }
    }
    rows.push_back("--log");
    add_in_parts(spec, files_in(places[k]), rows, own.inputs, draft);
  }
  append(plan.last, table.texts("options", Words{}));
}

void plan_adapt(const SpecTable& spec, CampaignPlan&, Draft& draft) {
  const auto table = spec.table("adapt", {"logs", "map", "vehicle", "model", "options"});
  for (const auto& place : table.texts("logs", std::nullopt))
    for (const auto& path : files_in(place)) {
      CampaignItem files{{}, {}, 0};
      Words words = {"adapt", path, "--json"};
      append(words, with_files(table, files, draft));
      append(words, table.texts("options", Words{}));
      auto item = verb_item(words, log_seconds(spec, path, kWhole));
      item.inputs = files.inputs;
      draft.read(item, path);
      draft.add(std::move(item));
    }
}

}  // namespace backwash::services
