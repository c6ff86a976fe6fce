// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/flight_story_output.hpp"

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "core/report/figure_parts.hpp"
#include "core/report/page.hpp"
#include "core/report/plot.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

const char* judged_by(const FlightStory& story) { return story.by_truth ? "truth" : "measured"; }

std::string why(const FlightStory& story) {
  std::string all;
  for (const auto& reason : story.wrong) all += (all.empty() ? "" : "; ") + reason;
  return all;
}

std::string name_of(const StoryPiece& piece) { return piece.take_off ? "take-off" : "route"; }

std::string end_of(const StoryPiece& piece) {
  if (piece.reached) return "reached";
  return piece.by_order ? "ended by an order"
                        : "not flown to its end, " + to_text(piece.goal_error_m, 2) + " m from it";
}

/// What positions and clearances are, and what they are worth.
std::string basis(const FlightStory& story) {
  return story.by_truth ? "Positions and clearances are the truth's; samples are what the vehicle measured itself."
                        : "No truth was given: positions are those that the vehicle measured itself, and clearances "
                          "hold up to the error of its estimate.";
}

std::string draw(const std::string& script, int height) {
  const auto figure = report::draw(script, report::Format::svg, 1000, height);
  if (!figure) throw Failure(kUnavailable, figure.error().message);
  return *figure;
}

std::string path_figure(const FlightStory& story, const map::OccupancyGrid* map) {
  Vec3 low = story.samples.front().p_W, high = low;
  std::ostringstream data;
  data << "$flown << EOD\n";
  for (const auto& s : story.samples) {
    low = low.cwiseMin(s.p_W), high = high.cwiseMax(s.p_W);
    if (s.in_air) data << s.p_W.x() << ' ' << s.p_W.y() << ' ' << s.command_W.x() << ' ' << s.command_W.y() << '\n';
  }
  // A row apart, to which no line leads: a flight that never took off has no other.
  data << '\n' << low.x() << ' ' << low.y() << ' ' << low.x() << ' ' << low.y() << "\nEOD\n" << report::kAxes;
  std::string cells;
  if (map) {
    const auto inside = [&](const Vec3& p) {
      return Index3(map->index(p).cwiseMax(Index3::Zero()).cwiseMin(map->size() - Index3::Ones()));
    };
    const Index3 first = inside(low - Vec3(1, 1, 0)), last = inside(high + Vec3(1, 1, 0));
    data << report::cell_blocks(*map, first, last, map->center(last).z(), map->center(last).z())
         << report::view_from_above(*map, first, last);
    cells = report::plot_cells();
  } else {
    data << "set size ratio -1\nset xlabel 'x, m'\nset ylabel 'y, m'\n";
  }
  data << "set key outside top center horizontal\nplot " << cells
       << "$flown using 3:4 with lines linewidth 1.5 linecolor '#888888' title 'commanded', $flown using 1:2 with "
          "lines linewidth 2 linecolor '#c8371d' title 'flown'\n";
  return draw(data.str(), 520);
}

std::string time_figure(const FlightStory& story) {
  std::ostringstream data;
  data << "$rows << EOD\n";
  for (const auto& s : story.samples) {
    data << s.t_s << ' ' << s.p_W.z() << ' ';
    s.in_air ? data << s.command_W.z() : data << "NaN";  // on the ground nothing is commanded
    data << ' ' << s.error_over_bound.maxCoeff() << '\n';
  }
  data << "EOD\n"
       << report::kAxes << "set xrange [0:" << std::max(story.time_s, 0.02)
       << "]\nset lmargin 10\nset key outside top center horizontal\nset multiplot layout 2,1\nset ylabel 'height, m'\n"
          "plot $rows using 1:3 with lines linewidth 1.5 linecolor '#888888' title 'commanded', $rows using 1:2 with "
          "lines linewidth 2 linecolor '#c8371d' title 'flown'\nset ylabel 'error / bound'\nset xlabel 'time, s'\n"
          "set yrange [0:*]\nplot 1 with lines linewidth 1.5 linecolor '#4a8fce' title 'bound', $rows using 1:4 with "
          "lines linewidth 1.5 linecolor '#c8371d' title 'largest of x, y, z'\nunset multiplot\n";
  return draw(data.str(), 520);
}

std::string row(const std::string& name, const std::string& value) {
  return "<tr><th>" + name + "</th><td>" + report::escaped(value) + "</td></tr>\n";
}

std::string figures_table(const FlightStory& s) {
  std::string text = "<section><h2>In figures</h2>\n<p>" + basis(s) + "</p>\n<table>\n";
  text += row("The log ends", s.ended);
  text += row("Time, way in the air", to_text(s.time_s, 2) + " s, " + to_text(s.length_m, 2) + " m");
  text += row("Take-offs / landings / holds / refused commands",
              std::to_string(s.take_offs) + " / " + std::to_string(s.landings) + " / " + std::to_string(s.holds) +
                  " / " + std::to_string(s.refusals));
  text += row("Smallest clearance on the routes, body to obstacle",
              s.clearance_m ? to_text(*s.clearance_m, 3) + " m" : "not judged: no map, or no route");
  text += row("Largest error over bound, x / y / z", to_text(s.largest_ratio.x(), 2) + " / " +
                                                         to_text(s.largest_ratio.y(), 2) + " / " +
                                                         to_text(s.largest_ratio.z(), 2));
  text += row("Samples inside", std::to_string(s.inside) + " of " + std::to_string(s.judged));
  text += row("Records lost", std::to_string(s.records_lost));
  return text + "</table>\n</section>\n";
}

}  // namespace

