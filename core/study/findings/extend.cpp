// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/extend.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/config/model_table.hpp"
#include "core/config/simulation_terms.hpp"
#include "core/study/calibrate/model_text.hpp"

namespace backwash::study {
namespace {

/// Numbers to eight significant digits.
toml::array list(const std::vector<double>& values) {
  toml::array all;
  for (const double v : values) all.push_back(config::rounded(v, 8));
  return all;
}

/// A cause as an entry of [[extension.term]].
toml::table table_of(const NamedCause& cause, const Observations& seen) {
  const auto& f = cause.found;
  toml::array theta, effects, simulation;
  for (const double v : f.theta) theta.push_back(config::rounded(v, 8));
  for (const auto& term : simulation_of(cause, seen)) simulation.push_back(config::simulation_table(term));
  for (const auto& e : effects_of(cause, seen)) effects.push_back(config::effect_table(e));
  toml::table term{{"cause", f.form->cause()},
                   {"form", f.form->formula},
                   {"held_out_nats", config::rounded(cause.gain.held_out_nats, 8)},
                   {"flights", static_cast<std::int64_t>(seen.flights)},
                   {"theta", theta},
                   {"effect", effects},
                   {"simulation", simulation}};
  if (!f.scale.anchor.empty()) term.insert("anchor", list(f.scale.anchor));
  if (!cause.applied.beside.empty()) term.insert("beside", list(cause.applied.beside));
  if (f.form->displaces_map)
    term.insert("offset_m", list({f.scale.offset_W.x(), f.scale.offset_W.y()}));
  else
    term.insert("scale", config::rounded(f.scale.value, 8));
  for (const auto& e : f.parameters) {
    toml::table estimate{{"value", config::rounded(e.value, 8)}, {"ci95", list({e.low, e.high})}};
    estimate.is_inline(true);
    term.insert(e.name, std::move(estimate));
  }
  return term;
}

}  // namespace

AppliedTerms apply(const std::vector<ExtensionTerm>& terms, Observations& seen) {
  AppliedTerms applied;
  for (const ExtensionTerm& term : terms) {
    const auto found = std::find_if(catalogue().begin(), catalogue().end(), [&](const Form* f) {
      return f->cause() == term.cause && f->formula == term.formula && f->parameters.size() == term.theta.size();
    });
    // An offset of zero displaces nothing: a file of before offsets were written as such.
    const bool no_offset = found != catalogue().end() && (*found)->displaces_map && term.scale.offset_W.isZero();
    if (found == catalogue().end() || no_offset || why_not_tested(**found, seen)) {
      applied.left.push_back(term);
      continue;
    }
    const Form& form = **found;
    auto columns = form.columns(moved_by_itself(form, seen.windows, term.scale,
                                                Eigen::Map<const Eigen::VectorXd>(
                                                    term.theta.data(), static_cast<Eigen::Index>(term.theta.size()))),
                                term.scale);
    const double flights = term.flights > 0 ? static_cast<double>(term.flights) : static_cast<double>(seen.flights);
    applied.known.push_back({columns, term.gain * static_cast<double>(seen.flights) / flights});
    auto coefficients = term.theta;
    for (const auto& column : companions(form, seen)) {
      if (coefficients.size() >= term.theta.size() + term.beside.size()) break;
      coefficients.push_back(term.beside[coefficients.size() - term.theta.size()]);
      columns.push_back(column);
    }
    each_value(columns, coefficients, [&](Channel c, std::size_t i, double x) { seen.y[c][i] -= x; });
  }
  return applied;
}

FittedForm fitted_form(const NamedCause& cause) {
  const Accepted& f = cause.found;
  const std::span theta(f.theta.data(), static_cast<std::size_t>(f.theta.size()));
  return {*f.form, f.scale, f.columns, theta, f.parameters, cause.applied.beside};
}

std::vector<ModelEffect> effects_of(const NamedCause& cause, const Observations& seen) {
  if (!cause.found.form->extend) return {};
  auto effects = cause.found.form->extend(fitted_form(cause), seen);
  for (auto& e : effects) {
    if (entry(e.kind).of_variance || cause.keeps) continue;
    e.error += e.value.cwiseAbs();
    e.value.setZero();  // it may rest on its set-point: in the bound, not the centre
  }
  return effects;
}

std::vector<SimulationTerm> simulation_of(const NamedCause& cause, const Observations& seen) {
  auto terms = cause.found.form->simulate(fitted_form(cause), seen);
  if (std::ranges::any_of(cause.shift_decay, [](double rate) { return rate > 0; }))
    terms.push_back({SimulationTerm::Kind::shift_decay, {cause.shift_decay.begin(), cause.shift_decay.end()}});
  return terms;
}

std::optional<std::string> why_unwritable(const NamedCause& cause, const Observations& seen) {
  for (const auto& term : simulation_of(cause, seen))
    if (auto why = config::why_unwritable(term)) return why;
  for (const auto& effect : effects_of(cause, seen))
    if (auto why = config::why_unwritable(effect)) return why;
  return std::nullopt;
}

std::vector<SimulationTerm> simulation_of(const StudyResult& result, const Observations& seen) {
  std::vector<SimulationTerm> all;
  for (const auto& cause : result.causes)
    if (cause.applied.refused.empty())
      for (auto& term : simulation_of(cause, seen)) all.push_back(std::move(term));
  return all;
}

Model extended(const Model& model, const StudyResult& result, const Observations& seen) {
  Model m = model;
  for (const auto& cause : result.causes)
    if (cause.applied.refused.empty())
      for (const auto& effect : effects_of(cause, seen)) m.extension.push_back(effect);
  return m;
}

std::string extended_model_text(const Model& model, const StudyResult& result, const Observations& seen,
                                const std::string& base_name, const std::string& version, const std::string& earlier) {
  const toml::table provenance{{"version", version},
                               {"base_model", base_name},
                               {"flights", static_cast<std::int64_t>(seen.flights)},
                               {"verdict", to_string(result.verdict)}};
  std::ostringstream text;
  text << "# Extended by backwash study. Variances in (m/s²)², lengths in m, angles in rad.\n"
       << calibrate::model_tables(model) << config::text_of(toml::table{{"provenance", provenance}}, {"provenance"});
  if (!earlier.empty()) text << earlier << "\n\n";
  toml::array terms;
  for (const auto& cause : result.causes)
    if (cause.applied.refused.empty()) terms.push_back(table_of(cause, seen));
  if (!terms.empty()) text << config::text_of(toml::table{{"extension", toml::table{{"term", terms}}}}, {"extension"});
  return text.str();
}

}  // namespace backwash::study
