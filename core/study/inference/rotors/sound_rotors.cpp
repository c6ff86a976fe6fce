// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rotors/sound_rotors.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/study/inference/rotors/rotor_rules.hpp"
#include "core/study/windows/signals/distributions.hpp"

namespace backwash::study {
namespace {

/// Four channels over windows that measure all of them.
struct Sums {
  double windows = 0;
  Eigen::Array4d value = Eigen::Array4d::Zero(), square = value;

  void add(const Observations& seen, std::size_t first, std::size_t i) {
    Eigen::Array4d y;
    for (std::size_t r = 0; r < 4; ++r) {
      if (!(seen.weight[first + r][i] > 0)) return;
      y[static_cast<Eigen::Index>(r)] = seen.y[first + r][i];
    }
    windows += 1;
    value += y;
    square += y.square();
  }
  Eigen::Array4d mean() const { return value / windows; }
  /// Variance of the mean of one channel, the four alike.
  double error2() const { return windows > 1 ? (square / windows - mean().square()).mean() / (windows - 1) : 0; }
};

Sums sums_of(const Observations& seen, std::size_t first, std::size_t begin, std::size_t end) {
  Sums sums;
  for (std::size_t i = begin; i < end; ++i) sums.add(seen, first, i);
  return sums;
}

/// Median of the flights' means of a channel, of two middle ones the nearer to 0: a fault in up to half of them does
/// not move it. NaN without one.
double typical_level(const Observations& seen, std::size_t channel) {
  std::vector<double> all;
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f) {
    double sum = 0, weight = 0;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) {
      sum += seen.weight[channel][i] * seen.y[channel][i];
      weight += seen.weight[channel][i];
    }
    if (weight > 0) all.push_back(sum / weight);
  }
  if (all.empty()) return std::nan("");
  std::sort(all.begin(), all.end());
  const double below = all[(all.size() - 1) / 2], above = all[all.size() / 2];
  return std::abs(below) < std::abs(above) ? below : above;
}

/// Of four channels; NaN where one is not measured.
Eigen::Array4d typical_levels(const Observations& seen, std::size_t first) {
  Eigen::Array4d levels;
  for (std::size_t r = 0; r < 4; ++r) levels[static_cast<Eigen::Index>(r)] = typical_level(seen, first + r);
  return levels;
}

std::vector<Eigen::Array4d> by_flight(const Observations& seen, std::size_t first) {
  std::vector<Eigen::Array4d> all;
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f)
    if (const Sums sums = sums_of(seen, first, seen.first[f], seen.first[f + 1]); sums.windows > 0)
      all.push_back(sums.mean());
  return all;
}

/// Contrasts of independent rotors that scatter by 1.
const Contrasts kOfOne(0.5, std::sqrt(0.5), std::sqrt(0.5));
/// By what those of one sound craft scatter between sessions.
const Contrasts kSession(kRotorRules.session_twist, kRotorRules.session_pairs, kRotorRules.session_pairs);

/// What flights of one craft scatter by about the level of their group, and session_twist and session_pairs together.
SoundScatter between_flights(const std::vector<std::vector<Eigen::Array4d>>& groups) {
  double degrees = kRotorRules.session_degrees;
  Contrasts square = degrees * kSession.square();
  for (const auto& flights : groups) {
    const Eigen::Array4d centre = mean_of(flights);
    for (const auto& f : flights) square += contrasts_of(f - centre, kPairings[0]).square();
    degrees += static_cast<double>(flights.size()) - 1;
  }
  return {(square / degrees).sqrt(), degrees};
}

void take_out(const Eigen::Array4d& own, std::size_t first, Observations& seen) {
  for (std::size_t r = 0; r < 4; ++r)
    for (double& y : seen.y[first + r]) y -= own[static_cast<Eigen::Index>(r)];
}

RotorLevel level_of(const Eigen::Array4d& ln, const Eigen::Array4d& line, SoundScatter sound, double error2,
                    const Observations& seen) {
  sound.scale = (sound.scale.square() + error2 * kOfOne.square()).sqrt();
  RotorLevel level{{ln - ln.mean()}, sound};
  if (line.isFinite().all()) level.difference.line = line / kRotorRules.line_scatter.value;
  if (!seen.sound_rotors) level.difference.pairings = kPairings;
  return level;
}

/// Of all windows; nothing without motor commands.
std::optional<RotorLevel> level_of(const Observations& seen) {
  const Sums all = sums_of(seen, kMotor1, 0, seen.windows.size());
  if (!(all.windows > 0)) return std::nullopt;
  return level_of(typical_levels(seen, kMotor1), typical_levels(seen, kLine1),
                  seen.sound_rotors.value_or(built_rotors()), all.error2(), seen);
}

}  // namespace

Eigen::Array4d mean_of(const std::vector<Eigen::Array4d>& flights) {
  Eigen::Array4d sum = Eigen::Array4d::Zero();
  for (const auto& f : flights) sum += f / static_cast<double>(flights.size());
  return sum;
}

std::vector<Eigen::Array4d> rotor_shares(const Observations& seen) { return by_flight(seen, kMotor1); }

