// SPDX-License-Identifier: BSD-3-Clause
#include "tests/gusts/flights.hpp"

#include <cmath>
#include <map>

namespace gusts {
namespace {

using backwash::AirClass;
using backwash::adapt::Adaptation;
using backwash::adapt::Gusts;

/// Tables are made once for each interval.
Adaptation fresh(const Gusts& gusts) {
  thread_local std::map<std::array<double, 6>, Adaptation> known;
  const std::array<double, 6> key{gusts.tau_low_s,       gusts.tau_high_s,
                                  gusts.mean_horizontal, gusts.mean_vertical,
                                  gusts.noise.x(),       gusts.form ? static_cast<double>(*gusts.form) : -1};
  return known.try_emplace(key, gusts).first->second;
}

}  // namespace

Learned fly(const Trial& trial) {
  GustAir air(trial.form, trial.tau_s, trial.bursts, trial.seed);
  Gusts gusts;
  gusts.tau_low_s = trial.tau_low_s, gusts.tau_high_s = trial.tau_high_s;
  if (trial.form_told) gusts.form = static_cast<backwash::adapt::GustForm>(trial.form);
  gusts.mean_horizontal = gusts.mean_vertical = trial.push;
  gusts.noise = Vec3::Constant(trial.noise * trial.noise);
  Adaptation adaptation = fresh(gusts);
  const AirClass acting = trial.walls_only ? AirClass::wall : AirClass::free_air;
  const Vec3 free_air(0.004, 0.004, 0.006), wall(0.06, 0.03, 0.035);
  Learned learned;
  double next = 0, last = 0, exposed = 0;
  Vec3 gust = Vec3::Zero();
  for (int k = 0; k * GustAir::kStep < trial.seconds; ++k) {
    const double t = k * GustAir::kStep;
    gust = air.step();
    if (t + GustAir::kStep / 2 < next) continue;
    next += (1 + trial.jitter * (2 * air.uniform() - 1)) / trial.rate_hz;
    const bool at_wall = trial.walls_only && std::fmod(t, 10) >= 6;
    const Vec3 sigma = at_wall ? wall : free_air;
    const bool acts = t >= trial.since_s && (at_wall || !trial.walls_only);
    const Vec3 w = std::sqrt(acts ? trial.factor : 1) * sigma.cwiseSqrt().cwiseProduct(gust) +
                   trial.push * Vec3::UnitX() + trial.noise * Vec3(air.normal(), air.normal(), air.normal());
    while (learned.calmer_at.size() < trial.at_s.size() && t >= trial.at_s[learned.calmer_at.size()])
      learned.calmer_at.push_back(adaptation.of(acting).below().value_or(2));
    if (acts) exposed += t - last;
    last = t;
    adaptation.add({t, w, sigma, at_wall ? AirClass::wall : AirClass::free_air});
    for (std::size_t c = 0; c < backwash::kAirClasses && !learned.alarm_s; ++c)
      if (adaptation.of(static_cast<AirClass>(c)).above()) learned.alarm_s = t;
    if (!learned.exposed_s && t >= trial.since_s && adaptation.of(acting).above()) learned.exposed_s = exposed;
  }
  learned.calmer_at.resize(trial.at_s.size(), adaptation.of(acting).below().value_or(2));
  learned.factor = adaptation.factor(acting), learned.calmer = adaptation.of(acting).below();
  return learned;
}

}  // namespace gusts
