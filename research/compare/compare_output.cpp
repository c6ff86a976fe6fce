// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_output.hpp"

#include <cstdio>
#include <sstream>

#include "research/compare/compare_rows.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

Json axes(const Vec3& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

Json to_json(const sim::Interval& interval) {
  return {{"value", interval.value}, {"ci95", interval.known() ? Json{interval.low, interval.high} : Json()}};
}

Json to_json(const sim::MethodRatio& ratio) {
  Json json = {{"pairs", ratio.pairs}};
  for (std::size_t i = 0; i < sim::kMeasures && ratio.pairs > 0; ++i) {
    const char* measure = sim::name(static_cast<sim::Measure>(i));
    json["totals"][measure] = to_json(ratio.total[i]);
    json["geometric_mean"][measure] = to_json(ratio.mean[i]);
  }
  return json;
}

Json to_json(const sim::MethodRow& row, const sim::CompareMethod& method, bool timed) {
  Json common;
  for (std::size_t i = 0; i < sim::kMeasures; ++i) common[sim::name(static_cast<sim::Measure>(i))] = row.common[i];
  const auto paper = report::paper_jerk2_ratio(method);
  const bool flew = row.solved > 0, sets = !method.margin;
  return {{"method", row.method},
          {"margin_m", sets ? Json() : Json(*method.margin)},
          {"pairs", row.pairs},
          {"solved", row.solved},
          {"no_path", row.pairs - row.solved},
          {"status", row.status},
          {"eligible", row.eligible},
          {"solved_of_eligible", row.solved_of_eligible},
          {"flown_m", row.flown_m},
          {"flown_s", row.flown_s},
          {"contacts", row.contacts},
          {"contact_samples", row.contact_samples},
          {"samples", row.samples},
          {"samples_outside", row.outside},
          {"min_clearance_m", flew ? Json(row.smallest_clearance_m) : Json()},
          {"largest_error_over_bound", flew && sets ? Json(row.largest_ratio) : Json()},
          {"planning_ms", timed ? Json{{"median", row.planning_ms_median}, {"p95", row.planning_ms_p95}} : Json()},
          {"common", std::move(common)},
          {"first_over_this",
           {{"common", to_json(row.on_common)},
            {"pairwise", to_json(row.pairwise)},
            {"paper_jerk2", paper ? Json(*paper) : Json()}}}};
}

Json to_json(const sim::GapCampaign& gap) {
  return {{"vehicle", gap.vehicle},         {"flights", gap.flights},
          {"contacts", gap.contacts},       {"samples", gap.samples},
          {"samples_outside", gap.outside}, {"largest_error_over_bound", axes(gap.largest_ratio)}};
}

/// As the other numbers of the table.
std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string interval(const sim::Interval& r) {
  if (!r.known()) return to_text(r.value, 2) + " (one pair)";
  return to_text(r.value, 2) + " (" + to_text(r.low, 2) + ".." + to_text(r.high, 2) + ")";
}

}  // namespace

Json to_json(const report::Comparison& c) {
  Json methods = Json::array(), scenes = Json::array(), demands = Json::array(), gaps = Json::array();
  for (std::size_t m = 0; m < c.methods.size(); ++m) methods.push_back(to_json(c.table.rows[m], c.methods[m], c.timed));
  for (const auto& scene : c.scenes) {
    Json solved, contacts;
    for (const auto& row : sim::tabulate(std::span(&scene, 1), c.methods, c.seed).rows) {
      solved[row.method] = row.solved;
      contacts[row.method] = row.contacts;
    }
    scenes.push_back({{"scene", scene.scene},
                      {"vehicle", scene.vehicle},
                      {"pairs", scene.pairs.size()},
                      {"solved", std::move(solved)},
                      {"contacts", std::move(contacts)}});
  }
  for (const auto& demand : c.demands)
    demands.push_back({{"text", demand.text}, {"met", demand.met}, {"open", demand.open}});
  for (const auto& gap : c.gaps) gaps.push_back(to_json(gap));
  return {{"seed", c.seed},
          {"flights", c.flights},
          {"common_pairs", c.table.common_pairs},
          {"methods", std::move(methods)},
          {"demands", std::move(demands)},
          {"scenes", std::move(scenes)},
          {"narrow_gap", std::move(gaps)}};
}

