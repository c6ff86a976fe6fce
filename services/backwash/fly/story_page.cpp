// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/fly/story_page.hpp"

#include <cmath>

#include "core/report/figures.hpp"
#include "core/report/flight_report.hpp"
#include "core/report/page/interactive.hpp"
#include "core/report/page/page.hpp"
#include "core/report/recorded_tables.hpp"
#include "services/backwash/fly/flight_story_output.hpp"
#include "services/backwash/page_parts.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

/// What positions and clearances are, and what they are worth.
std::string basis(const FlightStory& story) {
  std::string text = story.by_truth
                         ? "Positions and clearances are the truth's; samples are what the vehicle measured itself."
                         : "No truth was given: positions are those that the vehicle measured itself, and clearances "
                           "hold up to the error of its estimate.";
  const JudgedMaps& m = story.maps;
  if (m.window_clouds > 0)
    text +=
        " What the mapper's window showed is not in the log: obstacles and the field are those of the last whole "
        "map alone" +
        std::string(m.accepted_s.empty() ? ", and there was none." : ".");
  else if (m.accepted_s.size() > 1)
    text += " Obstacles and the field are drawn of the last of " + std::to_string(m.accepted_s.size()) + " maps.";
  return text;
}

/// What is said of obstacles where all is good.
std::string untouched(const JudgedMaps& m) {
  if (m.judged + m.not_judged == 0) return "no clearance to judge";
  if (m.not_judged == 0) return "nothing touched";
  if (m.judged == 0) return "clearances could not be judged";
  return "nothing touched where that could be judged, in " + std::to_string(m.judged) + " of " +
         std::to_string(m.judged + m.not_judged) + " ticks";
}

report::DataTable path_table(const FlightStory& story) {
  report::DataTable table{"path", {"t_s", "x_m", "y_m", "z_m", "command_x_m", "command_y_m", "command_z_m"}, {}, 0};
  for (const auto& s : story.samples) {
    const Vec3 &p = s.p_W, &c = s.command_W;
    table.rows.push_back({s.t_s, p.x(), p.y(), p.z()});
    for (const double value : {c.x(), c.y(), c.z()})  // on the ground nothing is commanded
      table.rows.back().push_back(s.in_air ? value : report::kNoValue);
  }
  return report::thinned(std::move(table));
}

report::DataTable clearance_table(const FlightStory& story) {
  report::DataTable table{"clearance", {"t_s", "clearance_m"}, {}, 0};
  for (const auto& s : story.samples) table.rows.push_back({s.t_s, s.clearance_m.value_or(report::kNoValue)});
  return report::thinned(std::move(table));
}

std::string path_drawing(const FlightStory& story, const report::DataTable& path, const map::OccupancyGrid* map,
                         std::span<const report::Prism> tube) {
  Vec3 low = story.samples.front().p_W, high = low;
  for (const auto& s : story.samples) {
    low = low.cwiseMin(s.p_W);
    high = high.cwiseMax(s.p_W);
  }
  const Vec3 around(1, 1, 0);
  low -= around;
  high += around;
  report::Chart chart{.x = {"x, m", low.x(), high.x()}, .y = {"y, m", low.y(), high.y()}, .equal = true};
  if (map)
    chart = report::seen_from_above(*map, low, high, map->center(report::nearest_voxel(*map, low)).z(),
                                    map->center(report::nearest_voxel(*map, high)).z());
  if (!tube.empty()) chart.layers.push_back(report::outlines(tube, 0, report::Kind::tube, "sets predicted"));
  report::Run flown, commanded;
  for (const auto& row : path.rows)
    if (!std::isnan(row[4])) {
      flown.push_back({row[1], row[2]});
      commanded.push_back({row[4], row[5]});
    }
  chart.layers.push_back({report::Shape::line, report::Kind::commanded, "commanded", {std::move(commanded)}});
  chart.layers.push_back({report::Shape::line, report::Kind::flown, "flown", {std::move(flown)}});
  return report::to_svg(chart);
}

/// Where it was in the air; of a flight that never was, where it stood.
std::vector<Vec3> way_of(const FlightStory& story) {
  std::vector<Vec3> way_W;
  for (const auto& s : story.samples)
    if (s.in_air) way_W.push_back(s.p_W);
  if (way_W.empty()) way_W.push_back(story.samples.front().p_W);
  return way_W;
}

/// The figures of where it was, with their tables.
std::vector<report::Section> sections_of(const FlightStory& story, std::span<const log::RawRecord> log,
                                         const map::OccupancyGrid* map, const plan::World* world,
                                         report::PageData& data) {
  std::vector<report::Section> sections;
  const auto path = path_table(story), clearance = clearance_table(story);
  const auto error = report::recorded_error(log, story.zero_ns);
  sections.push_back({"From above", basis(story), path_drawing(story, path, map, data.scene->tube), {"path"}});
  if (world) {
    sections.push_back(report::field_section(way_of(story), *world));
    data.field = report::field_box(*world, report::field_view(world->grid, way_of(story)));
  }
  const auto add = [&](const report::DataTable& table, const char* title, const char* text,
                       std::vector<report::TimePlot> plots) {
    report::add_plots(sections, data, table, title, text, std::move(plots));
  };
  add(path, "Height", "Commands are drawn in the air alone.",
      {{"height",
        "path",
        "height",
        "m",
        {{"command_z_m", "commanded", report::Kind::commanded}, {"z_m", "flown", report::Kind::flown}}}});
  add(error, "Error between its bounds", "Measured position minus the predicted centre, as each tick logged it.",
      report::error_plots(false));
  add(clearance, "Clearance", "On the routes, body to the nearest obstacle.",
      {{"clearance",
        "clearance",
        "clearance",
        "m",
        {{"clearance_m", "body to the nearest obstacle", report::Kind::flown}}}});
  return sections;
}

