// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rotors/sound_rotors.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/study/inference/rotors/rotor_rules.hpp"

namespace backwash::study {
namespace {

constexpr std::size_t kRotors = kLine4 - kLine1 + 1;

/// Mean of a channel over measured windows [begin, end); NaN without one.
double mean(const Observations& seen, std::size_t channel, std::size_t begin, std::size_t end) {
  double sum = 0, weight = 0;
  for (std::size_t i = begin; i < end; ++i) {
    sum += seen.weight[channel][i] * seen.y[channel][i];
    weight += seen.weight[channel][i];
  }
  return sum / weight;
}

/// Median of the flights' means of a channel, of two middle ones the nearer to the simulation: a fault in up to half of
/// them does not move it. NaN without one.
double typical_level(const Observations& seen, std::size_t channel) {
  std::vector<double> all;
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f)
    if (const double m = mean(seen, channel, seen.first[f], seen.first[f + 1]); std::isfinite(m)) all.push_back(m);
  if (all.empty()) return std::nan("");
  std::sort(all.begin(), all.end());
  const double below = all[(all.size() - 1) / 2], above = all[all.size() / 2];
  return std::abs(below) < std::abs(above) ? below : above;
}

/// Whether one rotor's line stands above the others' mean.
bool shakes(const Observations& seen) {
  std::array<double, kRotors> line{};
  for (std::size_t r = 0; r < kRotors; ++r) line[r] = mean(seen, kLine1 + r, 0, seen.windows.size());
  const double sum = std::accumulate(line.begin(), line.end(), 0.0);
  return std::any_of(line.begin(), line.end(), [&](double l) { return l - (sum - l) / 3 > kRotorRules.shaking_line; });
}

}  // namespace

std::optional<SoundRotors> sound_rotors(const Observations& reference) {
  std::vector<std::array<double, 8>> flights;
  for (std::size_t f = 0; f + 1 < reference.first.size(); ++f) {
    std::array<double, 8> one{};
    for (std::size_t k = 0; k < one.size(); ++k)
      one[k] = mean(reference, kMotor1 + k, reference.first[f], reference.first[f + 1]);
    if (std::isfinite(one.front()) || std::isfinite(one[kRotors])) flights.push_back(one);
  }
  const double n = static_cast<double>(flights.size());
  if (n < kRules.fewest_sound) return std::nullopt;
  SoundRotors sound;
  double square = 0;
  for (std::size_t k = 0; k < 2 * kRotors; ++k) {
    for (const auto& f : flights) sound.mean[k] += f[k] / n;
    for (const auto& f : flights) square += k < kRotors ? std::pow(f[k] - sound.mean[k], 2) : 0;
    if (!std::isfinite(sound.mean[k])) sound.mean[k] = 0;
  }
  const double between = std::sqrt(square / (3 * (n - 1)));
  sound.spread = std::max(kRules.motor_scatter.value, between * std::sqrt(1 + 1 / n));
  return sound;
}

SettledRotors settle_rotors(const std::optional<SoundRotors>& sound, Observations seen) {
  double unjudged = 0;
  const bool shaking = !sound && shakes(seen);
  for (const std::size_t first : {std::size_t{kMotor1}, std::size_t{kRpm1}}) {
    std::array<double, kRotors> own{};
    double most = 0;
    for (std::size_t r = 0; r < kRotors; ++r) {
      own[r] = sound ? sound->mean[first - kMotor1 + r] : typical_level(seen, first + r);
      if (!std::isfinite(own[r])) own[r] = 0;  // not measured
      most = std::max(most, std::abs(own[r]));
    }
    // What a rotor's rpm² gives differs by as much as its command, and the channel holds both.
    const double built = kRotorRules.rotor_spread * (first == kRpm1 ? std::sqrt(2.0) : 1.0);
    if (!sound && (!(most <= kRotorRules.spread_limit * built) || (first == kMotor1 && shaking))) continue;
    if (!sound) unjudged = std::max(unjudged, most);
    for (std::size_t r = 0; r < kRotors; ++r)
      for (double& y : seen.y[first + r]) y -= own[r];
  }
  return {std::move(seen), unjudged > kRules.motor_scatter ? std::optional(unjudged) : std::nullopt};
}

bool YawBalance::weight() const { return std::abs(yaw) <= kRotorRules.balance_errors * error; }
bool YawBalance::propeller() const { return std::abs(yaw - damage) <= kRotorRules.balance_errors * error; }

YawBalance yaw_balance(const std::array<double, 4>& ln_thrust, double spread) {
  std::array<double, kRotors> thrust{};
  for (std::size_t r = 0; r < kRotors; ++r) thrust[r] = std::exp(ln_thrust[r]);
  const double sum = std::accumulate(thrust.begin(), thrust.end(), 0.0);
  std::sort(thrust.begin(), thrust.end());
  // The largest and the least face each other. Four independent errors of which each counts by a quarter.
  return {2 * (thrust[3] + thrust[0]) / sum - 1, spread / 2, (thrust[3] - (sum - thrust[3]) / 3) / sum};
}

Accepted name_by_balance(Accepted cause, const Observations& rest, bool taken_out, double spread) {
  std::array<double, kRotors> ln{};
  bool motors = false, own_line = false;
  for (std::size_t k = 0; k < cause.columns.size(); ++k)
    for (const auto& [channel, x, aside] : cause.columns[k].parts) {
      motors = motors || (channel >= kMotor1 && channel <= kMotor4);
      own_line = own_line || (channel >= kLine1 && channel <= kLine4 && cause.parameters[k].low > 0);
    }
  if (!motors || own_line) return cause;
  double windows = 0;
  for (std::size_t i = 0; i < rest.windows.size(); ++i) {
    std::array<double, kRotors> added{};
    bool acts = false;
    for (std::size_t k = 0; k < cause.columns.size(); ++k)
      for (const auto& [channel, x, aside] : cause.columns[k].parts)
        if (channel >= kMotor1 && channel <= kMotor4) {
          added[channel - kMotor1] += cause.theta[static_cast<Eigen::Index>(k)] * x[i];
          acts = acts || x[i] != 0;
        }
    if (!acts || !(rest.weight[kMotor1][i] > 0)) continue;
    windows += 1;
    for (std::size_t r = 0; r < kRotors; ++r)
      ln[r] += (rest.y[kMotor1 + r][i] + (taken_out ? added[r] : 0) - ln[r]) / windows;
  }
  const YawBalance balance = yaw_balance(ln, spread);
  const Form *propeller = nullptr, *weight = nullptr;
  for (const Form* form : catalogue())
    if (form->motors_alone) (form->effect->at_rotors == AtRotors::weight ? weight : propeller) = form;
  const bool is_weight = cause.form->effect == weight->effect;
  const bool sure = balance.weight() != balance.propeller() && balance.weight() == is_weight;
  std::erase_if(cause.rivals, [&](auto& r) { return r.form->effect == propeller->effect || r.form == weight; });
  const Form* other = is_weight ? propeller : weight;
  if (!sure) cause.rivals.push_back({other->cause(), other, other->scales.front(), 0});
  return cause;
}

}  // namespace backwash::study
