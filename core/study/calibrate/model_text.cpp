// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/model_text.hpp"

#include <sstream>

#include "core/config/model_table.hpp"

namespace backwash::study::calibrate {
namespace {

double number(double value) { return config::rounded(value, 6); }

toml::array list(const std::vector<std::string>& items) {
  toml::array all;
  for (const auto& item : items) all.push_back(item);
  return all;
}

toml::table in_a_row(toml::table table) {
  table.is_inline(true);
  return table;
}

toml::table axes(const Vec3& v) {
  return in_a_row(toml::table{{"x", number(v.x())}, {"y", number(v.y())}, {"z", number(v.z())}});
}

toml::array interval(const Interval& i) { return toml::array{number(i.low), number(i.high)}; }

toml::table confidence(const Calibration& c) {
  toml::table table;
  for (std::size_t p = 0; p < kParameters; ++p)
    if (c.determined[p]) table.insert(key(static_cast<Parameter>(p)), interval(c.ci95[p]));
  if (c.push) {
    table.insert("bound.mean.horizontal", interval(c.push->horizontal.ci95));
    table.insert("bound.mean.vertical", interval(c.push->vertical.ci95));
  }
  table.insert("bound.tau_w", interval(c.tau_w.ci95));
  table.insert("coverage_held_out", axes(c.held_out.coverage));
  table.insert("coverage_fitted", axes(c.on_fitted.coverage));
  table.insert("bound_over_observed", axes(c.held_out.bound_over_observed));
  table.insert("pinball_loss", number(c.held_out.loss));
  table.insert("pinball_loss_constant", number(c.held_out.constant_loss));
  table.insert("pinball_loss_height_only", number(c.held_out.height_loss));
  return table;
}

toml::table by_group(const std::array<double, kGroups>& values) {
  return in_a_row(toml::table{{"horizontal", number(values[kHorizontal])}, {"vertical", number(values[kVertical])}});
}

toml::table provenance(const Calibration& c, const Provenance& p) {
  std::vector<std::string> kept;
  for (std::size_t i = 0; i < kParameters; ++i)
    if (!c.determined[i]) kept.emplace_back(key(static_cast<Parameter>(i)));
  toml::table gated;
  for (std::size_t g = 0; g < kHoverGates; ++g)
    gated.insert(to_string(static_cast<Gate>(g)), static_cast<std::int64_t>(p.gated[g]));
  return toml::table{{"version", p.version},
                     {"vehicle", p.vehicle},
                     {"base_model", p.base_model},
                     {"kept_from_base", list(kept)},
                     {"maps", list(p.maps)},
                     {"logs", list(p.logs)},
                     {"signal", p.signal},
                     {"windows", static_cast<std::int64_t>(p.windows)},
                     {"gated", in_a_row(gated)},
                     {"quantile", number(p.quantile)},
                     {"seed", static_cast<std::int64_t>(p.seed)},
                     {"bootstraps", p.bootstraps},
                     {"between_flights_sd", by_group(c.fitted.between_sd)},
                     {"within_flight_sd", by_group(c.fitted.within_sd)}};
}

}  // namespace

std::string model_text(const Calibration& c, const Provenance& p) {
  std::ostringstream text;
  text << "# Calibrated by backwash: windows' variances lie below this field with probability " << number(p.quantile)
       << ".\n# Variances in (m/s²)², lengths in m, angles in rad.\n"
       << model_tables(c.model)
       << "# 95 % intervals: bootstrap by flight. coverage: share of windows below the bound; held out: of a fit "
          "without\n"
          "# their flight. bound_over_observed: median.\n"
       << config::text_of(toml::table{{"confidence", confidence(c)}}, {"confidence"})
       << "# base_model: the gates. Scatter (sd) is of ln variance.\n"
       << config::text_of(toml::table{{"provenance", provenance(c, p)}}, {"provenance"});
  return text.str();
}

std::string model_tables(const Model& model) {
  return config::text_of(config::model_table(model), {"base", "ground", "corner", "wall", "bound"});
}

}  // namespace backwash::study::calibrate
