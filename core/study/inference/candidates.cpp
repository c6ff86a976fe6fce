// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

/// Fits a candidate's columns; whether every flight can be left out.
bool fitted(SearchCandidate& c, const Evidence& evidence, const std::vector<DesignColumn>& nuisance) {
  if (c.columns.size() > static_cast<std::size_t>(kMostColumns)) return false;
  c.normal = evidence.normal(c.columns, nuisance);
  if (!c.normal.solvable) return false;
  c.gain = c.normal.gain();
  c.size = evidence.size(c.columns);
  return true;
}

std::vector<DesignColumn> beside(const std::vector<DesignColumn>& columns, const std::vector<DesignColumn>& accepted,
                                 const Observations& seen) {
  std::vector<DesignColumn> nuisance = offsets(columns, seen);
  nuisance.insert(nuisance.end(), accepted.begin(), accepted.end());
  return nuisance;
}

/// Σ b of every draw may gain no more than all flights fitted together: ½ bᵀ(ΣA)⁻¹b, never less than the held-out
/// gain. Of most candidates that is already less than the largest gain so far.
class Bound {
 public:
  explicit Bound(const NormalEquations& normal) : b_(normal.total.rows(), static_cast<Eigen::Index>(normal.b.size())) {
    for (Eigen::Index f = 0; f < b_.cols(); ++f) b_.col(f) = normal.b[static_cast<std::size_t>(f)];
    SmallMatrix total = normal.total;
    total.diagonal() *= 1 - kRules.ridge;
    whole_.compute(total);
    b_ = whole_.matrixL().solve(b_).eval();
  }
  double most(const Eigen::VectorXd& signs) const {
    if (whole_.info() != Eigen::Success) return INFINITY;
    return 0.5 * (1 + kRules.bound_error) * (b_ * signs).squaredNorm();
  }

 private:
  Eigen::MatrixXd b_;  // L⁻¹ b_f
  Eigen::LLT<SmallMatrix> whole_;
};

}  // namespace

bool SearchCandidate::large_enough(const SmallVector& theta) const {
  const auto floor_of_structure = [&] {
    return columns.front().parts.front().channel == kVarX ? kRules.structure_floor_ln : kRules.structure_floor_mean;
  };
  if (!form) return theta.dot(size * theta) >= std::pow(floor_of_structure().value, 2);
  if (std::abs(theta[0]) < form->least || (form->one_sided && theta[0] < 0)) return false;
  const double square =
      form->integer_scale && form->one_sided ? theta[0] * theta[0] * size(0, 0) : theta.dot(size * theta);
  return square >= form->floor * form->floor;
}

std::optional<std::size_t> SearchCandidate::beyond_possible(const SmallVector& theta) const {
  if (!form) return std::nullopt;
  for (std::size_t k = 0; k < form->possible.size() && k < static_cast<std::size_t>(theta.size()); ++k)
    if (!form->possible[k].holds(theta[static_cast<Eigen::Index>(k)])) return k;
  return std::nullopt;
}

std::vector<DesignColumn> nuisance_of(const Form& form, const std::vector<DesignColumn>& columns,
                                      const std::vector<DesignColumn>& accepted, const Observations& seen) {
  return form.constant ? accepted : beside(columns, accepted, seen);
}

std::vector<SearchCandidate> named_candidates(const Evidence& evidence, const std::vector<DesignColumn>& accepted) {
  std::vector<SearchCandidate> all;
  const Observations& seen = evidence.seen();
  for (const Form* form : catalogue()) {
    if (why_not_tested(*form, seen)) continue;
    for (const Scale& scale : form->scales) {
      SearchCandidate c{form, form->cause(), scale, form->columns(seen.windows, scale), {}, 0, {}};
      if (fitted(c, evidence, nuisance_of(*form, c.columns, accepted, seen))) all.push_back(std::move(c));
    }
  }
  return all;
}

std::vector<SearchCandidate> structure_candidates(const Evidence& evidence, const std::vector<DesignColumn>& accepted) {
  std::vector<SearchCandidate> all;
  const Observations& seen = evidence.seen();
  for (const auto& structure : structures(seen))
    for (const auto& [name, channels] : channel_groups()) {
      SearchCandidate c;
      c.name = structure.along, c.columns = columns_in(channels, structure.functions);
      if (!fitted(c, evidence, beside(c.columns, accepted, seen))) continue;
      c.structure = {structure.along, structure.shape, structure.hz, {}, structure.further};
      all.push_back(std::move(c));
    }
  return all;
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
    found = std::move(longer), ++added;
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

std::vector<double> null_maxima(std::span<const SearchCandidate> all, const std::vector<std::vector<int>>& draws) {
  std::vector<double> maxima(draws.size(), 0);
  for (const auto& candidate : all) {
    const Bound bound(candidate.normal);
    for (std::size_t d = 0; d < draws.size(); ++d) {
      const Eigen::VectorXd signs =
          Eigen::Map<const Eigen::VectorXi>(draws[d].data(), static_cast<Eigen::Index>(draws[d].size())).cast<double>();
      if (bound.most(signs) <= maxima[d]) continue;
      const double gain = candidate.normal.gain(draws[d]);
      if (gain > maxima[d] && candidate.effect(candidate.normal.fit(draws[d]))) maxima[d] = gain;
    }
  }
  std::sort(maxima.begin(), maxima.end());
  return maxima;
}

double p_value(const std::vector<double>& sorted_null, double gain) {
  const auto above = sorted_null.end() - std::lower_bound(sorted_null.begin(), sorted_null.end(), gain);
  return (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(sorted_null.size()));
}

}  // namespace backwash::study
