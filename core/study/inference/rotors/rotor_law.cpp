// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rotors/rotor_law.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/study/inference/rotors/rotor_rules.hpp"
#include "core/study/windows/signals/distributions.hpp"

namespace backwash::study {
namespace {

constexpr std::size_t kRotors = 4, kHypotheses = 3;
/// Leads of every hypothesis over one of them, and last of contrasts that are free.
using Leads = std::array<double, kHypotheses + 1>;

/// Greatest ln likelihood of each hypothesis, less that of contrasts which are free, and where it is.
struct Fit {
  std::array<double, kHypotheses> nats{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  std::array<double, kRotors> of_rotor{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, need{}, error{};  // ln (1 + d)
  std::size_t rotor = 0;
  const Pairing* of_weight = nullptr;

  Leads leads(std::size_t over) const {
    Leads all;
    for (std::size_t a = 0; a < kHypotheses; ++a) all[a] = nats[a] - nats[over];
    all[kHypotheses] = -nats[over];
    return all;
  }
};

/// Thrusts 1 ± x of one pair and 1 ± y of the other twist nothing; their logarithms seem to.
double twist_of_weight(const Contrasts& c) { return std::log(std::cosh(c[2]) / std::cosh(c[1])) / 2; }

/// Contrasts of a propeller that needs e times its command.
Contrasts damaged(const Pairing& pairing, std::size_t rotor) {
  Eigen::Array4d ln = Eigen::Array4d::Zero();
  ln[static_cast<Eigen::Index>(rotor)] = 1;
  return contrasts_of(ln, pairing);
}

/// What of all values is passed at the level.
double passed_by_chance(std::vector<double>& values) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>((1 - kRules.rotor_level) * static_cast<double>(values.size()));
  std::ranges::nth_element(values, at);
  return *at;
}

/// ln likelihood of lines that are alike, and of those beside a rotor whose own stands above the others' mean.
double alike(const Eigen::Array4d& line) { return -(line - line.mean()).square().sum() / 2; }
double alike_beside(const Eigen::Array4d& line, std::size_t rotor) {
  const double own = line[static_cast<Eigen::Index>(rotor)], rest = (line.sum() - own) / 3;
  if (own <= rest) return alike(line);
  return ((own - rest) * (own - rest) - (line - rest).square().sum()) / 2;
}

/// What a hypothesis is fitted as: ln shares, and the need of its damage.
struct Centre {
  Eigen::Array4d shares = Eigen::Array4d::Zero();
  double need = 0;
};
Centre of_damage(std::size_t rotor, double need) {
  return {shares_of(need * damaged(kPairings[0], rotor), kPairings[0]), need};
}

class Likelihood {
 public:
  Likelihood(const RotorDifference& of, const SoundScatter& sound)
      : pairings_(of.pairings), sound_(sound), lined_((of.line != 0).any()) {}

  Fit fit(const Eigen::Array4d& shares, const Eigen::Array4d& line) const {
    Fit best;
    const double lines = alike(line);
    for (const Pairing& pairing : pairings_) {
      const Contrasts c = contrasts_of(shares, pairing);
      best.nats[0] = std::max(best.nats[0], ln(c) + lines);
      const double weight = ln({c[0] - twist_of_weight(c), 0, 0}) + lines;
      if (weight > best.nats[2] || !best.of_weight) {
        best.nats[2] = weight;
        best.of_weight = &pairing;
      }
      for (std::size_t r = 0; r < kRotors; ++r) {
        const auto [need, error] = needed(c, damaged(pairing, r));
        const double all = ln_damage(c, damaged(pairing, r), std::max(0.0, need)) + alike_beside(line, r);
        if (all <= best.of_rotor[r]) continue;
        best.of_rotor[r] = all;
        best.need[r] = need;
        best.error[r] = error;
      }
    }
    best.rotor = static_cast<std::size_t>(std::ranges::max_element(best.of_rotor) - best.of_rotor.begin());
    best.nats[1] = best.of_rotor[best.rotor];
    return best;
  }

  /// Calls `take` with the shares and lines that a craft shows about a centre by chance.
  template <typename F>
  void draw(const Centre& centre, double draws, F take) const {
    std::mt19937_64 rng(1);
    std::student_t_distribution<double> student(sound_.degrees);
    std::normal_distribution<double> normal;
    for (double k = 0; k < draws; ++k) {
      Contrasts c;
      for (double& x : c) x = student(rng);
      c[0] *= widened(centre.need);
      Eigen::Array4d line = Eigen::Array4d::Zero();
      for (double& x : line) x = lined_ ? normal(rng) : 0;
      take(centre.shares + shares_of(c * sound_.scale, pairings_.front()), line);
    }
  }

  /// Leads over a hypothesis that draws about its centre pass by chance.
  Leads by_chance(std::size_t truth, const Centre& centre, double draws) const {
    std::array<std::vector<double>, kHypotheses + 1> all;
    draw(centre, draws, [&](const Eigen::Array4d& shares, const Eigen::Array4d& line) {
      const Leads leads = fit(shares, line).leads(truth);
      for (std::size_t a = 0; a < all.size(); ++a) all[a].push_back(leads[a]);
    });
    Leads passed;
    std::ranges::transform(all, passed.begin(), passed_by_chance);
    return passed;
  }

  Centre centre(std::size_t hypothesis, const Fit& fit, const Eigen::Array4d& shares) const {
    if (hypothesis == 0) return {};
    if (hypothesis == 1) return of_damage(fit.rotor, std::max(0.0, fit.need[fit.rotor]));
    Contrasts c = contrasts_of(shares, *fit.of_weight);
    c[0] = twist_of_weight(c);
    return {shares_of(c, *fit.of_weight)};
  }

