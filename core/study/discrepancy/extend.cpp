// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/discrepancy/extend.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/study/calibrate/model_text.hpp"

namespace backwash::study::discrepancy {
namespace {

/// Σ θ x of all causes in one channel; empty if none moves it.
std::vector<double> added(const StudyResult& result, const Observations& seen, Channel channel) {
  std::vector<double> sum;
  for (const auto& cause : result.causes) {
    const auto& columns = cause.found.columns;
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& part : columns[k].parts) {
        if (part.channel != channel) continue;
        sum.resize(seen.windows.size(), 0);
        for (std::size_t i = 0; i < sum.size(); ++i)
          sum[i] += cause.found.theta[static_cast<Eigen::Index>(k)] * part.x[i];
      }
  }
  return sum;
}

bool scales_everywhere(const std::string& cause) { return cause == "recirculation" || cause == "forward_speed"; }

void scale_variances(Model& m, double factor) {
  for (double* v :
       {&m.base.horizontal, &m.base.vertical, &m.ground.lambda.horizontal, &m.ground.lambda.vertical,
        &m.ground.k1.horizontal, &m.ground.k1.vertical, &m.corner.lambda.normal, &m.corner.lambda.tangential,
        &m.corner.lambda.vertical, &m.wall.k1.normal, &m.wall.k1.tangential, &m.wall.k1.vertical})
    *v = std::min(*v * factor, 100.0);
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
    const auto columns = form->columns(seen.windows, term.scale);
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const auto& part : columns[k].parts)
        for (std::size_t i = 0; i < part.x.size(); ++i) seen.y[part.channel][i] -= term.theta[k] * part.x[i];
  }
  return left;
}

Model extended(const Model& model, const StudyResult& result, const Observations& seen) {
  Model m = model;
  const auto x = added(result, seen, kMeanX), y = added(result, seen, kMeanY), z = added(result, seen, kMeanZ);
  double level = 0, vertical = 0;
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    level = std::max(level, std::hypot(x.empty() ? 0 : x[i], y.empty() ? 0 : y[i]));
    vertical = std::max(vertical, z.empty() ? 0 : std::abs(z[i]));
  }
  m.bound.mean_horizontal = std::min(m.bound.mean_horizontal + level, 10.0);
  m.bound.mean_vertical = std::min(m.bound.mean_vertical + vertical, 10.0);
  StudyResult everywhere;
  for (const auto& cause : result.causes)
    if (scales_everywhere(cause.found.form->cause)) everywhere.causes.push_back(cause);
  const auto ln = added(everywhere, seen, kVarZ);
  if (!ln.empty()) scale_variances(m, std::exp(std::max(0.0, *std::max_element(ln.begin(), ln.end()))));
  return m;
}

std::string extended_model_text(const Model& model, const StudyResult& result, const Observations& seen,
                                const std::string& base_name, const std::string& version) {
  std::ostringstream text;
  text.precision(8);
  text << "# Extended by backwash study. Variances in (m/s²)², lengths in m, angles in rad.\n"
       << calibrate::model_tables(extended(model, result, seen)) << "[provenance]\nversion = '" << version
       << "'\nbase_model = '" << base_name << "'\nflights = " << seen.flights << "\nverdict = '"
       << to_string(result.verdict) << "'\n";
  for (const auto& cause : result.causes) {
    const auto& f = cause.found;
    text << "\n[[extension.term]]\ncause = '" << f.form->cause << "'\nform = '" << f.form->formula
         << "'\nscale = " << std::showpoint << f.scale << "\nheld_out_nats = " << cause.gain.held_out_nats
         << "\ntheta = [";
    for (Eigen::Index k = 0; k < f.theta.size(); ++k) text << (k ? ", " : "") << f.theta[k];
    text << "]\n";
    for (const auto& e : f.parameters)
      text << e.name << " = { value = " << e.value << ", ci95 = [" << e.low << ", " << e.high << "] }\n";
    text << std::noshowpoint;
  }
  return text.str();
}

}  // namespace backwash::study::discrepancy