Json to_json(const FlightStory& s, const std::string& log) {
  Json pieces = Json::array(), events = Json::array();
  for (const auto& p : s.pieces)
    pieces.push_back({{"kind", name_of(p)},
                      {"from_s", p.from_s},
                      {"until_s", p.until_s},
                      {"goal", to_json(p.goal_W)},
                      {"end", end_of(p)},
                      {"goal_error_m", p.goal_error_m},
                      {"samples", p.samples},
                      {"samples_inside", p.inside}});
  for (const auto& e : s.events) events.push_back({{"t", e.t_s}, {"what", e.text}});
  const Vec3& r = s.largest_ratio;
  return {{"ok", s.ok()},
          {"reason", why(s)},
          {"goal_reached", s.goal_reached()},
          {"touched", s.touched()},
          {"log", log},
          {"judged_by", judged_by(s)},
          {"ended", s.ended},
          {"take_offs", s.take_offs},
          {"landings", s.landings},
          {"holds", s.holds},
          {"refusals", s.refusals},
          {"length_m", s.length_m},
          {"time_s", s.time_s},
          {"min_clearance_m", s.clearance_m ? Json(*s.clearance_m) : Json()},
          {"largest_error_over_bound", {{"x", r.x()}, {"y", r.y()}, {"z", r.z()}}},
          {"samples", s.judged},
          {"samples_inside", s.inside},
          {"records_lost", s.records_lost},
          {"cut_at", s.cut_at ? Json(*s.cut_at) : Json()},
          {"pieces", std::move(pieces)},
          {"events", std::move(events)}};
}

void print_text(const FlightStory& s, const std::string& log) {
  std::printf("flight               %s, recorded; judged by %s positions\n", log.c_str(),
              s.by_truth ? "true" : "measured");
  std::printf("ends                 %s\n", s.ended.c_str());
  for (const auto& p : s.pieces)
    std::printf("%-20s %.2f to %.2f s, to %s: %s; %zu of %zu samples inside\n", name_of(p).c_str(), p.from_s, p.until_s,
                to_text(p.goal_W).c_str(), end_of(p).c_str(), p.inside, p.samples);
  std::printf("path, time           %.2f m, %.2f s; take-offs %zu, landings %zu, holds %zu, refusals %zu\n", s.length_m,
              s.time_s, s.take_offs, s.landings, s.holds, s.refusals);
  if (s.clearance_m)
    std::printf("clearance            %.3f m at least on the routes, body to obstacle%s\n", *s.clearance_m,
                s.by_truth ? "" : ", by the vehicle's own estimate");
  std::printf("largest error/bound  x %.2f, y %.2f, z %.2f\n", s.largest_ratio.x(), s.largest_ratio.y(),
              s.largest_ratio.z());
  std::printf("inside the set       %zu of %zu samples\n", s.inside, s.judged);
}

std::string story_page(const FlightStory& s, const map::OccupancyGrid* map, const std::string& log) {
  std::string page = "<h1>A flight of the daemon, from its raw log</h1>\n<p class=\"context\">" + report::escaped(log) +
                     "; backwash " + report::escaped(kVersion) + "</p>\n<p class=\"verdict " +
                     (s.ok() ? "passed" : "failed") + "\">" +
                     report::escaped(s.ok() ? "Every goal reached, nothing touched, every sample inside its set."
                                            : "Not good: " + why(s) + ".") +
                     "</p>\n";
  if (!s.samples.empty()) {
    page += "<section><h2>From above</h2>\n" + path_figure(s, map) + "</section>\n";
    page += "<section><h2>Height, and error over its bound</h2>\n" + time_figure(s) + "</section>\n";
  }
  page += figures_table(s);
  page += "<section><h2>What was flown</h2>\n<table class=\"wide\">\n";
  for (const auto& p : s.pieces)
    page += row(to_text(p.from_s, 2) + " to " + to_text(p.until_s, 2) + " s, " + name_of(p),
                "to " + to_text(p.goal_W) + " m: " + end_of(p) + "; " + std::to_string(p.inside) + " of " +
                    std::to_string(p.samples) + " samples inside");
  page += "</table>\n</section>\n<section><h2>What happened</h2>\n<table class=\"wide\">\n";
  for (const auto& e : s.events) page += row(to_text(e.t_s, 2) + " s", e.text);
  return report::html_page("backwash flight", page + "</table>\n</section>\n");
}

}  // namespace backwash::services
