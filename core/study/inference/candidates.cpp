// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

constexpr std::size_t kTogether = std::numeric_limits<std::uint8_t>::digits;  // flights whose signs are one number

/// Fits a candidate's columns; whether every flight can be left out.
bool fitted(SearchCandidate& c, const Evidence& evidence, const std::vector<DesignColumn>& nuisance) {
  if (c.columns.size() > static_cast<std::size_t>(kMostColumns)) return false;
  c.normal = evidence.normal(c.columns, nuisance);
  if (!c.normal.solvable) return false;
  c.fit = c.normal.fit();
  c.gain = c.normal.gain() - c.prior_nats(c.fit);
  c.size = evidence.size(c.columns);
  return true;
}

std::vector<DesignColumn> beside(const std::vector<DesignColumn>& columns, const std::vector<DesignColumn>& accepted,
                                 const Observations& seen) {
  std::vector<DesignColumn> nuisance = offsets(columns, seen, accepted);
  nuisance.insert(nuisance.end(), accepted.begin(), accepted.end());
  return nuisance;
}

/// A form's candidate at a scale; whether it can be fitted.
bool fit_form(SearchCandidate& c, const Evidence& evidence, const std::vector<DesignColumn>& accepted) {
  const Observations& seen = evidence.seen();
  c.columns = c.form->columns(seen.windows, c.scale);
  return fitted(c, evidence, nuisance_of(*c.form, c.columns, accepted, seen));
}

/// Whether parameters near these may be an effect, as far as rounding goes.
bool may_be_effect(const SearchCandidate& c, const SmallVector& theta) {
  const SmallVector wide = (1 + kRules.bound_error) * theta;
  const bool of_any_sign = c.form && c.form->one_sided && std::abs(wide[0]) <= kRules.bound_error * wide.norm();
  return of_any_sign || c.large_enough(wide);
}

}  // namespace

bool SearchCandidate::large_enough(const SmallVector& theta) const {
  if (!form) return theta.dot(size * theta) >= floor * floor;
  if (std::abs(theta[0]) < form->least || (form->one_sided && theta[0] < 0)) return false;
  const double square =
      form->integer_scale && form->one_sided ? theta[0] * theta[0] * size(0, 0) : theta.dot(size * theta);
  return square >= form->floor * form->floor;
}

std::optional<std::size_t> SearchCandidate::beyond_ends(const SmallVector& theta) const {
  if (!form) return std::nullopt;
  for (std::size_t k = 0; k < form->priors.size() && k < static_cast<std::size_t>(theta.size()); ++k)
    if (!form->priors[k].holds(theta[static_cast<Eigen::Index>(k)])) return k;
  return std::nullopt;
}

double SearchCandidate::prior_nats(const SmallVector& theta) const {
  return form ? form->prior_nats({theta.data(), static_cast<std::size_t>(theta.size())}) : 0;
}

std::vector<DesignColumn> nuisance_of(const Form& form, const std::vector<DesignColumn>& columns,
                                      const std::vector<DesignColumn>& accepted, const Observations& seen) {
  return form.constant ? accepted : beside(columns, accepted, seen);
}

void each_named(const Evidence& evidence, const std::vector<DesignColumn>& accepted,
                const std::function<void(SearchCandidate&&)>& take) {
  std::size_t number = 0;
  for (const Form* form : catalogue()) {
    if (why_not_tested(*form, evidence.seen())) continue;
    for (const Scale& scale : form->scales) {
      SearchCandidate c;
      c.form = form;
      c.name = form->cause();
      c.scale = scale;
      c.number = number++;
      if (fit_form(c, evidence, accepted)) take(std::move(c));
    }
  }
}

void each_structure_candidate(const Evidence& evidence, const std::vector<DesignColumn>& accepted,
                              const std::function<void(SearchCandidate&&)>& take) {
  const Observations& seen = evidence.seen();
  std::size_t number = 0;
  each_structure(seen, [&](Structure&& structure) {
    for (const auto& [name, channels] : channel_groups()) {
      SearchCandidate c;
      c.name = structure.along;
      c.columns = columns_in(channels, structure.functions);
      c.number = number++;
      c.floor = channels.front() == kVarX ? kRules.structure_floor_ln : kRules.structure_floor_mean;
      if (!fitted(c, evidence, beside(c.columns, accepted, seen))) continue;
      c.structure = {structure.along, structure.shape, structure.hz, {}, structure.further};
      take(std::move(c));
    }
  });
}

SearchCandidate outline(SearchCandidate whole) {
  whole.columns = {};
  whole.normal = {};
  return whole;
}

SearchCandidate filled(const SearchCandidate& outline, const Evidence& evidence,
                       const std::vector<DesignColumn>& accepted) {
  SearchCandidate whole = outline;
  if (whole.form) {
    fit_form(whole, evidence, accepted);
    return whole;
  }
  const std::size_t groups = channel_groups().size();
  std::size_t number = 0;
  each_structure(evidence.seen(), [&](Structure&& structure) {
    if (number++ == outline.number / groups)
      whole.columns = columns_in(channel_groups()[outline.number % groups].second, structure.functions);
  });
  fitted(whole, evidence, beside(whole.columns, accepted, evidence.seen()));
  return whole;
}

