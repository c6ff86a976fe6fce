// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/air_log.hpp"

#include <algorithm>
#include <cmath>

#include "core/log/tick_decisions.hpp"

namespace backwash::log {

AirConstantsRecord constants(const adapt::InFlightConstants& c) noexcept {
  // The velocity's integrator is not in it: what is learnt is the disturbance less what the integrator holds.
  const auto& [kp, kd, latency, feedback_delay, attitude_lag, integrator] = c.controller;
  AirConstantsRecord r{{kp.horizontal, kp.vertical},
                       {kd.horizontal, kd.vertical},
                       latency,
                       feedback_delay,
                       attitude_lag,
                       c.gusts.tau_low_s,
                       c.gusts.tau_high_s,
                       {c.gusts.mean_horizontal, c.gusts.mean_vertical},
                       c.alpha,
                       {}};
  std::ranges::copy(c.start, r.start);
  return r;
}

std::optional<adapt::InFlightConstants> decode(const AirConstantsRecord& r) noexcept {
  adapt::InFlightConstants c{
      {{r.kp[0], r.kp[1]}, {r.kd[0], r.kd[1]}, r.latency, r.feedback_delay, r.attitude_lag, {}},
      {.tau_low_s = r.tau_low, .tau_high_s = r.tau_high, .mean_horizontal = r.mean[0], .mean_vertical = r.mean[1]},
      r.alpha,
      {}};
  std::ranges::copy(r.start, c.start.begin());
  // Written so that what is no number is refused: of a damaged record no table is made.
  const bool sound = r.tau_low > 0 && r.tau_high >= r.tau_low && std::isfinite(r.tau_high) && r.alpha > 0 &&
                     r.alpha < 1 && std::ranges::all_of(c.start, [](double f) { return f >= 1 && std::isfinite(f); });
  return sound ? std::optional(c) : std::nullopt;
}

bool flown(const track::TickInput& in, const track::TickOutput& out) noexcept {
  const Mode mode = out.supervisor.mode;
  return out.fresh && (mode == Mode::tracking || mode == Mode::hold) && in.autopilot.armed &&
         !in.autopilot.landed.value_or(false);
}

bool learn(adapt::InFlight& air, const track::FlightTick& flight, const track::TickOutput& out, AirRecord& r) noexcept {
  const track::OdometrySample& s = *flight.odometry();
  const auto place = static_cast<AirClass>(std::min<std::uint32_t>(r.air, kAirClasses - 1));
  const bool grew = air.add({s.stamp_ns,
                             std::uint64_t{s.closures} << 8 | out.odometry_resets,
                             s.state,
                             out.command,
                             {r.sigma[0], r.sigma[1], r.sigma[2]},
                             place});
  each_decision(kAirDecisions, [&](const auto& decision) { decision.write(Learnt{air, place}, r); });
  return grew;
}

}  // namespace backwash::log
