// SPDX-License-Identifier: BSD-3-Clause
// After a tick's decision: what it says of the air, and what the other threads are shown.
#include <algorithm>

#include "core/log/air_log.hpp"
#include "services/backwashd/control_loop.hpp"

namespace backwash::daemon {

// What this tick says of the air, after its decision: nothing of it is decided by this before a world is made of it.
void ControlLoop::learn(const track::TickInput& in, const track::TickOutput& out) noexcept {
  if (!air_) return;
  while (const auto order = channels_.air_orders.pop()) carry_out(*order, in);
  const AirFactors before = air_->factors();
  if (log::ended(*air_, in)) tell_of_air(before, in);
  if (!log::flown(in, out) || !flight_.odometry()) return;
  const plan::AirPlace place = lookout_.air_at(flight_.odometry()->state.p_W);
  log::AirRecord r{};
  r.tick = view_.ticks;
  std::copy_n(place.sigma.data(), 3, r.sigma);
  r.air = static_cast<std::uint32_t>(place.air);
  const bool changed = log::learn(*air_, in, flight_, out, r);
  record(log::RecordKind::air, in.now_ns, &r, sizeof r);
  const auto here = static_cast<std::size_t>(place.air);
  view_.air->here = place.air;
  view_.air->ln_evidence[here] = r.ln_evidence;
  view_.air->seconds[here] = r.seconds;
  view_.air->causes[here] = air_->cause(place.air);
  if (changed) tell_of_air(before, in);
}

// A restart knows what outlives flights: neither calmer air, which was shown elsewhere, nor a load that is gone.
void ControlLoop::hand_over_air() noexcept {
  view_.air->factors = air_->factors();
  channels_.air.write({air_->factors(), air_falls_});
  channels_.air_kept.write(air_->kept());
}

void ControlLoop::tell_of_air(const AirFactors& before, const track::TickInput& in) noexcept {
  const AirFactors& now = air_->factors();
  bool fell = false;
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    if (now[k] == before[k]) continue;
    fell = fell || now[k] < before[k];
    channels_.events.push_or_count({now[k] < before[k] ? ControlEvent::Kind::calmer : ControlEvent::Kind::rougher,
                                    in.now_ns, view_.mode, view_.reason, 0, static_cast<AirClass>(k), now[k],
                                    view_.air->ln_evidence[k], air_->cause(static_cast<AirClass>(k))});
  }
  air_falls_ += fell;
  hand_over_air();
}

// What an operator asks of it; the mission has judged it by what it was shown, which may be a moment old.
void ControlLoop::carry_out(adapt::AirOrder order, const track::TickInput& in) noexcept {
  log::AirOrderRecord r{};
  r.tick = view_.ticks;
  r.order = static_cast<std::uint32_t>(order);
  const bool changed = log::carry_out(*air_, in, r);
  record(log::RecordKind::air_order, in.now_ns, &r, sizeof r);
  if (r.done == 0)
    channels_.events.push_or_count({ControlEvent::Kind::air_kept, in.now_ns, view_.mode, view_.reason, 0});
  if (order == adapt::AirOrder::reset && r.done != 0) {
    ++air_falls_;
    view_.air.emplace();
  }
  view_.air->frozen = air_->frozen();
  if (changed) hand_over_air();
}

void ControlLoop::publish(const track::TickInput& in, const track::TickOutput& out) noexcept {
  const firmware_bridge::Time now{std::chrono::nanoseconds(in.now_ns)};
  const auto& telemetry = link_.telemetry();
  const auto& tracker = flight_.tracker();
  view_.t_ns = in.now_ns;
  view_.mode = out.supervisor.mode;
  view_.reason = out.supervisor.reason;
  view_.armed = in.autopilot.armed;
  view_.offboard = in.autopilot.offboard;
  view_.landed = out.landed;
  view_.aligned = flight_.alignment().aligned();
  view_.mismatch = flight_.alignment().mismatch();
  view_.odometry_age = flight_.odometry_age();
  view_.odometry_lost_after = flight_.odometry_lost_after();
  view_.heartbeat_age = in.autopilot.heartbeat_age;
  const auto value_of = [](const auto& said) { return said ? std::optional(said->value) : std::nullopt; };
  view_.clock = value_of(link_.clock(now));
  view_.untold_delay = link_.untold_delay();
  const auto trip = link_.round_trip(now);
  view_.round_trip = trip ? std::optional(seconds(*trip)) : std::nullopt;
  view_.loss = link_.loss();
  view_.estimator_follows = value_of(telemetry.estimator_follows.at(now));
  view_.would_arm = value_of(telemetry.would_arm.at(now));
  view_.pose_age = in.autopilot.pose_age(in.now_ns);
  if (flight_.odometry()) view_.state = flight_.odometry()->state;
  view_.command = out.command;
  view_.epoch = flight_.epoch();
  view_.segment = tracker.segment();
  view_.index = tracker.index();
  view_.finished = tracker.finished();
  view_.braking = tracker.braking();
  view_.stop_branch = tracker.stop_branch();
  view_.closures = tracker.closures();
  view_.shift = tracker.shift();
  if (out.refused) view_.refused_segment = in.segment->id;
  view_.odometry_received += in.odometry.has_value();
  view_.odometry_rejected += in.odometry && !out.fresh;
  if (out.inside.judged) ++(out.inside.inside ? view_.inside : view_.outside);
  view_.missed += static_cast<std::uint64_t>(in.missed_periods);
  view_.frames_bad = link_.received().bad_crc;
  if (link_.signing()) view_.frames_refused = link_.signing()->counters().refused();
  constexpr std::uint8_t kWorstNotice = 4;  // severity: 4 is a warning
  if (telemetry.text && telemetry.text->value.severity <= kWorstNotice) view_.warning = telemetry.text;
  const auto battery = telemetry.battery.at(now);
  if (view_.battery && view_.battery->value.remaining && !(battery && battery->value.remaining))
    channels_.events.push_or_count({ControlEvent::Kind::battery_silent, in.now_ns, view_.mode, view_.reason, 0});
  view_.battery = battery;
  view_.residual_m = flight_.alignment().position_residual();
  view_.residual_rad = flight_.alignment().yaw_residual();
}

}  // namespace backwash::daemon
