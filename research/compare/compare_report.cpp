// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare_report.hpp"

#include <sstream>

#include "core/report/page/interactive.hpp"
#include "core/report/page/page.hpp"
#include "core/types/formatted.hpp"

namespace backwash::report {
namespace {

/// A table: names of its columns, then its rows, as text.
std::string cells(const std::vector<std::string>& names, const std::vector<std::vector<std::string>>& rows) {
  const auto line = [](const std::vector<std::string>& texts, const char* tag) {
    std::string html = "<tr>";
    for (const auto& text : texts) html += std::string("<") + tag + ">" + escaped(text) + "</" + tag + ">";
    return html + "</tr>\n";
  };
  std::string html = "<thead>" + line(names, "th") + "</thead>\n";
  for (const auto& row : rows) html += line(row, "td");
  return table(html, true);
}

/// "12 (start 3, no path 9)": pairs without a flight, by reason.
std::string no_path(const sim::MethodRow& row) {
  std::string reasons;
  for (const auto& [status, count] : row.status) {
    if (status != plan::to_string(plan::PlanStatus::ok))
      reasons += (reasons.empty() ? "" : ", ") + status + " " + std::to_string(count);
  }
  return std::to_string(row.pairs - row.solved) + (reasons.empty() ? "" : " (" + reasons + ")");
}

std::string with_interval(const sim::Interval& r) {
  return r.known() ? formatted("%.2f (%.2f to %.2f)", r.value, r.low, r.high) : formatted("%.2f (one pair)", r.value);
}

std::string table_one(const Comparison& c) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& row : c.table.rows) {
    rows.push_back({row.method, formatted("%.1f", row.common[sim::kLength]), formatted("%.1f", row.common[sim::kTime]),
                    formatted("%.1f", row.common[sim::kJerk2]), formatted("%.2f", row.common[sim::kEnergy] / 1000),
                    formatted("%zu", row.contacts), no_path(row),
                    formatted("%zu of %zu", row.solved_of_eligible, row.eligible),
                    formatted("%zu of %zu", row.outside, row.samples), formatted("%.0f", row.flown_m),
                    c.timed ? formatted("%.0f / %.0f", row.planning_ms_median, row.planning_ms_p95) : "not timed"});
  }
  const auto head = {std::string("method"),
                     std::string("length, m"),
                     std::string("time, s"),
                     std::string("jerk², (m/s³)² s"),
                     std::string("energy, kJ"),
                     std::string("flights with contact"),
                     std::string("no path"),
                     std::string("solved where the first method’s ends are safe"),
                     std::string("samples outside"),
                     std::string("flown, m"),
                     std::string("planning, ms, median / 95 %")};
  return section(
      "Table I",
      formatted("Length, time, jerk² and energy are totals over the %zu start–goal pairs that all methods solve; "
                "everything else counts all %zu pairs.",
                c.table.common_pairs, c.table.rows.front().pairs),
      cells(head, rows));
}

std::string ratios(const Comparison& c) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t m = 1; m < c.methods.size(); ++m) {
    const auto& row = c.table.rows[m];
    const auto paper = paper_jerk2_ratio(c.methods[m]);
    for (const auto& [name, ratio] : {std::pair{"all solve", &row.on_common}, {"both solve", &row.pairwise}}) {
      if (ratio->pairs == 0) continue;
      rows.push_back({row.method, formatted("%zu that %s", ratio->pairs, name),
                      with_interval(ratio->total[sim::kJerk2]), paper ? formatted("%.2f", *paper) : "",
                      with_interval(ratio->mean[sim::kJerk2]), with_interval(ratio->mean[sim::kShape]),
                      with_interval(ratio->total[sim::kLength]), with_interval(ratio->total[sim::kTime]),
                      with_interval(ratio->total[sim::kEnergy])});
    }
  }
  return cells({"over", "pairs", "jerk², totals", "the paper’s", "jerk², geometric mean",
                "jerk²·time⁵/length², geometric mean", "length", "time", "energy"},
               rows);
}

std::string by_scene(const Comparison& c) {
  std::vector<std::string> head = {"scene", "vehicle", "pairs"};
  for (const auto& method : c.methods) head.push_back(method.name);
  std::vector<std::vector<std::string>> rows;
  for (const auto& scene : c.scenes) {
    const auto part = sim::tabulate(std::span(&scene, 1), c.methods, c.seed);
    std::vector<std::string> row = {scene.scene, scene.vehicle, std::to_string(scene.pairs.size())};
    for (const auto& r : part.rows)
      row.push_back(std::to_string(r.solved) + (r.contacts > 0 ? formatted(" (%zu with contact)", r.contacts) : ""));
    rows.push_back(std::move(row));
  }
  return section("Pairs solved, by scene", "A pair that a method does not solve counts as no path.", cells(head, rows));
}

std::string demanded(const Comparison& c) {
  std::string html;
  for (const auto& demand : c.demands)
    html += std::string("<tr><td class=\"") +
            (demand.met    ? "passed\">met"
             : demand.open ? "\">open"
                           : "failed\">missed") +
            "</td><td>" + escaped(demand.text) + "</td></tr>\n";
  return section(
      "Demanded of the proposed method",
      "Jerk² counts as below when its whole interval is; margins with more contacts are not held against it.",
      table(html, true));
}

}  // namespace

std::string comparison_report(const Comparison& c) {
  PageData data;
  std::string body = "<h1>The same routes with other clearances</h1>\n<p class=\"context\">" +
                     formatted("%zu start–goal pairs a scene and vehicle, seed %llu; backwash ", c.flights,
                               static_cast<unsigned long long>(c.seed)) +
                     escaped(c.version) + "</p>\n" + demanded(c) + table_one(c);
  if (c.table.common_pairs > 0)
    body += section(
        "The proposed method over the others",
        "Below 1 the proposed method needs less. Bars are paired 95 % intervals from 2,000 bootstrap samples of "
        "the pairs; the paper’s ratios are dots without one. A slower plan has less jerk: jerk²·time⁵/length² takes "
        "that out.",
        ratio_figure(c) + ratios(c));
  for (const auto& gap : c.gaps)
    body += section(
        "Through the narrow gap: " + gap.vehicle,
        formatted("Measured position minus the predicted centre, first of %zu flights. Largest error over bound of "
                  "all of them: x %.2f, y %.2f, z %.2f; %zu of %zu samples outside; %zu flights with contact.",
                  gap.flights, gap.largest_ratio.x(), gap.largest_ratio.y(), gap.largest_ratio.z(), gap.outside,
                  gap.samples, gap.contacts),
        gap_figure(gap, data));
  const auto moved = interactive(data, javascript_folders());
  return html_page("backwash compare", body + by_scene(c) + moved.notes, moved.scripts);
}

}  // namespace backwash::report