std::optional<SoundRotors> sound_rotors(const Observations& reference) {
  SoundRotors sound;
  sound.flights = rotor_shares(reference);
  const auto rpm = by_flight(reference, kRpm1);
  if (static_cast<double>(std::max(sound.flights.size(), rpm.size())) < kRules.fewest_sound) return std::nullopt;
  sound.motor = mean_of(sound.flights);
  sound.rpm = mean_of(rpm);
  return sound;
}

SoundScatter built_rotors() { return {kRotorRules.built_scatter * kOfOne, kRotorRules.session_degrees}; }

SoundScatter scatter_of(const std::vector<Eigen::Array4d>& flights) {
  SoundScatter sound = between_flights({flights});
  sound.scale *= std::sqrt(1 + 1 / static_cast<double>(flights.size()));
  return sound;
}

std::optional<RotorsTold> rotors_of(const Observations& seen) {
  const auto level = level_of(seen);
  return level ? std::optional(told_of(level->difference, level->sound)) : std::nullopt;
}

std::optional<RotorsTold> rotors_of(const Observations& seen, const std::vector<double>& amount) {
  std::array<Sums, 2> motors;                        // without it, with it
  std::vector<std::vector<Eigen::Array4d>> each(2);  // flight by itself
  double sessions = 0;                               // with it
  std::array<std::array<double, 4>, 2> line{}, lines{};
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f) {
    std::array<Sums, 2> own;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) {
      const std::size_t k = amount[i] > 0 ? 1 : 0;
      own[k].add(seen, kMotor1, i);
      motors[k].add(seen, kMotor1, i);
      if (k == 1 && (i == 0 || !(amount[i - 1] > 0))) sessions += 1;
      for (std::size_t r = 0; r < 4; ++r) {
        line[k][r] += seen.weight[kLine1 + r][i] * seen.y[kLine1 + r][i];
        lines[k][r] += seen.weight[kLine1 + r][i];
      }
    }
    for (std::size_t k = 0; k < 2; ++k)
      if (own[k].windows > 0) each[k].push_back(own[k].mean());
  }
  if (each[0].empty() || each[1].empty()) return std::nullopt;
  Eigen::Array4d shakes;
  for (std::size_t r = 0; r < 4; ++r)
    shakes[static_cast<Eigen::Index>(r)] = line[1][r] / lines[1][r] - line[0][r] / lines[0][r];
  SoundScatter sound = between_flights(each);
  sound.scale *= std::sqrt(1 / sessions + 1 / static_cast<double>(each[0].size()));
  const RotorLevel level =
      level_of(motors[1].mean() - motors[0].mean(), shakes, sound, motors[0].error2() + motors[1].error2(), seen);
  return told_of(level.difference, level.sound);
}

bool may_be_one_rotor(const RotorLevel& level, double lost) {
  return level.maybe_damaged && lost > 0 && lost < 1 &&
         may_need(level.difference.ln, std::log1p(4 * lost / (1 - lost)));
}

std::optional<RotorState> rotor_state(const Form& form) {
  if (std::ranges::find(form.needs, Source::motors) == form.needs.end()) return std::nullopt;
  if (form.effect->at_rotors == AtRotors::weight) return RotorState::payload;
  if (form.effect->at_rotors == AtRotors::propeller) return RotorState::propeller_damage;
  return std::nullopt;
}

void name_rotors(Accepted& cause, const RotorsTold& told) {
  const auto own = rotor_state(*cause.form);
  if (!own) return;
  std::erase_if(cause.rivals, [](auto& r) { return rotor_state(*r.form).has_value(); });
  for (const Form* form : catalogue()) {
    const auto other = rotor_state(*form);
    if (!other || other == own || (told.holds(*own) && !told.holds(*other))) continue;
    cause.rivals.push_back({form->cause(), form, form->scales.front(), 0});
    return;
  }
}

SettledRotors settle_rotors(const std::optional<SoundRotors>& sound, Observations seen) {
  if (sound) {
    take_out(sound->motor, kMotor1, seen);
    take_out(sound->rpm, kRpm1, seen);
    if (!sound->flights.empty()) seen.sound_rotors = scatter_of(sound->flights);
  }
  SettledRotors settled;
  settled.level = level_of(seen);
  settled.seen = std::move(seen);
  const auto leave_out = [&](std::size_t first) {
    const Eigen::Array4d own = typical_levels(settled.seen, first);
    take_out(own, first, settled.seen);
    const double most = own.abs().maxCoeff();
    if (!sound && most > kRules.motor_scatter) settled.unjudged = std::max(settled.unjudged, most);
  };
  if (settled.level) {
    const RotorsTold told = told_of(settled.level->difference, settled.level->sound);
    settled.level->maybe_damaged = !sound || told.holds(RotorState::propeller_damage);
    if (told.holds(RotorState::sound)) leave_out(kMotor1);
  }
  // What a rotor's rpm² gives differs by as much as its command, and the channel holds both.
  const double limit = std::sqrt(2.0) * kRotorRules.built_scatter *
                       student_quantile(1 - kRules.rotor_level / 4, kRotorRules.session_degrees);
  if (!sound && typical_levels(settled.seen, kRpm1).abs().maxCoeff() <= limit) leave_out(kRpm1);
  return settled;
}

}  // namespace backwash::study
