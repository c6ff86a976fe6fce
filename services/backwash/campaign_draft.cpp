// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/campaign_draft.hpp"

#include "services/backwash/sha256.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

constexpr std::size_t kMostItems = 1'000'000;

}  // namespace

void check_name(const std::string& name) {
  try {
    static_cast<void>(Json(name).dump());
  } catch (const Json::type_error&) {
    throw Failure(kBadData, name + ":1: its name is no UTF-8; give it another");
  }
}

void Draft::read(CampaignItem& item, const std::string& path) {
  if (path.empty() || path.starts_with("builtin:")) return;
  check_name(path);
  const auto [at, fresh] = number_.try_emplace(path, plan_.inputs.size());
  if (fresh) {
    progress("hashing " + path);
    plan_.inputs.push_back({path, sha256_of_file(path)});
  }
  item.inputs.push_back(at->second);
}

void Draft::add(CampaignItem item) {
  for (const auto& word : item.command) check_name(word);
  if (plan_.items.size() >= kMostItems)
    throw Failure(kConfiguration, "a campaign has a million items at most; plan it in parts");
  plan_.items.push_back(std::move(item));
}

void append(Words& words, const Words& more) { words.insert(words.end(), more.begin(), more.end()); }

CampaignItem verb_item(const Words& words, double seconds) {
  CampaignItem item{{"backwash"}, {}, seconds};
  append(item.command, words);
  append(item.command, {"--quiet", "--threads", "1"});
  return item;
}

}  // namespace backwash::services