void print_text(const report::Comparison& c) {
  std::printf("%zu pairs that all methods solve: totals of length, time, jerk2, energy; the rest counts all pairs\n",
              c.table.common_pairs);
  std::printf("%-12s %9s %8s %10s %9s %9s %8s %9s %9s %8s %12s\n", "method", "length m", "time s", "jerk2", "energy kJ",
              "contacts", "no path", "outside", "samples", "flown m", "planning ms");
  for (const auto& row : c.table.rows) {
    std::printf("%-12s %9.1f %8.1f %10.1f %9.2f %9zu %8zu %9zu %9zu %8.0f %12s\n", row.method.c_str(),
                row.common[sim::kLength], row.common[sim::kTime], row.common[sim::kJerk2],
                row.common[sim::kEnergy] / 1000, row.contacts, row.pairs - row.solved, row.outside, row.samples,
                row.flown_m, c.timed ? to_text(row.planning_ms_median, 0).c_str() : "not timed");
  }
  for (std::size_t m = 1; m < c.methods.size(); ++m) {
    const auto& row = c.table.rows[m];
    const auto paper = report::paper_jerk2_ratio(c.methods[m]);
    for (const auto& [name, ratio] : {std::pair{"all", &row.on_common}, {"both", &row.pairwise}}) {
      if (ratio->pairs == 0) continue;
      std::printf("%s over %s, %zu pairs that %s solve: jerk2 %s%s, at equal time %s, length %s, time %s, energy %s\n",
                  c.methods[0].name.c_str(), row.method.c_str(), ratio->pairs, name,
                  interval(ratio->total[sim::kJerk2]).c_str(),
                  paper ? (" [paper " + to_text(*paper, 2) + "]").c_str() : "",
                  interval(ratio->mean[sim::kShape]).c_str(), interval(ratio->total[sim::kLength]).c_str(),
                  interval(ratio->total[sim::kTime]).c_str(), interval(ratio->total[sim::kEnergy]).c_str());
    }
  }
  for (const auto& gap : c.gaps) {
    std::printf(
        "narrow gap, %s: %zu flights, %zu contacts, %zu of %zu samples outside, largest error/bound %.2f %.2f %.2f\n",
        gap.vehicle.c_str(), gap.flights, gap.contacts, gap.outside, gap.samples, gap.largest_ratio.x(),
        gap.largest_ratio.y(), gap.largest_ratio.z());
  }
  for (const auto& demand : c.demands)
    std::printf("%-7s %s\n", demand.met ? "met" : demand.open ? "OPEN" : "MISSED", demand.text.c_str());
}

std::string to_csv(const report::Comparison& c) {
  std::ostringstream csv;
  csv.precision(9);
  csv << "scene,vehicle,method,pair,seed,start_x_m,start_y_m,start_z_m,goal_x_m,goal_y_m,goal_z_m,status,length_m,time_"
         "s,"
         "jerk2,flown_m,flown_jerk2,energy_J,clearance_m,samples,contact_samples,outside_samples,ratio_x,ratio_y,ratio_"
         "z,"
         "planning_ms\n";
  const auto planning = [&](const sim::RouteOutcome& o) { return c.timed ? shown(o.planning_ms) : ""; };
  for (const auto& scene : c.scenes)
    for (std::size_t m = 0; m < c.methods.size(); ++m)
      for (std::size_t n = 0; n < scene.pairs.size(); ++n) {
        const auto& pair = scene.pairs[n];
        const auto& o = scene.outcomes[m][n];
        csv << scene.scene << ',' << scene.vehicle << ',' << c.methods[m].name << ',' << n << ',' << pair.seed;
        for (const Vec3& p : {pair.start_W, pair.goal_W}) csv << ',' << p.x() << ',' << p.y() << ',' << p.z();
        csv << ',' << plan::to_string(o.status);
        if (o.status != plan::PlanStatus::ok) {
          csv << ",,,,,,,,,,,,,," << planning(o) << '\n';
          continue;
        }
        each_kept(o, [&](const char*, auto value) { csv << ',' << value; });
        for (int axis = 0; axis < 3; ++axis) csv << ',' << o.largest_ratio[axis];
        csv << ',' << planning(o) << '\n';
      }
  return csv.str();
}

}  // namespace backwash::services
