// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/campaign_spec.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "services/backwash/compare_input.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/spec_table.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

using Words = std::vector<std::string>;

constexpr double kLeastShard = 60;  // s of estimated work: a task of Slurm costs 0.4 to 1 s of its own
constexpr double kChunk = 120;      // s of one compare: a forest takes 12 s to build, a tenth of it
constexpr double kDay = 86'400;     // s
constexpr double kMost = 10'000'000;
constexpr double kLargestSeed = 9e15;  // below 2^53: a row keeps it exactly, whoever reads its JSON
constexpr std::size_t kMostItems = 1'000'000;

/// Seconds of one processor, measured on one of 3 GHz in November 2026; `seconds` of a specification replaces that of a
/// pair, an item or a log.
struct SceneCost {
  double world, pair;  // of one vehicle; a pair by seven methods
};
constexpr SceneCost kRoom{1, 0.1}, kForest{12, 0.7};  // apartment, corridors and gap; a forest, or any file
constexpr double kProgram = 3;                        // a world of the study's matrix
constexpr double kFeasibility = 30;                   // of a forest
constexpr double kLog = 1, kByte = 0.5e-6;            // study and adapt: a log, and each byte of it

SceneCost cost_of(const std::string& map) {
  return map.starts_with("builtin:") && !map.starts_with("builtin:forest") ? kRoom : kForest;
}

/// The manifest is JSON, whose texts are UTF-8.
void check_name(const std::string& name) {
  try {
    static_cast<void>(Json(name).dump());
  } catch (const Json::type_error&) {
    throw Failure(kBadData, name + ":1: its name is no UTF-8; give it another");
  }
}

/// The plan while it is made: each file is hashed once.
class Draft {
 public:
  explicit Draft(CampaignPlan& plan) : plan_(plan) {}
  /// Number of a file; nothing for what is built in.
  void read(CampaignItem& item, const std::string& path) {
    if (path.empty() || path.starts_with("builtin:")) return;
    check_name(path);
    const auto [at, fresh] = number_.try_emplace(path, plan_.inputs.size());
    if (fresh) progress("hashing " + path), plan_.inputs.push_back({path, sha256_of_file(path)});
    item.inputs.push_back(at->second);
  }
  void add(CampaignItem item) {
    for (const auto& word : item.command) check_name(word);
    if (plan_.items.size() >= kMostItems)
      throw Failure(kConfiguration, "a campaign has a million items at most; plan it in parts");
    plan_.items.push_back(std::move(item));
  }

 private:
  CampaignPlan& plan_;
  std::map<std::string, std::size_t> number_;
};

void append(Words& words, const Words& more) { words.insert(words.end(), more.begin(), more.end()); }

/// A verb of this program as an item: one thread, no progress.
CampaignItem verb_item(const Words& words, double seconds) {
  CampaignItem item{{"backwash"}, {}, seconds};
  append(item.command, words);
  append(item.command, {"--quiet", "--threads", "1"});
  return item;
}

