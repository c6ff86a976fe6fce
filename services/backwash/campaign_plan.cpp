// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/campaign_plan.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <set>

#include "core/files/read_file.hpp"
#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kMostShards = 1000;  // Slurm's MaxArraySize is 1001 unless a site says otherwise
constexpr double kFewShards = 20;  // an odd number of fewer leaves the second processor idle for over 5 % of the time
constexpr std::size_t kLargestManifest = std::size_t{1} << 30;

/// A list with one entry a line.
template <typename List, typename Entry>
std::string lines(const List& list, Entry entry) {
  std::string text = "[";
  for (const auto& each : list) text += (text.size() > 1 ? ",\n" : "\n") + Json(entry(each)).dump();
  return text + "\n]";
}

CampaignPlan plan_of(const Json& json) {
  CampaignPlan plan{json.at("version"), json.at("kind"), json.at("folder"), {}, {}, json.at("shards"), json.at("last")};
  for (const auto& input : json.at("inputs")) plan.inputs.push_back({input.at("path"), input.at("sha256")});
  for (const auto& item : json.at("items"))
    plan.items.push_back({item.at("command"), item.at("inputs"), item.at("seconds")});
  return plan;
}

/// What the rest of the program takes for granted.
bool sound(const CampaignPlan& plan) {
  const auto ours = [&](const std::vector<std::string>& command) {
    return plan.kind == "program" || command.front() == "backwash";
  };
  const auto good = [&](const CampaignItem& item) {
    return !item.command.empty() && ours(item.command) &&
           std::ranges::all_of(item.inputs, [&](auto n) { return n < plan.inputs.size(); });
  };
  return !plan.items.empty() && (plan.last.empty() || ours(plan.last)) && std::ranges::all_of(plan.items, good) &&
         !plan.shards.empty() && plan.shards.front() == 0 &&
         std::ranges::adjacent_find(plan.shards, std::greater_equal()) == plan.shards.end() &&
         plan.shards.back() < plan.items.size();
}

/// Number of the first item of each of at most `count` shards.
std::vector<std::size_t> cut(const std::vector<CampaignItem>& items, double least_s, double count) {
  double all = 0, until = 0, begun = 0;
  for (const auto& item : items) all += item.seconds;
  std::vector<std::size_t> first = {0};
  for (std::size_t k = 0; k + 1 < items.size(); ++k) {
    until += items[k].seconds;
    const bool full = until * count >= all * static_cast<double>(first.size());
    if (!full || until - begun < least_s || all - until < least_s) continue;
    first.push_back(k + 1);
    begun = until;
  }
  return first;
}

/// s of two processors over these shards, each as if it were the longest.
double on_two(const std::vector<CampaignItem>& items, const std::vector<std::size_t>& first) {
  double longest = 0;
  for (std::size_t n = 0; n < first.size(); ++n) {
    const std::size_t end = n + 1 < first.size() ? first[n + 1] : items.size();
    double seconds = 0;
    for (std::size_t k = first[n]; k < end; ++k) seconds += items[k].seconds;
    longest = std::max(longest, seconds);
  }
  return longest * std::ceil(static_cast<double>(first.size()) / 2);
}

void check_input(const CampaignPlan& plan, const CampaignInput& input) {
  const auto path = std::filesystem::path(plan.folder) / input.path;
  if (sha256_of_file(path.string()) != input.sha256)
    throw Failure(kBadData,
                  path.string() + ":1: is not what it was when the campaign was planned; bring it back or plan again");
}

}  // namespace

double CampaignPlan::seconds(std::size_t shard) const {
  double all = 0;
  for (std::size_t k = shards[shard]; k < end(shard); ++k) all += items[k].seconds;
  return all;
}

std::vector<std::size_t> shards_of(const std::vector<CampaignItem>& items, double least_s) {
  double all = 0;
  for (const auto& item : items) all += item.seconds;
  const double count = std::clamp(std::floor(all / least_s), 1.0, static_cast<double>(kMostShards));
  const auto first = cut(items, least_s, count);
  if (first.size() % 2 == 0 || first.size() == 1 || static_cast<double>(first.size()) > kFewShards) return first;
  const auto even = cut(items, least_s, static_cast<double>(first.size() - 1));
  return on_two(items, even) < on_two(items, first) ? even : first;
}

std::string manifest_text(const CampaignPlan& plan) {
  const auto input = [](const CampaignInput& i) { return Json{{"path", i.path}, {"sha256", i.sha256}}; };
  const auto item = [](const CampaignItem& i) {
    return Json{{"command", i.command}, {"inputs", i.inputs}, {"seconds", i.seconds}};
  };
  return "{\"version\": " + Json(plan.version).dump() + ",\n\"kind\": " + Json(plan.kind).dump() +
         ",\n\"folder\": " + Json(plan.folder).dump() + ",\n\"inputs\": " + lines(plan.inputs, input) +
         ",\n\"items\": " + lines(plan.items, item) + ",\n\"shards\": " + Json(plan.shards).dump() +
         ",\n\"last\": " + Json(plan.last).dump() + "}\n";
}

std::string manifest_path(const std::string& folder) { return folder + "/manifest.json"; }

CampaignPlan read_plan(const std::string& folder) {
  const std::string path = manifest_path(folder);
  const auto text =
      files::read_file(path, kLargestManifest, "the folder of a campaign, made by backwash campaign plan");
  if (!text) throw Failure(kNoInput, path + ":1: " + text.error().message);
  CampaignPlan plan;
  try {
    plan = plan_of(Json::parse(*text));
  } catch (const Json::exception&) {
    plan.shards.clear();
  }
  if (plan.shards.empty() || !sound(plan))
    throw Failure(kBadData, path + ":1: is no manifest of a campaign; plan it again");
  if (plan.version != kVersion)
    throw Failure(kBadData, path + ":1: was planned by version " + plan.version + ", this is " + kVersion +
                                "; use that version or plan it again");
  plan.sha256 = sha256(*text);
  return plan;
}

void check_inputs(const CampaignPlan& plan, std::size_t first_item, std::size_t end_item) {
  std::error_code unknown;
  if (!std::filesystem::is_directory(plan.folder, unknown))
    throw Failure(kNoInput,
                  plan.folder + ":1: is no folder, and every command runs there; bring it back or plan again");
  std::set<std::size_t> numbers;
  for (std::size_t k = first_item; k < end_item; ++k)
    numbers.insert(plan.items[k].inputs.begin(), plan.items[k].inputs.end());
  for (const auto n : numbers) check_input(plan, plan.inputs[n]);
}

void check_last(const CampaignPlan& plan) {
  for (const auto& input : plan.inputs)
    if (std::ranges::find(plan.last, input.path) != plan.last.end()) check_input(plan, input);
}

}  // namespace backwash::services
