// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/extend.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/config/model_table.hpp"
#include "core/study/calibrate/model_text.hpp"

namespace backwash::study {
namespace {

using Kind = ModelEffect::Kind;

double half_width(const Estimate& e) { return std::max(0.0, (e.high - e.low) / 2); }

/// Σ θ x of a cause in one channel, by window; empty if it does not move it.
std::vector<double> added(const Accepted& cause, const Observations& seen, Channel channel) {
  std::vector<double> sum;
  for (std::size_t k = 0; k < cause.columns.size(); ++k)
    for (const auto& part : cause.columns[k].parts) {
      if (part.channel != channel) continue;
      sum.resize(seen.windows.size(), 0);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += cause.theta[static_cast<Eigen::Index>(k)] * part.x[i];
    }
  return sum;
}

/// Largest |Σ θ x| flown, level and vertical, with the first parameter at the far end of its interval.
ModelEffect unknown_push(const Accepted& cause, const Observations& seen) {
  const auto x = added(cause, seen, kMeanX), y = added(cause, seen, kMeanY), z = added(cause, seen, kMeanZ);
  ModelEffect e{Kind::push, Vec3::Zero(), Vec3::Zero(), 0};
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    e.error.x() = std::max(e.error.x(), std::hypot(x.empty() ? 0 : x[i], y.empty() ? 0 : y[i]));
    e.error.z() = std::max(e.error.z(), z.empty() ? 0 : std::abs(z[i]));
  }
  const Estimate& first = cause.parameters.front();
  const double size = std::abs(first.value);
  if (size > 0) e.error *= 1 + half_width(first) / size;
  return e;
}

/// Vertical push over the range that was flown: its middle, and half of it with the parameter's own error.
ModelEffect flown_range(const Accepted& cause, const Observations& seen) {
  const auto z = added(cause, seen, kMeanZ);
  const auto [low, high] = std::minmax_element(z.begin(), z.end());
  const Estimate& first = cause.parameters.front();
  const double size = std::abs(first.value), most = std::max(std::abs(*low), std::abs(*high));
  return {Kind::push, Vec3(0, 0, (*low + *high) / 2),
          Vec3(0, 0, (*high - *low) / 2 + (size > 0 ? most * half_width(first) / size : 0)), 0};
}

/// Numbers to eight significant digits.
toml::array list(std::initializer_list<double> values) {
  toml::array all;
  for (const double v : values) all.push_back(config::rounded(v, 8));
  return all;
}

/// A cause as an entry of [[extension.term]].
toml::table table_of(const NamedCause& cause, const Observations& seen) {
  const auto& f = cause.found;
  toml::array theta, effects;
  for (const double v : f.theta) theta.push_back(config::rounded(v, 8));
  for (const auto& e : effects_of(cause, seen)) effects.push_back(config::effect_table(e));
  toml::table term{{"cause", f.form->cause},
                   {"form", f.form->formula},
                   {"scale", config::rounded(f.scale, 8)},
                   {"held_out_nats", config::rounded(cause.gain.held_out_nats, 8)},
                   {"theta", theta},
                   {"effect", effects}};
  for (const auto& e : f.parameters) {
    toml::table estimate{{"value", config::rounded(e.value, 8)}, {"ci95", list({e.low, e.high})}};
    estimate.is_inline(true);
    term.insert(e.name, std::move(estimate));
  }
  return term;
}

}  // namespace

std::vector<Term> terms_of(const StudyResult& result) {
  std::vector<Term> terms;
  for (const auto& cause : result.causes) {
    const auto& f = cause.found;
    terms.push_back({f.form->cause, f.form->formula, f.scale, {f.theta.data(), f.theta.data() + f.theta.size()}});
  }
  return terms;
}

std::vector<Term> apply(const std::vector<Term>& terms, Observations& seen) {
  std::vector<Term> left;
  for (const Term& term : terms) {
    const auto form = std::find_if(catalogue().begin(), catalogue().end(), [&](const Form& f) {
      return f.cause == term.cause && f.formula == term.formula && f.parameters.size() == term.theta.size();
    });
    if (form == catalogue().end() || why_not_tested(*form, seen)) {
      left.push_back(term);
      continue;
    }
    const auto columns = form->columns(
        moved_by_itself(
            *form, seen.windows, term.scale,
            Eigen::Map<const Eigen::VectorXd>(term.theta.data(), static_cast<Eigen::Index>(term.theta.size()))),
        term.scale);
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& part : columns[k].parts)
        for (std::size_t i = 0; i < part.x.size(); ++i) seen.y[part.channel][i] -= term.theta[k] * part.x[i];
  }
  return left;
}

std::vector<ModelEffect> effects_of(const NamedCause& cause, const Observations& seen) {
  const Accepted& f = cause.found;
  const std::string &name = f.form->cause, &first = f.form->parameters.front();
  const bool variance = first == "B_ln";
  // The form's own fit, which holds where it was flown; the interval is of all shapes at the reference.
  const auto with = [&](Kind kind) {
    const Estimate& e = f.parameters.front();
    const double value = f.theta[0], error = std::max({0.0, e.high - value, value - e.low});
    return std::vector{ModelEffect{kind, Vec3(value, 0, 0), Vec3(error, 0, 0), f.scale}};
  };
  if (name == "ground_thrust") return with(Kind::push_over_surface);
  if (name == "ceiling") return with(variance ? Kind::ln_variance_under_surface : Kind::push_under_surface);
  if (name == "wall_attraction") return with(Kind::push_to_walls);
  if (name == "rotor_drag") return with(Kind::push_against_velocity);
  if (name == "forward_speed") return with(variance ? Kind::ln_variance_with_speed : Kind::push_with_speed);
  if (name == "draft") {
    const auto &x = f.parameters[0], &y = f.parameters[1];
    return {{Kind::push, Vec3(x.value, y.value, 0), Vec3(half_width(x), half_width(y), 0), 0}};
  }
  if ((name == "payload" && !f.form->integer_scale) || name == "battery_sag") return {flown_range(f, seen)};
  if (name == "trim" || name == "imu_drift") return {unknown_push(f, seen)};
  if (name == "recirculation") {
    const auto ln = added(f, seen, kVarZ);
    const double most = std::max(0.0, *std::max_element(ln.begin(), ln.end()));
    const Estimate& e = f.parameters.front();
    const double share = std::abs(e.value) > 0 ? half_width(e) / std::abs(e.value) : 0;
    return {{Kind::ln_variance, Vec3(most, 0, 0), Vec3(most * share, 0, 0), 0}};
  }
  return {};
}

Model extended(const Model& model, const StudyResult& result, const Observations& seen) {
  Model m = model;
  for (const auto& cause : result.causes)
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
  for (const auto& cause : result.causes) terms.push_back(table_of(cause, seen));
  if (!terms.empty()) text << config::text_of(toml::table{{"extension", toml::table{{"term", terms}}}}, {"extension"});
  return text.str();
}

}  // namespace backwash::study