 private:
  double ln(const Contrasts& left) const {
    return -(sound_.degrees + 1) / 2 * (1 + (left / sound_.scale).square() / sound_.degrees).log().sum();
  }
  double ln_damage(const Contrasts& c, const Contrasts& unit, double need) const {
    const Contrasts left = c - need * unit;
    const double wide = widened(need);
    return ln({left[0] / wide, left[1], left[2]}) - std::log(wide);
  }
  /// By how much the twist of a damage scatters more than that of a sound craft: of its torque little is known.
  double widened(double need) const { return std::hypot(1, kRotorRules.torque_spread * need / 4 / sound_.scale[0]); }

  /// The need of a rotor, of either sign, and its standard error: least squares by the weights that the likelihood
  /// gives.
  std::pair<double, double> needed(const Contrasts& c, const Contrasts& unit) const {
    double need = 0, information = 0;
    Contrasts weight = 1 / sound_.scale.square();
    for (int turn = 0; turn < kRotorRules.need_turns; ++turn) {
      information = (weight * unit.square()).sum();
      need = (weight * unit * c).sum() / information;
      Contrasts scale = sound_.scale;
      scale[0] *= widened(need);
      weight = (1 + 1 / sound_.degrees) / (scale.square() + (c - need * unit).square() / sound_.degrees);
    }
    return {need, 1 / std::sqrt(information)};
  }

  std::span<const Pairing> pairings_;
  SoundScatter sound_;
  bool lined_;
};

/// The sound craft is a damage and a weight of nothing: it excludes neither.
bool excluded(const Leads& leads, const Leads& by_chance) {
  return !std::equal(leads.begin() + 1, leads.end(), by_chance.begin() + 1, std::less_equal{});
}

}  // namespace

const char* to_string(RotorState state) {
  constexpr const char* kNames[] = {"sound", "propeller_damage", "payload"};
  return kNames[static_cast<std::size_t>(state)];
}

bool RotorsTold::holds(RotorState state) const { return std::ranges::find(set, state) != set.end(); }

Contrasts contrasts_of(const Eigen::Array4d& ln, const Pairing& pairing) {
  const auto s = [&](std::size_t k) { return ln[static_cast<Eigen::Index>(pairing[k])]; };
  return {(s(0) + s(1) - s(2) - s(3)) / 4, (s(1) - s(0)) / 2, (s(3) - s(2)) / 2};
}

Eigen::Array4d shares_of(const Contrasts& c, const Pairing& pairing) {
  Eigen::Array4d shares;
  const std::array<double, kRotors> of = {c[0] - c[1], c[0] + c[1], -c[0] - c[2], -c[0] + c[2]};
  for (std::size_t k = 0; k < of.size(); ++k) shares[static_cast<Eigen::Index>(pairing[k])] = of[k];
  return shares;
}

RotorsTold told_of(const RotorDifference& difference, const SoundScatter& sound) {
  const Likelihood likelihood(difference, sound);
  const Fit fit = likelihood.fit(difference.ln, difference.line);
  RotorsTold told;
  told.rotor = fit.rotor;
  for (std::size_t h = 0; h < kHypotheses; ++h) {
    const Leads leads = fit.leads(h);
    const Leads chance = likelihood.by_chance(h, likelihood.centre(h, fit, difference.ln), kRotorRules.rotor_draws);
    if (!excluded(leads, chance)) told.set.push_back(static_cast<RotorState>(h));
    if (h > 0) continue;
    told.lead = leads[1];
    told.needed = chance[1];
  }
  const double t = student_quantile(1 - kRules.tail, sound.degrees);
  for (std::size_t r = 0; r < kRotors; ++r) {
    const double half = t * fit.error[r];
    told.each[r] = {std::expm1(fit.need[r]), std::expm1(fit.need[r] - half), std::expm1(fit.need[r] + half)};
  }
  const Eigen::Array4d thrust = likelihood.centre(2, fit, difference.ln).shares.exp();
  Eigen::Index heavy = 0;
  told.weight = thrust.maxCoeff(&heavy) / thrust.mean() - 1;
  told.heavy = static_cast<std::size_t>(heavy);
  return told;
}

bool may_need(const Eigen::Array4d& ln, double need) {
  const auto square = [](const Eigen::Array4d& left) {
    return left.square().sum() + std::pow(kRules.motor_scatter, 2);
  };
  double least = HUGE_VAL;
  for (std::size_t r = 0; r < kRotors; ++r) least = std::min(least, square(ln - of_damage(r, need).shares));
  return 3 * std::log(least / square(ln)) / 2 <= kRules.rival_nats;
}

double least_damage(const SoundScatter& sound) {
  const Likelihood likelihood({Eigen::Array4d::Zero()}, sound);
  const double over_sound = likelihood.by_chance(0, {}, kRotorRules.rotor_draws)[1];
  const auto power = [&](double need) {
    const Centre damage = of_damage(0, need);
    const Fit as_weight = likelihood.fit(damage.shares, Eigen::Array4d::Zero());
    const double over_weight =
        likelihood.by_chance(2, likelihood.centre(2, as_weight, damage.shares), kRotorRules.rotor_draws)[1];
    double named = 0;
    likelihood.draw(damage, kRotorRules.rotor_draws, [&](const auto& shares, const auto& line) {
      const Fit fit = likelihood.fit(shares, line);
      named += fit.leads(0)[1] > over_sound && fit.leads(2)[1] > over_weight ? 1 : 0;
    });
    return named / kRotorRules.rotor_draws;
  };
  double low = 0, high = kRotorRules.largest_need;
  for (int i = 0; i < kRotorRules.need_turns; ++i) {
    const double middle = (low + high) / 2;
    (power(middle) >= kRules.power ? high : low) = middle;
  }
  return std::expm1(high);
}

}  // namespace backwash::study
