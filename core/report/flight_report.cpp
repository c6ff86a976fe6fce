// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/flight_report.hpp"

#include <algorithm>

#include "core/report/figures.hpp"
#include "core/report/flight_data.hpp"
#include "core/report/page/interactive.hpp"
#include "core/report/page/page.hpp"
#include "core/report/recorded_tables.hpp"
#include "core/types/text.hpp"

namespace backwash::report {
namespace {

std::string number(double value, int decimals, const char* unit) {
  return to_text(value, decimals) + (*unit ? "\u00a0" : "") + unit;
}

std::string point(const Vec3& p) { return to_text(p) + "\u00a0m"; }

std::string verdict(const sim::FlightSummary& s) {
  const std::string samples = std::to_string(s.inside) + " of " + std::to_string(s.samples);
  std::string line = s.goal_reached ? "Goal reached. " : "Goal missed by " + number(s.goal_error_m, 2, "m") + ". ";
  line += s.touched ? "An obstacle was touched. " : "Nothing touched. ";
  line += samples + " measured positions inside the reachable set predicted for them.";
  return std::string("<p class=\"verdict ") + (s.ok() ? "passed" : "failed") + "\">" + line + "</p>\n";
}

std::string in_figures(const sim::Flight& flight, const sim::FlightSummary& s) {
  const auto& m = flight.plan.metrics;
  std::string text = row("Path flown, take-off to hold", number(s.length_m, 2, "m"));
  text += row("Time", number(s.time_s, 2, "s"));
  text += row("Smallest true clearance on the route, body to obstacle", number(s.clearance_m, 3, "m"));
  text += row("Smallest true clearance during take-off and settling", number(s.take_off_clearance_m, 3, "m"));
  text += row("Smallest clearance left over by the reachable set", number(flight.tight.clearance_m, 3, "m"));
  text += row("Largest error over bound, x / y / z", number(s.largest_ratio.x(), 2, "") + " / " +
                                                         number(s.largest_ratio.y(), 2, "") + " / " +
                                                         number(s.largest_ratio.z(), 2, ""));
  text += row("Samples inside", std::to_string(s.inside) + " of " + std::to_string(s.samples));
  text +=
      row("Planning: search / optimisation / verification",
          number(m.search_ms, 0, "ms") + " / " + number(m.optimise_ms, 0, "ms") + " / " + number(m.verify_ms, 0, "ms"));
  const auto &tight = flight.tight, &paper = flight.paper;
  return section("In figures", "", table(text)) +
         section("Both methods on the same commands",
                 "Exact supports were flown; the ellipsoids of the second-order loop were propagated beside them.",
                 table(heads("", "exact supports", "ellipsoids") +
                       row("Largest half axis", number(tight.largest_half_axis_m, 3, "m"),
                           number(paper.largest_half_axis_m, 3, "m")) +
                       row("Clearance of the swept tube", number(tight.clearance_m, 3, "m"),
                           number(paper.clearance_m, 3, "m")) +
                       row("Clear", tight.clearance_m > 0 ? "yes" : "no", paper.clearance_m > 0 ? "yes" : "no") +
                       row("Propagation of the tube", number(tight.tube_ms, 1, "ms"), number(paper.tube_ms, 1, "ms"))));
}

/// Its figures, each with what it shows as tables in `data`.
std::vector<Section> sections_of(const sim::Flight& flight, const plan::World& world, PageData& data) {
  std::vector<Section> sections = {
      {"From above",
       "Obstacles are those that the tube meets in height, body included. The tube was propagated once, when the "
       "trajectory was accepted.",
       to_svg(map_chart(flight, world)),
       {"path", "tube"}},
      {"Height along the route",
       "Floor and ceiling at the commanded position.",
       to_svg(height_chart(flight, world)),
       {"path", "tube"}},
      field_section(route_of(flight), world)};
  const auto add = [&](const char* id, const char* title, const char* text, std::vector<TimePlot> plots) {
    add_plots(sections, data, *std::ranges::find(data.tables, id, &DataTable::id), title, text, std::move(plots));
  };
  add("error", "Error between its bounds",
      "Measured position minus the predicted centre. The ellipsoids' bound begins at the moment at which the route was "
      "accepted.",
      error_plots(true));
  add("clearance", "Clearance", "During take-off only what stands beside the vehicle counts.",
      {{"clearance",
        "clearance",
        "clearance",
        "m",
        {{"clearance_m", "body to the nearest obstacle, true", Kind::flown},
         {"set_clearance_m", "left over by the reachable set", Kind::bound}}}});
  return sections;
}

}  // namespace

Section field_section(std::span<const Vec3> path_W, const plan::World& world) {
  return {"Disturbance at flight height",
          "Bound of the modelled vertical disturbance, mean and κ standard deviations; white where the vehicle's "
          "centre cannot be. The scene shows it at other heights.",
          to_svg(flight_field_chart(path_W, world)),
          {"field"}};
}

std::string parameters_html(const std::string& command,
                            const std::vector<std::pair<std::string, std::string>>& parameters) {
  std::string html = "<section><h2>Command and parameters</h2>\n<p>This page was written by</p>\n<pre tabindex=\"0\">" +
                     escaped(command) + "</pre>\n";
  for (const auto& [name, text] : parameters)
    html += "<details><summary>" + escaped(name) + "</summary>\n<pre tabindex=\"0\">" + escaped(text) +
            "</pre>\n</details>\n";
  return html + "</section>\n";
}

std::string flight_report(const sim::Flight& flight, const sim::FlightSummary& summary, const plan::World& world,
                          const ReportContext& context) {
  std::string page = "<h1>One flight, and the sets it was planned with</h1>\n";
  page += "<p class=\"context\">Map " + escaped(context.map) + ", vehicle " + escaped(context.vehicle) + ", model " +
          escaped(context.model) + "; from " + point(context.start_W) + " to " + point(context.goal_W) + "; seed " +
          std::to_string(context.seed);
  if (context.sigma_scale != 1) page += "; judged with sets of \u03a3 \u00d7 " + number(context.sigma_scale, 3, "");
  page += "; backwash " + escaped(context.version) + "</p>\n" + verdict(summary);
  PageData data;
  data.tables = flight_tables(flight, world);
  data.scene = flight_scene(flight, world);
  data.field = field_box(world, field_view(world.grid, route_of(flight)));
  page += scene_html(*data.scene);
  for (const auto& section : sections_of(flight, world, data)) page += to_html(section);
  const auto moved = interactive(data, javascript_folders());
  page += in_figures(flight, summary) + parameters_html(context.command, context.parameters) + moved.notes;
  return html_page("backwash flight", page, moved.scripts);
}

}  // namespace backwash::report