void plan_compare(const SpecTable& spec, CampaignPlan& plan, Draft& draft) {
  const auto table = spec.table("compare", {"scenes", "vehicles", "models", "flights", "seed"});
  const auto maps = maps_of(table.texts("scenes", Words{"builtin"}));
  const auto vehicles = table.texts("vehicles", Words{"builtin:quad-5in", "builtin:quad-7in"});
  const auto models = models_of(vehicles, table.texts("models", Words{}));
  const auto flights = table.count("flights", 1, 100'000, 10);
  const Words common = {"--flights", std::to_string(flights), "--seed",
                        std::to_string(table.count("seed", 0, kLargestSeed, 1))};
  const double chunk_s = spec.number("shard_seconds", kLeastShard, kDay, kChunk);
  for (const auto& map : maps) {
    const double pair_s = spec.number("seconds", 1e-3, kDay, cost_of(map).pair);
    // Each command builds the world anew: as many pairs as make that a small share of it, and each nearly the same.
    const auto most = static_cast<std::size_t>(std::max(1.0, std::floor(chunk_s / pair_s)));
    const std::size_t commands = (flights + most - 1) / most, chunk = (flights + commands - 1) / commands;
    for (std::size_t n = 0; n < vehicles.size(); ++n)
      for (std::size_t first = 0; first < flights; first += chunk) {
        const std::size_t end = std::min(flights, first + chunk);
        Words words = {"compare", "--scenes", map,      "--vehicle", vehicles[n],
                       "--model", models[n],  "--rows", "--pairs",   std::to_string(first) + ":" + std::to_string(end)};
        append(words, common);
        auto item = verb_item(words, cost_of(map).world + pair_s * static_cast<double>(end - first));
        for (const auto& path : {map, vehicles[n], models[n]}) draft.read(item, path);
        draft.add(std::move(item));
      }
  }
  plan.last = {"backwash", "compare", "--from", "{rows}", "--json", "--quiet"};
  append(plan.last, common);
}

std::string replaced(std::string word, const std::string& from, const std::string& to) {
  for (auto at = word.find(from); at != word.npos; at = word.find(from, at + to.size()))
    word.replace(at, from.size(), to);
  return word;
}

void plan_program(const SpecTable& spec, CampaignPlan& plan, Draft& draft) {
  const auto table = spec.table("program", {"command", "seed", "count", "each", "name", "inputs", "last"});
  const auto command = table.texts("command", std::nullopt);
  const auto seed = table.count("seed", 0, kLargestSeed, 1), count = table.count("count", 1, kMost, 1);
  const auto name = "{" + table.text("name", "each") + "}";
  const auto each = table.texts("each", Words{""});
  const auto last = table.texts("last", Words{});
  const auto names = [&](const std::string& what) {
    return std::ranges::any_of(command, [&](const auto& word) { return word.find(what) != word.npos; });
  };
  if (name == "{seed}" || name == "{rows}") table.wrong("name", "must be another name: " + name + " has a meaning");
  if (count > 1 && !names("{seed}")) table.wrong("count", "needs {seed} in the command, or its rows are all the same");
  if (each.size() > 1 && !names(name)) table.wrong("each", "needs " + name + " in the command");
  const double seconds = spec.number("seconds", 1e-3, kDay, kProgram);
  for (std::size_t k = 0; k < count; ++k)
    for (const auto& one : each) {
      CampaignItem item{{}, {}, seconds};
      for (const auto& word : command)
        item.command.push_back(replaced(replaced(word, "{seed}", std::to_string(seed + k)), name, one));
      if (command.front().find('/') != std::string::npos) draft.read(item, command.front());
      for (const auto& path : table.texts("inputs", Words{})) draft.read(item, path);
      draft.add(std::move(item));
    }
  CampaignItem merge{last, {}, 0};
  if (!last.empty() && last.front().find('/') != std::string::npos) draft.read(merge, last.front());
  plan.last = last;
}

void plan_feasibility(const SpecTable& spec, CampaignPlan&, Draft& draft) {
  const auto table = spec.table("feasibility", {"maps", "vehicles", "models"});
  const auto vehicles = table.texts("vehicles", std::nullopt);
  const auto models = models_of(vehicles, table.texts("models", Words{}));
  for (const auto& map : maps_of(table.texts("maps", std::nullopt)))
    for (std::size_t n = 0; n < vehicles.size(); ++n) {
      auto item = verb_item({"feasibility", "--map", map, "--vehicle", vehicles[n], "--model", models[n], "--json"},
                            spec.number("seconds", 1e-3, kDay, kFeasibility));
      for (const auto& path : {map, vehicles[n], models[n]}) draft.read(item, path);
      draft.add(std::move(item));
    }
}

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

/// Estimated seconds of a command over these logs.
double log_seconds(const SpecTable& spec, const Words& logs) {
  double seconds = 0;
  for (const auto& path : logs) {
    std::error_code unknown;
    const auto bytes = std::filesystem::file_size(path, unknown);
    seconds += spec.number("seconds", 1e-3, kDay, kLog) + (unknown ? 0 : kByte * static_cast<double>(bytes));
  }
  return seconds;
}

/// What every verb over logs is given.
Words with_files(const SpecTable& table, CampaignItem& item, Draft& draft) {
  Words words;
  for (const auto& [key, option] : {std::pair{"map", "--map"}, {"vehicle", "--vehicle"}, {"model", "--model"}}) {
    const auto path = table.text(key, "");
    if (!path.empty()) append(words, {option, path}), draft.read(item, path);
  }
  append(words, table.texts("options", Words{}));
  return words;
}

/// A study for each folder of logs.
void plan_study(const SpecTable& spec, CampaignPlan&, Draft& draft) {
  const auto table = spec.table("study", {"folders", "map", "vehicle", "model", "options"});
  for (const auto& folder : table.texts("folders", std::nullopt)) {
    const auto logs = files_in(folder);
    CampaignItem files{{}, {}, 0};
    Words words = {"study", "--json"};
    append(words, with_files(table, files, draft));
    words.push_back("--log");
    append(words, logs);
    auto item = verb_item(words, log_seconds(spec, logs));
    item.inputs = files.inputs;
    for (const auto& path : logs) draft.read(item, path);
    draft.add(std::move(item));
  }
}

/// A look at each log by itself.
void plan_adapt(const SpecTable& spec, CampaignPlan&, Draft& draft) {
  const auto table = spec.table("adapt", {"logs", "map", "vehicle", "model", "options"});
  for (const auto& place : table.texts("logs", std::nullopt))
    for (const auto& path : files_in(place)) {
      CampaignItem files{{}, {}, 0};
      Words words = {"adapt", path, "--json"};
      append(words, with_files(table, files, draft));
      auto item = verb_item(words, log_seconds(spec, {path}));
      item.inputs = files.inputs;
      draft.read(item, path);
      draft.add(std::move(item));
    }
}

}  // namespace

CampaignPlan read_campaign_spec(const std::string& path) {
  const std::map<std::string, void (*)(const SpecTable&, CampaignPlan&, Draft&)> kinds = {
      {"adapt", plan_adapt},
      {"compare", plan_compare},
      {"feasibility", plan_feasibility},
      {"program", plan_program},
      {"study", plan_study}};
  const auto file = SpecTable::open(path);
  const auto kind = file.text("kind", std::nullopt);
  const auto known = kinds.find(kind);
  if (known == kinds.end()) file.wrong("kind", "must be adapt, compare, feasibility, program or study");
  file.only({"kind", "seconds", "shard_seconds", kind});
  CampaignPlan plan{kVersion, kind, std::filesystem::current_path().string(), {}, {}, {}, {}};
  check_name(plan.folder);
  Draft draft(plan);
  known->second(file, plan, draft);
  plan.shards = shards_of(plan.items, file.number("shard_seconds", kLeastShard, kDay, kLeastShard));
  return plan;
}

}  // namespace backwash::services
