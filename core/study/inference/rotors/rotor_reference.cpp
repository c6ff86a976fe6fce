// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/inference/rotors/rotor_reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/study/inference/estimate.hpp"
#include "core/study/windows/signals/distributions.hpp"

namespace backwash::study {
namespace {

double mean(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

/// Effect in standard errors that passes t with 80 % power.
double powerful(double t, double degrees) { return t + kRules.normal_80 * std::sqrt(1 + t * t / (2 * degrees)); }

using Contrast = Eigen::Array3d;  // yaw, a, b

Contrast mean_of(const std::vector<RotorContrasts>& flights) {
  Contrast sum = Contrast::Zero();
  for (const auto& f : flights) sum += Contrast(f.yaw, f.a, f.b) / static_cast<double>(flights.size());
  return sum;
}

/// Contrasts of a propeller that needs all of its command once more.
Contrast damaged(std::size_t rotor) {
  static const std::array<Contrast, 4> kOf = {Contrast(0.25, -0.5, 0), Contrast(-0.25, 0, -0.5), Contrast(0.25, 0.5, 0),
                                              Contrast(-0.25, 0, 0.5)};
  return kOf[rotor];
}

}  // namespace

const char* to_string(RotorState state) {
  constexpr const char* kNames[] = {"sound", "propeller_damage", "payload"};
  return kNames[static_cast<std::size_t>(state)];
}

const char* to_string(RotorVerdict::Kind kind) {
  static const char* const kNames[] = {"as_sound", "propeller_damage", "payload", "cannot_distinguish", "neither"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::vector<RotorContrasts> rotor_contrasts(const Observations& seen) {
  std::vector<RotorContrasts> all;
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f) {
    std::array<std::vector<double>, 4> shares;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i)
      for (std::size_t r = 0; r < 4 && seen.weight[kMotor1][i] > 0; ++r) shares[r].push_back(seen.y[kMotor1 + r][i]);
    if (shares[0].empty()) continue;
    std::array<double, 4> s;
    std::transform(shares.begin(), shares.end(), s.begin(), mean);
    all.push_back({(s[0] - s[1] + s[2] - s[3]) / 4, (s[2] - s[0]) / 2, (s[3] - s[1]) / 2});
  }
  return all;
}

std::optional<RotorVerdict> judge_rotors(const std::vector<RotorContrasts>& sound,
                                         const std::vector<RotorContrasts>& group) {
  if (static_cast<double>(sound.size()) < kRules.fewest_sound || group.empty()) return std::nullopt;
  const double n = static_cast<double>(sound.size());
  const Contrast centre = mean_of(sound);
  Contrast square = Contrast::Zero();
  for (const auto& f : sound) square += (Contrast(f.yaw, f.a, f.b) - centre).square();
  const Contrast error = (square / (n - 1) * (1 + 1 / n)).sqrt();  // of one further flight
  const Contrast t = (mean_of(group) - centre) / error;

  const double degrees = n - 1, t975 = student_975(degrees),
               needed = student_quantile(1 - kRules.rotor_level / 4, degrees);
  using Kind = RotorVerdict::Kind;
  using State = RotorState;
  RotorVerdict v{Kind::as_sound, {State::sound}, 0, 0, 0, 0, {}, t[0], t[1], t[2], 0, needed, 0};
  double left = 0;
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    const Contrast unit = damaged(rotor) / error;
    const double size = std::sqrt(unit.square().sum()), t_d = (unit * t).sum() / size;
    const double named = std::max(powerful(needed, degrees) / size, powerful(t975, degrees) / std::abs(unit[0]));
    v.minimum = std::max(v.minimum, std::expm1(named));
    const double half = t975 / size;
    v.each[rotor] = {std::expm1(t_d / size), std::expm1(t_d / size - half), std::expm1(t_d / size + half)};
    if (rotor > 0 && t_d <= v.t_d) continue;
    v.rotor = rotor + 1;
    v.t_d = t_d;
    v.d = v.each[rotor].d;
    v.low = v.each[rotor].low;
    v.high = v.each[rotor].high;
    left = t.square().sum() - t_d * t_d;
  }
  const double f = f_quantile(1 - kRules.rotor_level, 2, degrees);
  const bool twisted = std::abs(t[0]) > t975, apart = t[1] * t[1] + t[2] * t[2] > 2 * f;
  const auto told = [&v](Kind kind, std::vector<RotorState> set) {
    v.kind = kind;
    v.set = std::move(set);
  };
  if (v.t_d > needed && !twisted)
    told(Kind::cannot_distinguish, {State::propeller_damage, State::payload});
  else if (v.t_d > needed && left <= 2 * f)
    told(Kind::propeller_damage, {State::propeller_damage});
  else if (v.t_d > needed || (apart && twisted))
    told(Kind::neither, {});
  else if (apart)
    told(Kind::payload, {State::payload});
  else if (v.minimum > kRules.rotor_of_interest)
    told(Kind::cannot_distinguish, {State::sound, State::propeller_damage, State::payload});
  return v;
}

}  // namespace backwash::study
