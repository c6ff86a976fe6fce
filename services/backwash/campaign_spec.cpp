// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/campaign_spec.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "services/backwash/campaign_draft.hpp"
#include "services/backwash/compare_input.hpp"
#include "services/backwash/spec_table.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

constexpr double kChunk = 120;  // s of one compare: a forest takes 12 s to build, a tenth of it
constexpr double kMost = 10'000'000;
constexpr double kLargestSeed = 9e15;  // below 2^53: a row keeps it exactly, whoever reads its JSON

/// Seconds of one processor, measured on one of 3 GHz in November 2026; `seconds` of a specification replaces that of a
/// pair or an item.
struct SceneCost {
  double world, pair;  // of one vehicle; a pair by seven methods
};
constexpr SceneCost kRoom{1, 0.1}, kForest{12, 0.7};  // apartment, corridors and gap; a forest, or any file
constexpr double kProgram = 3;                        // a world of the study's matrix
constexpr double kFeasibility = 30;                   // of a forest

SceneCost cost_of(const std::string& map) {
  return map.starts_with("builtin:") && !map.starts_with("builtin:forest") ? kRoom : kForest;
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

}  // namespace

CampaignPlan read_campaign_spec(const std::string& path) {
  const std::map<std::string, void (*)(const SpecTable&, CampaignPlan&, Draft&)> kinds = {
      {"adapt", plan_adapt},     {"calibrate", plan_calibrate},
      {"compare", plan_compare}, {"feasibility", plan_feasibility},
      {"program", plan_program}, {"study", plan_study}};
  const auto file = SpecTable::open(path);
  const auto kind = file.text("kind", std::nullopt);
  const auto known = kinds.find(kind);
  if (known == kinds.end()) file.wrong("kind", "must be adapt, calibrate, compare, feasibility, program or study");
  file.only({"kind", "seconds", "shard_seconds", kind});
  CampaignPlan plan{kVersion, kind, std::filesystem::current_path().string(), {}, {}, {}, {}};
  check_name(plan.folder);
  Draft draft(plan);
  known->second(file, plan, draft);
  plan.shards = shards_of(plan.items, file.number("shard_seconds", kLeastShard, kDay, kLeastShard));
  return plan;
}

}  // namespace backwash::services
