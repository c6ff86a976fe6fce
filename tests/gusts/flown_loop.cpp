// SPDX-License-Identifier: BSD-3-Clause
#include "tests/gusts/flown_loop.hpp"

#include <cmath>
#include <numbers>

namespace gusts {
namespace {

using backwash::AirClass;
using backwash::kGravity;
using backwash::Setpoint;
using backwash::adapt::AirTick;

constexpr double kStep = GustAir::kStep;
const Vec3 kFreeAir(0.004, 0.004, 0.006), kWall(0.06, 0.03, 0.035);

Vec3 of_axes(const backwash::Vehicle::HorizontalVertical& gain) {
  return {gain.horizontal, gain.horizontal, gain.vertical};
}
template <typename Value>
const Value& ago(const std::deque<Value>& past, double s) {
  return past[std::min(past.size() - 1, static_cast<std::size_t>(std::lround(s / kStep)))];
}

}  // namespace

Controller quad_5in() { return {{10, 12}, {5.5, 6}, 0.02, 0, 0.05, {}}; }
Controller px4() { return {{1.71, 1.71}, {1.8, 1.8}, 0.02, 0, 0.05, {}}; }

FlownLoop::FlownLoop(const Controller& controller, const Trial& trial)
    : controller_(controller), trial_(trial), air_(trial.form, trial.tau_s, trial.bursts, trial.seed) {
  controller_.feedback_delay += trial.delay;
  controller_.attitude_lag += trial.lag;
  controller_.latency += trial.command_delay;
  const Setpoint first = asked(0);
  body_ = {first.p_W, first.v_W, first.a_W};
  seen_.assign(1, body_);
  sent_.assign(1, first);
}

// Round and round: each axis at a frequency of its own.
Setpoint FlownLoop::asked(double t) const {
  Setpoint s;
  const Vec3 turns(0.5, 0.8, 0.3), speed = trial_.speed * Vec3(1, 0.7, 0.2);
  for (int k = 0; k < 3; ++k) {
    s.p_W[k] = speed[k] / turns[k] * std::sin(turns[k] * t);
    s.v_W[k] = speed[k] * std::cos(turns[k] * t);
    s.a_W[k] = -speed[k] * turns[k] * std::sin(turns[k] * t);
  }
  s.p_W.z() += 1.5;
  return s;
}

// A thrust that is asked for a lighter vehicle.
FlownLoop::Body FlownLoop::rate(const Body& b, const Vec3& asked, const Vec3& w) const {
  const Vec3 gravity = kGravity * Vec3::UnitZ();
  const auto felt = [&](const Vec3& a) -> Vec3 { return (a + gravity) / (1 + trial_.load) - gravity; };
  const double lag = controller_.attitude_lag;
  const Vec3 rotors = lag > 0 ? b.rotors : asked;
  return {b.v, felt(rotors) + w, lag > 0 ? Vec3((asked - b.rotors) / lag) : Vec3(Vec3::Zero())};
}

void FlownLoop::step() {
  const bool at_wall = trial_.walls_only && std::fmod(t_, 10) >= 6;
  const bool acts = t_ >= trial_.since_s && (at_wall || !trial_.walls_only);
  const Vec3 sigma = at_wall ? kWall : kFreeAir;
  const Vec3 w = std::sqrt((acts ? trial_.factor : 1) * factor) * sigma.cwiseSqrt().cwiseProduct(air_.step()) +
                 trial_.push * Vec3::UnitX();
  const Setpoint& heard = ago(sent_, controller_.latency);
  const Vec3 kp = of_axes(controller_.kp), kd = of_axes(controller_.kd);
  const double delay = controller_.feedback_delay;
  // What is fed back within the step: late by less than a step, it is the state itself.
  const auto fed = [&](const Body& now, double share) -> Vec3 {
    Body late = now;
    if (delay >= kStep) {
      const Body &from = ago(seen_, delay), &to = ago(seen_, delay - kStep);
      late = {from.p + share * (to.p - from.p), from.v + share * (to.v - from.v), {}};
    }
    return heard.a_W + kp.cwiseProduct(heard.p_W - late.p) + kd.cwiseProduct(heard.v_W - late.v);
  };
  const auto moved = [](const Body& b, double h, const Body& r) {
    return Body{b.p + h * r.p, b.v + h * r.v, b.rotors + h * r.rotors};
  };
  const Body b = body_, r1 = rate(b, fed(b, 0), w), b2 = moved(b, kStep / 2, r1), r2 = rate(b2, fed(b2, 0.5), w),
             b3 = moved(b, kStep / 2, r2), r3 = rate(b3, fed(b3, 0.5), w), b4 = moved(b, kStep, r3),
             r4 = rate(b4, fed(b4, 1), w);
  body_ = moved(b, kStep / 6,
                {r1.p + 2 * r2.p + 2 * r3.p + r4.p, r1.v + 2 * r2.v + 2 * r3.v + r4.v,
                 r1.rotors + 2 * r2.rotors + 2 * r3.rotors + r4.rotors});
  t_ += kStep;
  seen_.push_front(body_);
  sent_.push_front(sent_.front());
  constexpr std::size_t kKept = 200;
  if (seen_.size() > kKept) seen_.pop_back();
  if (sent_.size() > kKept) sent_.pop_back();
}

AirTick FlownLoop::tick() {
  for (int k = 0; k < std::lround(backwash::kControlPeriod / kStep); ++k) step();
  const auto noise = [&](double deviation) -> Vec3 {
    return deviation * Vec3(air_.normal(), air_.normal(), air_.normal());
  };
  const bool at_wall = trial_.walls_only && std::fmod(t_, 10) >= 6;
  AirTick tick;
  tick.now_ns = 20'000'000 * ++ticks_;
  tick.sigma = at_wall ? kWall : kFreeAir;
  tick.air = at_wall ? AirClass::wall : AirClass::free_air;
  tick.command = sent_.front() = asked(t_);
  if (t_ < next_ - kStep / 2) return tick;
  next_ += 1 / trial_.rate_hz;
  tick.age_s = 0;
  const Vec3 shaken = trial_.vibration * std::sin(2 * std::numbers::pi * 23.7 * t_) * Vec3::Ones();
  tick.state = {body_.p + noise(trial_.position_noise) + shaken, body_.v + noise(trial_.velocity_noise)};
  return tick;
}

Learned fly(const Controller& controller, const Trial& trial) {
  using namespace backwash::adapt;
  InFlightConstants constants;
  constants.controller = controller;
  constants.gusts.tau_low_s = trial.tau_low_s;
  constants.gusts.tau_high_s = trial.tau_high_s;
  constants.gusts.mean_horizontal = constants.gusts.mean_vertical = trial.allowed;
  InFlight learnt(constants);
  FlownLoop loop(controller, trial);
  const AirClass acting = trial.walls_only ? AirClass::wall : AirClass::free_air;
  Learned learned;
  double exposed = 0;
  while (loop.t() < trial.seconds) {
    const AirTick tick = loop.tick();
    learnt.add(tick);
    const double t = loop.t();
    if (t >= trial.since_s && tick.air == acting) exposed += backwash::kControlPeriod;

    if (!learned.exposed_s && t >= trial.since_s && learnt.above(acting)) learned.exposed_s = exposed;
    for (std::size_t c = 0; c < backwash::kAirClasses; ++c) {
      if (!learned.alarm_s && learnt.above(static_cast<AirClass>(c))) learned.alarm_s = t;
      learned.air = learned.air || learnt.cause(static_cast<AirClass>(c)) == Cause::air;
    }
  }
  learned.factor = learnt.factors()[static_cast<std::size_t>(acting)];
  learned.cause = learnt.cause(acting);
  learned.calmer = learnt.of(acting).below();
  learned.beyond = learnt.of(acting).beyond();
  learned.promised = learnt.of(acting).promised_beyond();
  learnt.end();
  learned.air_kept = *std::ranges::max_element(learnt.kept());
  return learned;
}

}  // namespace gusts
