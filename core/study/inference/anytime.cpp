// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/anytime.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/inference/rules.hpp"

namespace backwash::study {
namespace {

double log_det(const SmallMatrix& m) { return m.ldlt().vectorD().array().log().sum(); }

/// ln of the mean of e^x.
double log_mean(const std::vector<double>& x) {
  const double most = *std::ranges::max_element(x);
  double sum = 0;
  for (const double value : x) sum += std::exp(value - most);
  return most + std::log(sum / static_cast<double>(x.size()));
}

/// Windows first … end as observations of their own: one unit.
Observations slice(const Observations& seen, std::size_t unit) {
  const std::size_t first = seen.units.first[unit], end = seen.units.first[unit + 1];
  const auto at = [](auto& of, std::size_t k) { return of.begin() + static_cast<std::ptrdiff_t>(k); };
  Observations one;
  one.flights = seen.flights;
  one.row_period = seen.row_period;
  one.missing = seen.missing;
  one.windows.assign(at(seen.windows, first), at(seen.windows, end));
  one.first = {0, end - first};
  one.units.first = one.first;
  for (std::size_t c = 0; c < kChannels; ++c) {
    one.y[c].assign(at(seen.y[c], first), at(seen.y[c], end));
    one.weight[c].assign(at(seen.weight[c], first), at(seen.weight[c], end));
  }
  return one;
}

/// The first `units` alone.
Observations before(const Observations& seen, std::size_t units) {
  Observations some = seen;
  const std::size_t end = seen.units.first[units];
  some.windows.resize(end);
  some.units.first.resize(units + 1);
  for (std::size_t c = 0; c < kChannels; ++c) {
    some.y[c].resize(end);
    some.weight[c].resize(end);
  }
  return some;
}

/// θ̂ − θ₀ where the first parameter has to be `bound`.
SmallVector moved_to(double bound, const SmallVector& theta, const SmallMatrix& information) {
  const SmallVector along = information.ldlt().solve(SmallVector(SmallVector::Unit(theta.size(), 0)));
  return along * ((theta[0] - bound) / along[0]);
}

/// θ̂ − θ₀ with θ₀ᵀ size θ₀ = floor²: (information + λ size) θ₀ = information θ̂.
SmallVector moved_into(double floor, const SmallVector& theta, const SmallMatrix& information,
                       const SmallMatrix& size) {
  double low = -kRules.null_range, high = kRules.null_range;  // ln λ, times the information over the size
  const double unit = information.trace() / size.trace();
  SmallVector inside = SmallVector::Zero(theta.size());
  for (int i = 0; i < kRules.null_turns; ++i) {
    const double middle = (low + high) / 2;
    const SmallMatrix whole = information + std::exp(middle) * unit * size;
    const SmallVector at = whole.ldlt().solve(SmallVector(information * theta));
    if (at.dot(size * at) > floor * floor)
      low = middle;
    else {
      high = middle;
      inside = at;
    }
  }
  return theta - inside;
}

}  // namespace

void FlightScores::add(const SmallMatrix& A, const SmallVector& b) {
  const Eigen::SelfAdjointEigenSolver<SmallMatrix> eigen(A);
  const double most = eigen.eigenvalues().maxCoeff();
  if (!(most > 0)) return;
  if (empty()) {
    if (eigen.eigenvalues().minCoeff() < kRules.spanned * most) return;  // Λ must know every parameter
    prior_ = kRules.prior_flights * A;
    M_ = SmallMatrix::Zero(A.rows(), A.rows());
    S_ = SmallVector::Zero(A.rows());
  }
  for (Eigen::Index k = 0; k < A.rows(); ++k) {
    const double value = eigen.eigenvalues()[k];
    if (value < kRules.ridge * most) continue;
    Q_ += std::pow(eigen.eigenvectors().col(k).dot(b), 2) / value;
    dims_ += 1;
  }
  M_ += A;
  S_ += b;
}

SmallVector FlightScores::fit() const { return M_.ldlt().solve(S_); }

double FlightScores::log_bayes_factor(const SmallVector& off) const {
  const SmallMatrix with_prior = prior_ + M_;
  const SmallVector score = M_ * off;
  const double left = std::max(0.0, Q_ - S_.dot(fit())) + off.dot(score);
  const double determinant = 0.5 * (log_det(prior_) - log_det(with_prior));
  if (!(left > 0)) return determinant;
  const double explained = score.dot(with_prior.ldlt().solve(score));
  return determinant - 0.5 * dims_ * std::log1p(-std::min(explained / left, std::nextafter(1.0, 0)));
}

SmallVector off_no_effect(const Form& form, const SmallVector& theta, const SmallMatrix& information,
                          const SmallMatrix& size) {
  SmallVector none = SmallVector::Zero(theta.size());
  if (form.one_sided && theta[0] <= 0) return none;
  double least = form.least;
  const bool first_alone = form.integer_scale && form.one_sided;
  if ((first_alone || theta.size() == 1) && size(0, 0) > 0) least = std::max(least, form.floor / std::sqrt(size(0, 0)));
  if (std::abs(theta[0]) <= least) return none;
  SmallVector off = moved_to(theta[0] > 0 ? least : -least, theta, information);
  if (first_alone || theta.size() == 1) return off;
  if (theta.dot(size * theta) <= form.floor * form.floor) return none;
  const SmallVector inwards = moved_into(form.floor, theta, information, size);
  const auto distance = [&](const SmallVector& v) { return v.dot(information * v); };
  return distance(inwards) < distance(off) ? inwards : off;
}

double log_calibrated(double log_e) {
  if (!(log_e > kRules.ridge)) return -std::log(2);
  return std::log(-std::expm1(-log_e) - log_e * std::exp(-log_e)) + log_e - 2 * std::log(log_e);
}

void Anytime::add(const Evidence& scatter, const Observations& seen, std::size_t unit) {
  const Observations flight = slice(seen, unit);
  if (flight.windows.empty()) return;
  const Evidence evidence = scatter.next(flight);
  std::size_t k = 0;
  for (const Form* form : catalogue()) {
    for (const Scale& scale : form->scales) {
      Bet& bet = bets_[k++];
      if (why_not_tested(*form, flight)) continue;
      Scale own = scale;
      if (form->anchor && bet.anchor.empty()) bet.anchor = form->anchor(flight.windows);
      own.anchor = bet.anchor;
      const auto columns = form->columns(flight.windows, own);
      const NormalEquations normal =
          evidence.normal(columns, form->constant ? std::vector<DesignColumn>{} : offsets(columns, flight));
      if (!normal.excited) continue;
      bet.scores.add(normal.total, normal.b.front());
      const SmallMatrix size = evidence.size(columns);
      bet.size = bet.flights > 0 ? SmallMatrix(bet.size + size) : size;
      bet.flights += 1;
    }
  }
}

double Anytime::highest(const Form& form, Bet& bet) {
  if (!bet.scores.empty()) {
    const auto off = off_no_effect(form, bet.scores.fit(), bet.scores.information(), bet.size / bet.flights);
    bet.highest = std::max(bet.highest, bet.scores.log_bayes_factor(off));
  }
  return log_calibrated(bet.highest);
}

void Anytime::look(const Observations& seen) {
  if (bets_.empty())
    for (const Form* form : catalogue()) bets_.resize(bets_.size() + form->scales.size());
  const std::size_t units = seen.units.size();
  Observations settled = seen;
  if (static_cast<double>(units) >= kRules.first_look) {
    if (!sound_) sound_ = sound_rotors(before(seen, static_cast<std::size_t>(kRules.first_look)));
    if (sound_) settle_rotors(sound_, settled);
    for (; units_ < units; ++units_) {
      const std::size_t known = std::max<std::size_t>(units_, static_cast<std::size_t>(kRules.first_look));
      const Observations past = before(settled, known);
      add(Evidence(past), settled, units_);
    }
  }
  std::vector<double> by_cause;
  std::size_t k = 0;
  for (const Effect& effect : effects()) {
    std::vector<double> calibrated;
    for (const Form& form : effect.forms)
      for (std::size_t scale = 0; scale < form.scales.size(); ++scale) calibrated.push_back(highest(form, bets_[k++]));
    by_cause.push_back(log_mean(calibrated));
    causes_[effect.name] = by_cause.back() - std::log(static_cast<double>(effects().size()));
  }
  log_e_.push_back(log_mean(by_cause));
}

}  // namespace backwash::study
