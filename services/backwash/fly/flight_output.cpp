// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/fly/flight_output.hpp"

#include <algorithm>
#include <cstdio>

#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

/// What went wrong, for the line on stderr; empty if nothing did.
std::string failures(const sim::FlightSummary& s) {
  std::string line;
  const auto add = [&line](const std::string& what) { line += (line.empty() ? "" : "; ") + what; };
  if (!s.goal_reached) add("the goal was missed by " + to_text(s.goal_error_m, 2) + " m");
  if (s.touched)
    add("an obstacle was touched (clearance " + to_text(std::min(s.clearance_m, s.take_off_clearance_m), 3) + " m)");
  if (s.inside != s.samples) {
    add(std::to_string(s.samples - s.inside) + " of " + std::to_string(s.samples) +
        " samples lay outside the set predicted for them; all must lie inside");
  }
  return line;
}

Json to_json(const sim::Flight& flight, const sim::FlightSummary& s, const report::ReportContext& context) {
  const auto axes = [](const Vec3& v) { return Json{{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; };
  const auto method = [](const sim::MethodTube& m) {
    return Json{{"largest_half_axis_m", m.largest_half_axis_m},
                {"clearance_m", m.clearance_m},
                {"clear", m.clearance_m > 0},
                {"tube_ms", m.tube_ms}};
  };
  return {{"ok", s.ok()},
          {"goal_reached", s.goal_reached},
          {"touched", s.touched},
          {"map", context.map},
          {"start", services::to_json(context.start_W)},
          {"goal", services::to_json(context.goal_W)},
          {"seed", context.seed},
          {"sigma_scale", context.sigma_scale},
          {"length_m", s.length_m},
          {"time_s", s.time_s},
          {"goal_error_m", s.goal_error_m},
          {"min_clearance_m", s.clearance_m},
          {"take_off_clearance_m", s.take_off_clearance_m},
          {"planned_clearance_m", flight.tight.clearance_m},
          {"largest_error_over_bound", axes(s.largest_ratio)},
          {"samples", s.samples},
          {"samples_inside", s.inside},
          {"plan", services::to_json(flight.plan.metrics)},
          {"tight", method(flight.tight)},
          {"paper", method(flight.paper)}};
}

void print_text(const sim::Flight& flight, const sim::FlightSummary& s, const report::ReportContext& context) {
  const auto& m = flight.plan.metrics;
  std::printf("flight               %s, %s to %s, %s\n", context.map.c_str(), to_text(context.start_W).c_str(),
              to_text(context.goal_W).c_str(), ("seed " + std::to_string(context.seed)).c_str());
  std::printf("goal                 %s, %.3f m off at the end\n", s.goal_reached ? "reached" : "MISSED",
              s.goal_error_m);
  std::printf("path, time           %.2f m, %.2f s\n", s.length_m, s.time_s);
  std::printf("clearance            %.3f m at least, body to obstacle; %.3f m left over by the reachable set\n",
              s.clearance_m, flight.tight.clearance_m);
  std::printf("largest error/bound  x %.2f, y %.2f, z %.2f\n", s.largest_ratio.x(), s.largest_ratio.y(),
              s.largest_ratio.z());
  std::printf("inside the set       %zu of %zu samples\n", s.inside, s.samples);
  if (m.risk.total > 0)
    std::printf("risk                 %.2g of touching at most on the way, %.2g in a minute at its end\n", m.risk.total,
                m.risk.a_minute);
  std::printf("planning             search %.1f ms, optimisation %.1f ms, verification %.1f ms\n", m.search_ms,
              m.optimise_ms, m.verify_ms);
  for (const auto& [name, method] : {std::pair{"exact supports", &flight.tight}, {"ellipsoids", &flight.paper}}) {
    std::printf("%-20s largest half axis %.3f m, tube %s (%.3f m), propagated in %.2f ms\n", name,
                method->largest_half_axis_m, method->clearance_m > 0 ? "clear" : "NOT clear", method->clearance_m,
                method->tube_ms);
  }
}

}  // namespace

int conclude(const JudgedFlight& judged, const std::string& report, bool json, bool force) {
  const auto& [flight, world, context, summary] = judged;
  if (!report.empty()) {
    progress("drawing the report");
    write_file(report, report::flight_report(flight, summary, world, context), force);
  }
  json ? print(to_json(flight, summary, context)) : print_text(flight, summary, context);
  if (summary.ok()) return kOk;
  throw Failure(kFlightFailed, context.map + ":1: " + failures(summary));
}

}  // namespace backwash::services