SearchCandidate with_harmonics(SearchCandidate found, const Evidence& evidence,
                               const std::vector<DesignColumn>& accepted) {
  const Channel first = found.columns.front().parts.front().channel;
  const auto group = std::find_if(channel_groups().begin(), channel_groups().end(),
                                  [&](auto& g) { return g.second.front() == first; });
  int added = 0;
  for (int n = 1;; ++n) {
    const auto functions = found.structure.further(n);
    if (functions.empty()) break;
    SearchCandidate longer = found;
    const auto columns = columns_in(group->second, functions);
    longer.columns.insert(longer.columns.end(), columns.begin(), columns.end());
    if (!fitted(longer, evidence, beside(longer.columns, accepted, evidence.seen())) ||
        longer.gain < found.gain + kRules.harmonic_nats)
      continue;
    found = std::move(longer);
    ++added;
  }
  if (added > 0) found.structure.shape += " and " + std::to_string(added) + " more";
  return found;
}

std::vector<std::vector<int>> sign_draws(std::size_t flights, int flips, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::vector<std::vector<int>> draws(static_cast<std::size_t>(flips), std::vector<int>(flights));
  for (auto& signs : draws)
    for (int& s : signs) s = (rng() >> 33) & 1 ? 1 : -1;
  return draws;
}

NullMaxima::NullMaxima(const std::vector<std::vector<int>>& draws) : draws_(draws), maxima_(draws.size(), 0) {
  const std::size_t flights = draws.empty() ? 0 : draws.front().size();
  for (std::size_t f = 0; f < flights; f += kTogether) {
    signs_.emplace_back(draws.size(), std::uint8_t{0});
    for (std::size_t d = 0; d < draws.size(); ++d)
      for (std::size_t k = 0; k < kTogether && f + k < flights; ++k)
        if (draws[d][f + k] > 0) signs_.back()[d] |= static_cast<std::uint8_t>(1u << k);
  }
}

Eigen::MatrixXd NullMaxima::sums(const NormalEquations& normal) const {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(normal.total.rows(), static_cast<Eigen::Index>(draws_.size()));
  std::array<double, 1 << kTogether> of_signs;
  for (std::size_t g = 0; g < signs_.size(); ++g)
    for (Eigen::Index row = 0; row < sums.rows(); ++row) {
      of_signs[0] = 0;
      for (std::size_t k = 0, end = 1; k < kTogether; ++k, end *= 2) {
        const std::size_t f = kTogether * g + k;
        const double b = f < normal.b.size() ? normal.b[f][row] : 0;
        for (std::size_t s = 0; s < end; ++s) {
          of_signs[end + s] = of_signs[s] + b;
          of_signs[s] -= b;
        }
      }
      for (std::size_t d = 0; d < draws_.size(); ++d) sums(row, static_cast<Eigen::Index>(d)) += of_signs[signs_[g][d]];
    }
  return sums;
}

/// Σ s b of a draw may gain no more than all flights fitted together: ½ bᵀ(ΣA)⁻¹b, never less than the held-out gain.
/// For most draws that is already less than the largest gain so far, or their fit is too small to be an effect.
void NullMaxima::add(const SearchCandidate& candidate) {
  const auto& normal = candidate.normal;
  SmallMatrix total = normal.total;
  total.diagonal() *= 1 - kRules.ridge;
  const Eigen::LLT<SmallMatrix> bounded(total);
  const Eigen::LDLT<SmallMatrix> whole(normal.total);
  const Eigen::MatrixXd all = sums(normal);
  Eigen::RowVectorXd most = Eigen::RowVectorXd::Constant(all.cols(), HUGE_VAL);
  if (bounded.info() == Eigen::Success)
    most = 0.5 * (1 + kRules.bound_error) * Eigen::MatrixXd(bounded.matrixL().solve(all)).colwise().squaredNorm();
  for (std::size_t d = 0; d < draws_.size(); ++d) {
    const auto column = static_cast<Eigen::Index>(d);
    if (most[column] <= maxima_[d] || !may_be_effect(candidate, whole.solve(SmallVector(all.col(column))))) continue;
    const double held_out = normal.gain(draws_[d]);
    if (!(held_out > maxima_[d])) continue;
    const SmallVector fit = normal.fit(draws_[d]);
    const double gain = held_out - candidate.prior_nats(fit);
    if (gain > maxima_[d] && candidate.effect(fit)) maxima_[d] = gain;
  }
}

std::vector<double> NullMaxima::sorted() const {
  auto maxima = maxima_;
  std::sort(maxima.begin(), maxima.end());
  return maxima;
}

double p_value(const std::vector<double>& sorted_null, double gain) {
  const auto above = sorted_null.end() - std::lower_bound(sorted_null.begin(), sorted_null.end(), gain);
  return (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(sorted_null.size()));
}

}  // namespace backwash::study
