// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/calibrate_page.hpp"

#include <cmath>

#include "core/report/flight_report.hpp"
#include "core/report/page/interactive.hpp"
#include "core/report/page/page.hpp"
#include "core/study/calibrate/bound_figure.hpp"
#include "core/study/calibrate/model_text.hpp"
#include "core/types/formatted.hpp"
#include "services/backwash/page_parts.hpp"
#include "services/backwash/verb.hpp"
#include "version.hpp"

namespace backwash::services {
namespace {

using namespace study::calibrate;

using report::heads, report::row, report::section, report::table;

std::string share(double part) { return to_text(part, 2); }

std::string verdict_of(const Calibration& c, double quantile) {
  const auto& h = c.held_out;
  return "<p class=\"verdict\">Of flights that were not fitted, " + share(h.coverage.x()) +
         " of the windows lay below the bound along x, " + share(h.coverage.y()) + " along y, " +
         share(h.coverage.z()) + " along z; " + share(quantile) + " was asked. The bound is " +
         to_text(h.bound_over_observed.x(), 1) + ", " + to_text(h.bound_over_observed.y(), 1) + " and " +
         to_text(h.bound_over_observed.z(), 1) + " times the median variance.</p>\n";
}

std::string constants(const Calibration& c) {
  std::string text = heads("constant", "value", "95 % interval", "");
  const auto line = [&](const std::string& name, double value, const Interval& ci) {
    text +=
        row(name, formatted("%.4g", value), formatted("%.4g … %.4g", ci.low, ci.high), ci.low <= 0 ? "reaches 0" : "");
  };
  for (std::size_t p = 0; p < kParameters; ++p)
    if (c.determined[p]) line(std::string(key(static_cast<Parameter>(p))), c.fitted.parameters[p], c.ci95[p]);
  line("bound.tau_w, s", c.tau_w.value, c.tau_w.ci95);
  if (c.push) {
    line("bound.mean.horizontal, m/s²", c.push->horizontal.value, c.push->horizontal.ci95);
    line("bound.mean.vertical, m/s²", c.push->vertical.value, c.push->vertical.ci95);
  }
  return section(
      "Constants",
      "With 95 % intervals, by resampling whole flights. An interval that reaches 0: these flights cannot tell.",
      table(text, true));
}

std::string bins(const std::vector<Bin>& all, const char* title, const char* what) {
  std::string text = heads(what, "windows", "x", "y", "z");
  for (const auto& b : all) {
    const std::string range = to_text(b.low, 2) + (std::isfinite(b.high) ? " to " + to_text(b.high, 2) : " and more");
    const auto part = [&](int axis) { return b.windows == 0 ? "–" : share(b.coverage[axis]); };
    text += row(range, std::to_string(b.windows), part(0), part(1), part(2));
  }
  return section(std::string("Below the bound, by ") + title,
                 "Share of the windows of flights that were not fitted. Where it is small, or there are few windows, "
                 "hover there.",
                 table(text, true));
}

std::string flights(const Assessment& a, const std::vector<std::string>& logs) {
  std::string text = heads("log", "windows", "x", "y", "z");
  for (std::size_t f = 0; f < logs.size(); ++f) {
    const Vec3& c = a.flight_coverage[f];
    text += row(logs[f], std::to_string(a.flight_windows[f]), share(c.x()), share(c.y()), share(c.z()));
  }
  return section("Below the bound, by flight", "Each against a fit without it.", table(text, true));
}

std::string refusals_html(std::span<const Refusal> refused) {
  if (refused.empty()) return "";
  std::string text = heads("constants", "why", "fly");
  for (const auto& r : refused) text += row(r.what, r.why, r.flight);
  return section("Not determined", "These stay the base model's, and what would decide them.", table(text, true));
}

std::string left_out(const Campaign& campaign) {
  std::string text = row("Windows of 2 s that count", std::to_string(campaign.windows));
  for (std::size_t g = 0; g < study::kHoverGates; ++g)
    if (campaign.gated[g] > 0)
      text += row(std::string("Left out: ") + study::to_string(static_cast<study::Gate>(g)),
                  std::to_string(campaign.gated[g]));
  for (const auto& what : campaign.not_tested) text += row("Not tested", what);
  if (campaign.height && campaign.height->ceiling) {
    const auto& c = *campaign.height->ceiling;
    text += row("Below a ceiling, variance along z by",
                formatted("%.3g (%.3g … %.3g): the model has no term for it", c.value, c.ci95.low, c.ci95.high));
  }
  return section("What the logs held", "", table(text));
}

/// The variance of each window, by where it hovered.
report::DataTable windows_of(const Campaign& campaign) {
  report::DataTable table{"windows", {"flight", "x_m", "y_m", "z_m", "variance_x", "variance_y", "variance_z"}, {}, 0};
  for (const auto& h : campaign.data.hovers)
    for (const Vec3& v : h.ln_variance)
      table.rows.push_back({static_cast<double>(h.flight), h.p_W.x(), h.p_W.y(), h.p_W.z(), std::exp(v.x()),
                            std::exp(v.y()), std::exp(v.z())});
  return table;
}

std::string bounds(const Calibration& c, const Campaign& campaign, double quantile) {
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    std::string charts;
    for (std::size_t i = 0; i < campaign.maps.size(); ++i)
      charts += "<h3>" + report::escaped(i < campaign.map_names.size() ? campaign.map_names[i] : "a flat floor") +
                "</h3>\n" + report::to_svg(bound_chart(campaign.data, c.model, axis, campaign.maps[i], i)) + "\n";
    text += section(std::string("Acceleration along ") + "xyz"[axis],
                    "Dots: variance of each 2 s window. Lines: the bound at quantile " + to_text(quantile, 2) +
                        ", one set of constants for all maps.",
                    charts + report::files_html({"windows"}));
  }
  return text;
}

}  // namespace

std::string calibrate_page(const Calibration& c, const Campaign& campaign, std::span<const Refusal> refused,
                           const CalibratePageContext& context) {
  std::string page = "<h1>Hover variances under the calibrated bound</h1>\n<p class=\"context\">" +
                     std::to_string(campaign.windows) + " windows of " + std::to_string(campaign.logs.size()) +
                     " flights; backwash " + report::escaped(kVersion) + "</p>\n" + html(campaign.notes) +
                     verdict_of(c, context.quantile);
  page += refusals_html(refused) + constants(c) +
          bins(c.held_out.by_wall_distance, "distance from walls", "distance, m") +
          bins(c.held_out.by_height, "height", "height, m") + flights(c.held_out, campaign.logs) +
          bounds(c, campaign, context.quantile) + left_out(campaign) +
          report::parameters_html(own_command(), parameter_files(context.vehicle, context.base_model));
  report::PageData data;
  data.tables.push_back(windows_of(campaign));
  const auto moved = report::interactive(data, report::javascript_folders());
  return report::html_page("backwash calibration", page + moved.notes, moved.scripts);
}

}  // namespace backwash::services
