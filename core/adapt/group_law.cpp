// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/group_law.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

namespace backwash::adapt {
namespace {

constexpr double kLongerTau = 8;  // of tau_low: beyond it every form's innovations are smaller than at tau_low
constexpr int kTaus = 4;          // of them, in equal ratios
constexpr int kMany = 24;         // samples in a long mean: more change it by less than a hundredth

/// Variance of a group's mean and its covariance with that of the group before, per unit of the gusts' variance.
struct GroupMoments {
  double own = 0, before = 0;
};
GroupMoments moments(GustForm form, int samples, double seconds, double tau_s) {
  const double step = seconds / samples, n2 = static_cast<double>(samples) * samples;
  GroupMoments m;
  for (int lag = -(samples - 1); lag < samples; ++lag) {
    const double pairs = samples - std::abs(lag);
    m.own += pairs / n2 * correlation(form, std::abs(lag) * step, tau_s);
    m.before += pairs / n2 * correlation(form, (samples + lag) * step, tau_s);
  }
  return m;
}

double innovation(const GroupMoments& m, double rho) { return (1 + rho * rho) * m.own - 2 * rho * m.before; }

/// A group in the tables.
struct Kind {
  int samples;
  double seconds, rho;
};

/// The smallest and the largest innovation of the forms, τ from low to high.
std::pair<double, double> range(const Kind& kind, std::span<const GustForm> forms, double low, double high) {
  std::pair<double, double> found{HUGE_VAL, 0};
  for (const GustForm form : forms)
    for (int k = 0; k < kTaus; ++k) {
      const double tau = low * std::pow(high / low, k / (kTaus - 1.0));
      const double variance = innovation(moments(form, kind.samples, kind.seconds, tau), kind.rho);
      found = {std::min(found.first, variance), std::max(found.second, variance)};
    }
  return found;
}

}  // namespace

double correlation(GustForm form, double lag_s, double tau_s) {
  if (!(lag_s > 0)) return 1;
  if (form == GustForm::first_order) return std::exp(-lag_s / tau_s);
  if (form == GustForm::second_order) return (1 + 2 * lag_s / tau_s) * std::exp(-2 * lag_s / tau_s);
  // von Kármán: 2^{2/3}/Γ(1/3) x^{1/3} K_{1/3}(x), x = t/T, and τ/T = √π Γ(5/6)/Γ(1/3).
  const double x = lag_s / tau_s * std::sqrt(std::numbers::pi) * std::tgamma(5.0 / 6) / std::tgamma(1.0 / 3);
  constexpr double kNothingLeft = 50;
  if (x > kNothingLeft) return 0;
  return std::pow(2, 2.0 / 3) / std::tgamma(1.0 / 3) * std::cbrt(x) * std::cyl_bessel_k(1.0 / 3, x);
}

GroupLaw::GroupLaw(double tau_low_s, double tau_high_s, std::optional<GustForm> form, MeansOf means)
    : group_s_((means == MeansOf::pairs          ? kPaired
                : form == GustForm::second_order ? kBlock
                                                 : kGroup) *
               tau_low_s),
      block_s_(kBlock * tau_low_s) {
  const GustForm assumed = form.value_or(GustForm::first_order);
  const auto forms = form ? std::span<const GustForm>(&assumed, 1) : std::span<const GustForm>(kGustForms);
  for (int n = 0; n < kSamples; ++n)
    for (int k = 0; k < kLengths; ++k) {
      const double seconds = group_s_ * std::exp(kLnShortest + (kLnLongest - kLnShortest) * k / (kLengths - 1));
      const int samples = means == MeansOf::pairs && n + 1 == kSamples ? kMany : n + 1;
      const auto m = moments(assumed, samples, seconds, tau_low_s);
      const double rho = means == MeansOf::pairs ? 1 : m.before / m.own;
      const Kind kind{samples, seconds, rho};
      table_[static_cast<std::size_t>(n)][static_cast<std::size_t>(k)] = {
          rho, range(kind, forms, tau_low_s, kLongerTau * tau_low_s).second,
          range(kind, forms, tau_low_s, tau_high_s).first};
    }
}

GroupLaw::Innovation GroupLaw::at(int samples, double seconds) const noexcept {
  const auto& row = table_[static_cast<std::size_t>(std::clamp(samples, 1, kSamples) - 1)];
  const double place = (std::log(seconds / group_s_) - kLnShortest) / (kLnLongest - kLnShortest) * (kLengths - 1);
  const double inside = std::clamp(place, 0.0, kLengths - 1.0);
  const auto low = std::min(static_cast<std::size_t>(inside), static_cast<std::size_t>(kLengths - 2));
  const double share = inside - static_cast<double>(low);
  const Innovation &a = row[low], &b = row[low + 1];
  return {a.rho + share * (b.rho - a.rho), a.most + share * (b.most - a.most), a.least + share * (b.least - a.least)};
}

}  // namespace backwash::adapt