/// Path, sets and map in three dimensions.
report::Scene scene_of(const FlightStory& story, std::span<const log::RawRecord> log, const map::OccupancyGrid* map,
                       double radius) {
  std::vector<Vec3> path_W;
  for (const auto& s : story.samples) path_W.push_back(s.p_W);
  report::Scene scene{"path", report::at_intervals(report::recorded_tube(log)), {}, radius};
  if (map) scene.faces = report::map_faces(*map, path_W);
  return scene;
}

std::string figures_table(const FlightStory& s) {
  std::string text = report::row("The log ends", s.ended);
  text += report::row("Time, way in the air", to_text(s.time_s, 2) + " s, " + to_text(s.length_m, 2) + " m");
  text += report::row("Take-offs / landings / holds / refused commands",
                      std::to_string(s.take_offs) + " / " + std::to_string(s.landings) + " / " +
                          std::to_string(s.holds) + " / " + std::to_string(s.refusals));
  text += report::row("Clearances", clearances_of(s));
  if (s.maps.not_judged + s.maps.not_judged_rising > 0)
    text += report::row("Ticks without a clearance, on routes / take-offs",
                        std::to_string(s.maps.not_judged) + " / " + std::to_string(s.maps.not_judged_rising));
  if (s.maps.window_clouds > 0) text += report::row("Mapper's window", window_of(s.maps));
  text += report::row("Largest error over bound, x / y / z", to_text(s.largest_ratio.x(), 2) + " / " +
                                                                 to_text(s.largest_ratio.y(), 2) + " / " +
                                                                 to_text(s.largest_ratio.z(), 2));
  text += report::row("Samples inside", std::to_string(s.inside) + " of " + std::to_string(s.judged));
  text += report::row("Decided again from what the daemon was told", replay_of(s));
  if (s.beyond_truth > 0)
    text += report::row("Ticks that the truth does not cover, judged as measured", std::to_string(s.beyond_truth));
  text += report::row("Records lost", std::to_string(s.records_lost));
  return report::section("In figures", basis(s), report::table(text));
}

std::string pieces_table(const FlightStory& s) {
  if (s.pieces.empty()) return "";
  std::string text;
  for (const auto& p : s.pieces)
    text += report::row(to_text(p.from_s, 2) + " to " + to_text(p.until_s, 2) + " s, " + name_of(p),
                        "to " + to_text(p.goal_W) + " m: " + end_of(p) + "; " + std::to_string(p.inside) + " of " +
                            std::to_string(p.samples) + " samples inside");
  return report::section("What was flown", "", report::table(text));
}

/// Which map judged which part of the way. Nothing where one judged all.
std::string maps_table(const JudgedMaps& m) {
  if (m.stretches.empty() || (m.stretches.size() == 1 && m.not_judged == 0)) return "";
  std::string text;
  for (const auto& stretch : m.stretches)
    text += report::row(to_text(stretch.from_s, 2) + " to " + to_text(stretch.until_s, 2) + " s", by_of(stretch));
  return report::section(
      "What clearances were judged by",
      "Each place by the whole map that was the newest then, of " + std::to_string(m.accepted_s.size()) + ".",
      report::table(text));
}

}  // namespace

std::string story_page(const FlightStory& s, std::span<const log::RawRecord> log, const map::OccupancyGrid* map,
                       const StoryContext& context) {
  std::string page =
      "<h1>A flight of the daemon, from its raw log</h1>\n<p class=\"context\">" + report::escaped(context.log) +
      "; backwash " + report::escaped(kVersion) + "</p>\n<p class=\"verdict " + (s.ok() ? "passed" : "failed") + "\">" +
      report::escaped(s.ok() ? "Every goal reached, " + untouched(s.maps) + ", every sample inside its set."
                             : "Not good: " + why(s) + ".") +
      "</p>\n";
  page += report::timeline_html(s.timeline);
  report::PageData data;
  data.modes = s.timeline.modes;
  std::vector<report::Section> sections;
  if (!s.samples.empty()) {
    data.scene = scene_of(s, log, map, context.body_radius);
    page += report::scene_html(*data.scene);
    sections = sections_of(s, log, map, context.world, data);
  }
  for (auto& section : report::recorded_sections(log, s.zero_ns, data)) sections.push_back(std::move(section));
  for (const auto& section : sections) page += report::to_html(section);
  page += figures_table(s) + pieces_table(s) + maps_table(s.maps);
  auto parameters = context.parameters;
  parameters.emplace_back("As the daemon had them", report::recorded_configuration(log));
  const auto moved = report::interactive(data, report::javascript_folders());
  page += report::parameters_html(own_command(), parameters) + moved.notes;
  return report::html_page("backwash flight", page, moved.scripts);
}

}  // namespace backwash::services
