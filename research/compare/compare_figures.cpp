// SPDX-License-Identifier: BSD-3-Clause
#include <cctype>
#include <cmath>
#include <cstdio>
#include <optional>

#include "core/report/recorded_tables.hpp"
#include "research/compare/compare_report.hpp"

namespace backwash::report {
namespace {

std::string short_metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f m", value);
  return text;
}

}  // namespace

std::optional<double> paper_jerk2_ratio(const sim::CompareMethod& method) {
  // Table I of the paper: 5770.6 for the proposed method, 8021.3 and 22848 for margins of 0.3 and 0.4 m.
  if (!method.margin) return std::nullopt;
  if (std::abs(*method.margin - 0.3) < 1e-9) return 5770.6 / 8021.3;
  if (std::abs(*method.margin - 0.4) < 1e-9) return 5770.6 / 22848;
  return std::nullopt;
}

std::string ratio_figure(const Comparison& c) {
  const std::pair<sim::Measure, const char*> panels[] = {
      {sim::kJerk2, "jerk²"}, {sim::kLength, "length"}, {sim::kTime, "time"}, {sim::kEnergy, "energy"}};
  const auto right = static_cast<double>(c.methods.size()) - 0.5;
  Axis over{"", 0.5, right};
  Layer papers{Shape::dots, Kind::commanded, "the paper’s", {{}}};
  for (std::size_t m = 1; m < c.methods.size(); ++m) {
    over.words.push_back(c.methods[m].margin ? short_metres(*c.methods[m].margin) : c.methods[m].name);
    if (const auto ratio = paper_jerk2_ratio(c.methods[m])) papers.runs[0].push_back({static_cast<double>(m), *ratio});
  }
  std::string html;
  for (const auto& [measure, title] : panels) {
    Layer ratios{Shape::dots, Kind::flown, std::string(title) + ", proposed over", {{}}};
    Layer bars{Shape::line, Kind::flown, "", {}};
    for (std::size_t m = 1; m < c.methods.size(); ++m) {
      const auto& r = c.table.rows[m].on_common.total[measure];
      const auto at = static_cast<double>(m);
      ratios.runs[0].push_back({at, r.value});
      if (r.known()) bars.runs.push_back({{at, r.low}, {at, r.high}});
    }
    Chart chart{
        .x = over,
        .y = {title},
        .layers = {{Shape::line, Kind::paper, "", {{{0.5, 1}, {right, 1}}}}, std::move(bars), std::move(ratios)},
        .height = 220};
    if (measure == sim::kJerk2) {
      chart.layers.push_back(papers);
      chart.layers.push_back({Shape::line, Kind::paper, "", {{{0.5, 0}}}});  // its axis begins at 0
    }
    html += to_svg(chart) + "\n";
  }
  return html;
}

std::string gap_figure(const sim::GapCampaign& gap, PageData& data) {
  DataTable table{
      gap.vehicle, {"t_s", "error_x_m", "bound_x_m", "error_y_m", "bound_y_m", "error_z_m", "bound_z_m"}, {}, 0};
  for (auto& letter : table.id)
    if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
  for (std::size_t k = 0; k < gap.shown.size(); ++k) {
    table.rows.push_back({static_cast<double>(k) * kControlPeriod});
    for (const auto d : {kX, kY, kZ}) {
      table.rows.back().push_back(gap.shown[k].error[d]);
      table.rows.back().push_back(gap.shown[k].half_widths[d]);
    }
  }
  auto plots = error_plots(false);
  for (auto& plot : plots) {
    plot.table = table.id;
    plot.id = table.id + "-" + plot.id;
  }
  return plotted(data, table, plots) + files_html({table.id});
}

}  // namespace backwash::report
