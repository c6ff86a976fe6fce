// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/study_before_after.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/report/page/page.hpp"
#include "core/study/before_after/before_after_page.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

Json to_json(const study::MeasuredChange& c) {
  Json json = {{"name", c.measure->name},
               {"unit", c.measure->unit},
               {"verdict", study::to_string(c.helped)},
               {"flights", {{"before", c.flights_before}, {"after", c.flights_after}}}};
  if (!c.why.empty()) {
    json["why"] = c.why;
    return json;
  }
  const Json change = {{"value", c.change}, {"interval", {c.low, c.high}}};
  json.update({{"before", c.before},
               {"after", c.after},
               {"smallest_told", c.smallest},
               {"flights_needed", c.needed ? Json(*c.needed) : Json()}});
  c.measure->ratio ? json.update({{"ratio", change}}) : json.update({{"difference", change}});
  return json;
}

}  // namespace

int study_before_after(const BeforeAfter& asked, Flights flights, const LookedWith& with) {
  const auto is_after = [&](const std::string& path) {
    return std::ranges::find(asked.after, path, &CampaignFiles::Log::path) != asked.after.end();
  };
  for (const auto& [twin, known] : flights.twice)
    if (is_after(twin) != is_after(known))
      throw Failure(kBadData, twin + ":1: is the flight " + known + " again, before and after; give each flight once");
  std::vector<const log::FlightLog*> logs;
  std::vector<char> after;
  std::vector<std::size_t> unit;
  std::optional<double> group;
  for (const std::size_t k : flights.order()) {
    logs.push_back(&flights.logs[k]);
    after.push_back(is_after(flights.paths[k]));
    const bool same = group && flights.group[k] == *group;
    unit.push_back(unit.empty() ? 0 : unit.back() + (same ? 0 : 1));
    if (!flights.group.empty()) group = flights.group[k];
  }
  for (const bool side : {false, true})
    if (std::ranges::find(after, static_cast<char>(side)) == after.end())
      throw Failure(kBadData,
                    std::string(side ? "--after" : "--before") + ": no flight of it is left; see what was left out");
  const auto seen = observations(flights, with);
  const auto measures = study::measures_of(seen, logs, with.vehicle);
  const auto changes = study::before_after(measures.tested, after, unit);
  const auto flown = study::before_after(measures.flown, after, unit);
  const auto otherwise = study::flown_otherwise(flown);
  Json json = {{"verdict", study::verdict_of(changes)},
               {"flights", {{"before", std::ranges::count(after, 0)}, {"after", std::ranges::count(after, 1)}}},
               {"flown_otherwise", otherwise},
               {"measures", Json::array()},
               {"not_tested", Json::array()}};
  for (const auto& c : changes) json["measures"].push_back(to_json(c));
  for (const auto& [name, why] : measures.not_tested) json["not_tested"].push_back({{"name", name}, {"why", why}});
  for (const auto& [log, known] : flights.twice) json["counted_once"].push_back({{"log", log}, {"same_as", known}});
  if (!asked.page.empty())
    write_file(asked.page, study::before_after_page(changes, flown, measures, asked.context, html(with.notes)),
               asked.force);
  if (asked.json) {
    print(told_first(with.notes, json));
    return kOk;
  }
  print_text(with.notes);
  std::printf("%s\n", study::headline(changes).c_str());
  if (!otherwise.empty()) std::printf("%s\n", otherwise.c_str());
  for (const auto& c : changes) {
    const auto power = study::power_words(c);
    std::printf("%-14s  %s: %s%s\n", study::to_string(c.helped), c.measure->name.c_str(),
                study::change_words(c).c_str(), (power.empty() ? "" : "; " + power).c_str());
  }
  for (const auto& [name, why] : measures.not_tested) std::printf("not tested: %s (%s)\n", name.c_str(), why.c_str());
  return kOk;
}

}  // namespace backwash::services
