// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>

#include "core/report/page/figure_parts.hpp"
#include "research/compare/compare_report.hpp"

namespace backwash::report {
namespace {

std::string short_metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f m", value);
  return text;
}

std::string ratio_block(const Comparison& c, sim::Measure measure) {
  std::ostringstream block;
  block << '$' << sim::name(measure) << " << EOD\n";
  for (std::size_t m = 1; m < c.methods.size(); ++m) {
    const auto& r = c.table.rows[m].on_common.total[measure];
    const double low = r.known() ? r.low : r.value, high = r.known() ? r.high : r.value;
    block << m << ' ' << r.value << ' ' << low << ' ' << high << " \""
          << (c.methods[m].margin ? short_metres(*c.methods[m].margin) : c.methods[m].name) << "\"\n";
  }
  block << "EOD\n";
  return block.str();
}

}  // namespace

std::optional<double> paper_jerk2_ratio(const sim::CompareMethod& method) {
  // Table I of the paper: 5770.6 for the proposed method, 8021.3 and 22848 for margins of 0.3 and 0.4 m.
  if (!method.margin) return std::nullopt;
  if (std::abs(*method.margin - 0.3) < 1e-9) return 5770.6 / 8021.3;
  if (std::abs(*method.margin - 0.4) < 1e-9) return 5770.6 / 22848;
  return std::nullopt;
}

tl::expected<std::string, PlotError> ratio_figure(const Comparison& c) {
  const std::pair<sim::Measure, const char*> panels[] = {
      {sim::kJerk2, "jerk²"}, {sim::kLength, "length"}, {sim::kTime, "time"}, {sim::kEnergy, "energy"}};
  std::ostringstream script;
  script << "$paper << EOD\n";
  bool any_paper = false;
  for (std::size_t m = 1; m < c.methods.size(); ++m) {
    if (const auto ratio = paper_jerk2_ratio(c.methods[m])) script << m << ' ' << *ratio << '\n', any_paper = true;
  }
  if (!any_paper) script << "0 NaN\n";
  script << "EOD\n";
  for (const auto& panel : panels) script << ratio_block(c, panel.first);
  script << kAxes << "set xrange [0.5:" << static_cast<double>(c.methods.size()) - 0.5
         << "]\nset xtics rotate by -35 nomirror\nset bmargin 5\nunset key\nset multiplot layout 1,4\n";
  for (const auto& [measure, title] : panels) {
    script << "set title '" << title << ", proposed over'\n"
           << "set arrow 1 from graph 0, first 1 to graph 1, first 1 nohead linecolor '#888888' dashtype 3\n"
           << "set yrange [" << (measure == sim::kJerk2 ? "0:*" : "*:*") << "]\nplot $" << sim::name(measure)
           << " using 1:2:3:4:xtic(5) with yerrorbars pointtype 7 pointsize 0.8 linewidth 2 linecolor '#0b3d91'";
    if (measure == sim::kJerk2)
      script << ", $paper using 1:2 with points pointtype 4 pointsize 1.2 linewidth 2 linecolor '#d1495b'";
    script << '\n';
  }
  script << "unset multiplot\n";
  return draw(script.str(), Format::svg, 1000, 360);
}

tl::expected<std::string, PlotError> gap_figure(const sim::GapCampaign& gap) {
  std::ostringstream script;
  script << "$error << EOD\n";
  for (std::size_t k = 0; k < gap.shown.size(); ++k) {
    script << static_cast<double>(k) * kControlPeriod;
    for (const auto d : {kX, kY, kZ}) script << ' ' << gap.shown[k].error[d] << ' ' << gap.shown[k].half_widths[d];
    script << '\n';
  }
  script << "EOD\n"
         << kAxes << "set lmargin 10\nset ytics font ',10'\nset key outside top center horizontal\n"
         << "set multiplot layout 3,1\n";
  const char* const axes[] = {"x", "y", "z"};
  for (int a = 0; a < 3; ++a) {
    const int e = 2 + 2 * a, h = 3 + 2 * a;
    if (a == 1) script << "unset key\n";
    if (a == 2) script << "set xlabel 'time since the plan was accepted, s'\n";
    script << "set ylabel 'error along " << axes[a] << ", m'\nplot $error using 1:(-$" << h << "):" << h
           << " with filledcurves linecolor '#d9e9f8' title 'between the bounds', $error using 1:" << h
           << " with lines linewidth 1.5 linecolor '#b23a48' title 'upper bound', $error using 1:(-$" << h
           << ") with lines linewidth 1.5 linecolor '#2e7d4f' title 'lower bound', $error using 1:" << e
           << " with lines linewidth 2 linecolor '#0b3d91' title 'measured − predicted centre'\n";
  }
  script << "unset multiplot\n";
  return draw(script.str(), Format::svg, 1000, 720);
}

}  // namespace backwash::report
