// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/files/read_file.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

using plan::PlanStatus;
constexpr std::array kStatuses = {PlanStatus::ok,           PlanStatus::no_path,
                                  PlanStatus::infeasible,   PlanStatus::start_blocked,
                                  PlanStatus::goal_blocked, PlanStatus::deadline};

Json row_of(const sim::RouteOutcome& o) {
  Json row = {{"status", plan::to_string(o.status)}};
  if (o.status != PlanStatus::ok) return row;
  each_kept(o, [&](const char* name, auto value) { row[name] = value; });
  row["largest_ratio"] = services::to_json(o.largest_ratio);
  return row;
}

Vec3 point_of(const Json& json) {
  return Vec3(json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>());
}

sim::RouteOutcome outcome_of(const Json& row) {
  sim::RouteOutcome o;
  const std::string status = row.at("status");
  const auto known = std::ranges::find(kStatuses, status, [](PlanStatus s) { return std::string(plan::to_string(s)); });
  if (known == kStatuses.end()) throw std::out_of_range("status");
  o.status = *known;
  o.clearance_m = std::numeric_limits<double>::infinity();  // as measure() leaves it without a flight
  if (o.status != PlanStatus::ok) return o;
  each_kept(o, [&](const char* name, auto& member) { row.at(name).get_to(member); });
  o.largest_ratio = point_of(row.at("largest_ratio"));
  return o;
}

Json gap_row(const sim::GapCampaign& gap) {
  Json shown = Json::array();
  for (const auto& s : gap.shown) shown.push_back({s.error, s.half_widths});
  return {{"gap", gap.vehicle},       {"flights", gap.flights},
          {"samples", gap.samples},   {"samples_outside", gap.outside},
          {"contacts", gap.contacts}, {"largest_ratio", services::to_json(gap.largest_ratio)},
          {"shown", std::move(shown)}};
}

sim::GapCampaign gap_of(const Json& row) {
  sim::GapCampaign gap{row.at("gap"),
                       row.at("flights"),
                       row.at("samples"),
                       row.at("samples_outside"),
                       row.at("contacts"),
                       point_of(row.at("largest_ratio")),
                       {}};
  for (const auto& s : row.at("shown")) {
    track::Inside inside;
    for (std::size_t k = 0; k < inside.error.size(); ++k) {
      inside.error[k] = s.at(0).at(k);
      inside.half_widths[k] = s.at(1).at(k);
    }
    gap.shown.push_back(inside);
  }
  return gap;
}

/// Adds a pair's row; whether it is the next of its scene.
bool add_pair(report::Comparison& c, const Json& row) {
  const std::string scene = row.at("scene"), vehicle = row.at("vehicle");
  const std::size_t number = row.at("pair");
  if (number == 0) {
    if (!c.scenes.empty() && c.scenes.back().pairs.size() != c.flights) return false;
    c.scenes.push_back({scene, vehicle, {}, std::vector<std::vector<sim::RouteOutcome>>(c.methods.size())});
  }
  if (c.scenes.empty()) return false;
  auto& into = c.scenes.back();
  if (into.scene != scene || into.vehicle != vehicle || into.pairs.size() != number || number >= c.flights)
    return false;
  into.pairs.push_back({point_of(row.at("start")), point_of(row.at("goal")), row.at("seed")});
  for (std::size_t m = 0; m < c.methods.size(); ++m)
    into.outcomes[m].push_back(outcome_of(row.at("outcomes").at(c.methods[m].name)));
  return true;
}

}  // namespace

std::string to_rows(const report::Comparison& c, std::size_t first) {
  std::string text;
  std::size_t gap = 0;
  for (const auto& scene : c.scenes) {
    if (scene.scene == "builtin:narrow-gap" && gap < c.gaps.size()) text += gap_row(c.gaps[gap++]).dump() + "\n";
    for (std::size_t n = 0; n < scene.pairs.size(); ++n) {
      Json outcomes;
      for (std::size_t m = 0; m < c.methods.size(); ++m) outcomes[c.methods[m].name] = row_of(scene.outcomes[m][n]);
      const Json row = {{"scene", scene.scene},
                        {"vehicle", scene.vehicle},
                        {"pair", first + n},
                        {"seed", scene.pairs[n].seed},
                        {"start", services::to_json(scene.pairs[n].start_W)},
                        {"goal", services::to_json(scene.pairs[n].goal_W)},
                        {"outcomes", std::move(outcomes)}};
      text += row.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    }
  }
  return text;
}

void add_rows(report::Comparison& c, const std::string& path) {
  const auto text = files::read_file(path, files::kLargestTable, "rows of backwash compare --rows");
  if (!text) throw Failure(kNoInput, path + ":1: " + text.error().message);
  std::istringstream lines(*text);
  std::size_t number = 0;
  const auto wrong = [&](const std::string& what) {
    return Failure(kBadData, path + ":" + std::to_string(number) + ": " + what);
  };
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const auto row = Json::parse(line, nullptr, false);
    try {
      if (row.contains("gap"))
        c.gaps.push_back(gap_of(row));
      else if (!add_pair(c, row))
        throw wrong("is not the pair that comes next; give all rows of all scenes in order");
    } catch (const std::logic_error&) {  // what is missing or of another kind, too
      throw wrong("is no row of this comparison; give what compare --rows printed");
    } catch (const Json::exception&) {
      throw wrong("is no row of this comparison; give what compare --rows printed");
    }
  }
  if (c.scenes.empty() || c.scenes.back().pairs.size() != c.flights)
    throw wrong("the last scene has not its " + std::to_string(c.flights) +
                " pairs; give all rows, or fewer --flights");
}

}  // namespace backwash::services
