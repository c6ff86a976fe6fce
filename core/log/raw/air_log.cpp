// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/raw/air_log.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/log/raw/replayed_air.hpp"
#include "core/types/time.hpp"

namespace backwash::log {
namespace {

constexpr double kAtRest = 0.2;  // m/s; what hovering in gusts moves with
constexpr std::int64_t kSameClock_ns = 1'000'000'000;

/// Since the newest good odometry was taken, s: by its stamp, where that is of our clock; else since it came, and what
/// the configuration says that it is late by.
double age(const track::FlightTick& flight, std::int64_t now_ns) noexcept {
  const track::OdometrySample& s = *flight.odometry();
  const std::int64_t way = s.received_ns - s.stamp_ns;
  if (way >= 0 && way < kSameClock_ns) return std::max(0.0, seconds(now_ns - s.stamp_ns));
  return std::max(0.0, flight.odometry_age() + flight.timing().latency);
}

}  // namespace

CalmAirConstantsRecord constants(const adapt::InFlightConstants& c) noexcept {
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
  return {r, c.calmest};
}

std::optional<adapt::InFlightConstants> decode(const RawRecord& record) noexcept {
  const auto* plain = payload<AirConstantsRecord>(record);
  const auto* calm = payload<CalmAirConstantsRecord>(record);
  if (!plain) return std::nullopt;
  const AirConstantsRecord& r = *plain;
  adapt::InFlightConstants c{
      {{r.kp[0], r.kp[1]}, {r.kd[0], r.kd[1]}, r.latency, r.feedback_delay, r.attitude_lag, {}},
      {.tau_low_s = r.tau_low, .tau_high_s = r.tau_high, .mean_horizontal = r.mean[0], .mean_vertical = r.mean[1]},
      r.alpha,
      {},
      calm ? calm->calmest : 1};
  std::ranges::copy(r.start, c.start.begin());
  // Written so that what is no number is refused: of a damaged record no table is made.
  const bool sound = r.tau_low > 0 && r.tau_high >= r.tau_low && std::isfinite(r.tau_high) && r.alpha > 0 &&
                     r.alpha < 1 && c.calmest > 0 && c.calmest <= 1 &&
                     std::ranges::all_of(c.start, [](double f) { return f >= 1 && std::isfinite(f); });
  return sound ? std::optional(c) : std::nullopt;
}

bool flown(const track::TickInput& in, const track::TickOutput& out) noexcept {
  const Mode mode = out.supervisor.mode;
  return (mode == Mode::tracking || mode == Mode::hold) && in.autopilot.armed && out.landed == false &&
         out.supervisor.send_setpoint;
}

bool ended(adapt::InFlight& air, const track::TickInput& in) noexcept { return !in.autopilot.armed && air.end(); }

bool learn(adapt::InFlight& air, const track::TickInput& in, const track::FlightTick& flight,
           const track::TickOutput& out, AirRecord& r) noexcept {
  const track::OdometrySample& s = *flight.odometry();
  const auto place = static_cast<AirClass>(std::min<std::uint32_t>(r.air, kAirClasses - 1));
  // The last command is at rest, and everything up to it was found clear.
  const bool rests = flight.tracker().segment() != 0 && flight.tracker().finished() && s.state.v_W.norm() < kAtRest;
  const bool changed = air.add({in.now_ns,
                                out.fresh ? std::optional(age(flight, in.now_ns)) : std::nullopt,
                                std::uint64_t{s.closures} << 8 | out.odometry_resets,
                                s.state,
                                out.command,
                                {r.sigma[0], r.sigma[1], r.sigma[2]},
                                place,
                                rests});
  each_decision(kAirDecisions, [&](const auto& decision) { decision.write(Learnt{air, place}, r); });
  return changed;
}

double evidence(const AirRecord& r, double alpha) noexcept {
  const double rougher = r.ln_evidence / std::log(adapt::kBets / alpha);
  const double became = 1 + r.ln_changed / std::log(adapt::kRunLength);
  return std::max({0.0, rougher, became});
}

bool carry_out(adapt::InFlight& air, const track::TickInput& in, AirOrderRecord& r) noexcept {
  const auto order = static_cast<adapt::AirOrder>(r.order);
  const bool done = order != adapt::AirOrder::reset || !in.autopilot.armed;
  const bool changed = done && air.carry_out(order);
  each_decision(kAirOrderDecisions, [&](const auto& decision) { decision.write(Ordered{air, done}, r); });
  return changed;
}

std::optional<std::string> ReplayedAir::take(const RawRecord& record) {
  if (record.header.kind == RecordKind::air_constants) {
    const auto constants = decode(record);
    if (!constants) return "is no start of what is learnt of the air";
    air_.emplace(*constants);
  } else if (record.header.kind == RecordKind::air) {
    next_ = payload<AirRecord>(record);
    offset_ = record.offset;
    if (!next_) return "is too short for the air of a tick";
    if (!air_) return "learns of the air, and no record before it says from what";
  } else if (record.header.kind == RecordKind::air_order) {
    const auto* order = payload<AirOrderRecord>(record);
    if (!order || order->order >= adapt::kAirOrders) return "is no order about the air";
    if (!air_) return "is an order about the air, and no record before it says that anything is learnt";
    orders_.push_back({order, record.offset});
  }
  return std::nullopt;
}

void ReplayedAir::skip() noexcept {
  next_ = nullptr;
  for (const Order& order : std::exchange(orders_, {}))
    if (order.logged->done != 0) air_->carry_out(static_cast<adapt::AirOrder>(order.logged->order));
}

std::optional<Difference> ReplayedAir::step(const track::TickInput& in, const track::FlightTick& flight,
                                            const track::TickOutput& out, std::uint64_t tick, std::uint64_t& hash) {
  auto first = carry_out_orders(in, hash);
  if (air_) ended(*air_, in);
  const AirRecord* logged = std::exchange(next_, nullptr);
  if (const bool adds = air_ && flown(in, out) && flight.odometry(); adds != (logged != nullptr))
    return first ? first : Difference{tick, offset_, "air", adds ? 0.0 : 1.0, adds ? 1.0 : 0.0};
  if (!logged) return first;
  AirRecord again = *logged;
  learn(*air_, in, flight, out, again);
  auto difference = compare(kAirDecisions, *logged, again, hash);
  if (difference) difference->offset = offset_;
  return first ? first : difference;
}

std::optional<Difference> ReplayedAir::carry_out_orders(const track::TickInput& in, std::uint64_t& hash) {
  std::optional<Difference> first;
  for (const Order& order : std::exchange(orders_, {})) {
    AirOrderRecord again = *order.logged;
    carry_out(*air_, in, again);
    auto difference = compare(kAirOrderDecisions, *order.logged, again, hash);
    if (difference) difference->offset = order.offset;
    if (!first) first = difference;
  }
  return first;
}

}  // namespace backwash::log
