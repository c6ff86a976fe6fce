// SPDX-License-Identifier: BSD-3-Clause
#include "tests/promises/tube_case.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace backwash::promises {
namespace {

using Lanes = Motions::Lanes;

/// The acting set-point of each lane, as Motions takes it.
class Commanded {
 public:
  Commanded(const Case& c, const Plant& plant, const std::array<Direction, Motions::kLanes>& d)
      : per_period_(plant.per_period), latency_(c.drawn->vehicle.latency) {
    const auto add = [&](const Setpoint& s) {
      Lanes off, a;
      for (int lane = 0; lane < Motions::kLanes; ++lane) {
        const Vec3 n = unit(d[static_cast<std::size_t>(lane)]);
        off[lane] = plant.kp * n.dot(s.p_W) + plant.kd * n.dot(s.v_W);
        a[lane] = n.dot(s.a_W);
      }
      off_.push_back(off);
      a_.push_back(a);
    };
    add(c.previous);
    for (const Setpoint& s : c.commands) add(s);
  }
  std::size_t at(int step) const {
    return step < latency_ ? 0 : static_cast<std::size_t>((step - latency_) / per_period_) + 1;
  }
  const Lanes& off(int step) const { return off_[at(step)]; }
  const Lanes& a(int step) const { return a_[at(step)]; }

 private:
  int per_period_, latency_;
  std::vector<Lanes> off_, a_;
};

/// All lanes start at the tube's start, off by their first errors, and with the acceleration commanded there.
Motions started(const Case& c, const Plant& plant, const Attacks& attacks) {
  Lanes p, v, a;
  for (int lane = 0; lane < Motions::kLanes; ++lane) {
    const Attack& attack = attacks[static_cast<std::size_t>(lane)];
    const Vec3 n = unit(attack.d);
    const double p0 = n.dot(c.start.p_W), v0 = n.dot(c.start.v_W);
    p[lane] = p0 + attack.p0;
    v[lane] = v0 + attack.v0;
    a[lane] = n.dot(c.previous.a_W) + plant.kp * (n.dot(c.previous.p_W) - p0) + plant.kd * (n.dot(c.previous.v_W) - v0);
  }
  return {plant, p, v, a};
}

/// Commands of held accelerations, within the limits. `still`: from rest where the vehicle is.
void draw_commands(Case& c, Random& random, bool still) {
  const auto& limits = c.drawn->vehicle.vehicle.limits;
  const map::OccupancyGrid& grid = c.drawn->air->world->grid;
  Setpoint s;
  s.p_W = random.within(grid.origin(), grid.origin() + grid.resolution() * grid.size().cast<double>());
  c.previous = s;
  c.start.p_W = s.p_W;
  if (!still) {
    for (Vec3* v : {&c.start.p_W, &c.start.v_W, &s.v_W, &c.previous.a_W})
      *v += random.within(Vec3::Constant(-0.3), Vec3::Constant(0.3));
  }
  const int count = static_cast<int>(random.magnitude(3, c.drawn->longest));
  const double rate = random.magnitude(0.01, 0.5);
  Vec3 a = Vec3::Zero();
  while (static_cast<int>(c.commands.size()) < count) {
    if (random.chance(rate)) a = random.within(Vec3::Constant(-limits.a_max), Vec3::Constant(limits.a_max));
    s.a_W = a;
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(s.v_W[axis] + kControlPeriod * a[axis]) > limits.v_max) s.a_W[axis] = a[axis] = 0;
    c.commands.push_back(s);
    s.p_W += kControlPeriod * (s.v_W + kControlPeriod / 2 * s.a_W);
    s.v_W += kControlPeriod * s.a_W;
  }
}

/// Bounds of each step by themselves, with jumps and quiet stretches.
std::vector<DisturbanceBound> draw_bounds(std::size_t count, Random& random) {
  std::vector<DisturbanceBound> bounds(count);
  double level = 1;
  for (DisturbanceBound& b : bounds) {
    if (random.chance(0.05)) level = random.chance(0.3) ? 0 : random.uniform(0, 5);
    for (double& w : b.w) w = level * random.uniform(0.5, 1);
  }
  return bounds;
}

}  // namespace

Case draw_case(const Drawn& drawn, Random& random) {
  Case c;
  c.drawn = &drawn;
  const bool held = reach::has_integrator(drawn.vehicle.vehicle);
  draw_commands(c, random, held);
  c.through = held || (!drawn.sampled && random.chance(0.7));
  c.tube = c.through ? reach::tube_over_field(drawn.reach(), c.start, c.previous, c.commands, drawn.air->world->bounds)
                     : reach::tube_with_bounds(drawn.reach(), c.start, c.previous, c.commands,
                                               draw_bounds(c.commands.size(), random));
  return c;
}

Drawn draw_vehicle_and_air(Random& random) {
  for (;;) {
    Drawn drawn;
    const bool held = random.chance(0.25), sampled = !held && random.chance(0.1);
    drawn.vehicle = draw_vehicle(random, held, sampled);
    const Vehicle& v = drawn.vehicle.vehicle;
    try {
      if (sampled) drawn.sampled.emplace(v, reach::Method::tight, reach::Loop::sampled);
      drawn.air.emplace(random, v);
    } catch (const std::invalid_argument&) {
      continue;
    }
    drawn.longest = held && drawn.air->calm() ? 400 : random.chance(0.02) ? 1500 : 200;
    for (const bool vertical : {false, true}) {
      drawn.plant[vertical] = drawn.vehicle.plant(vertical, false);
      drawn.charged[vertical] = drawn.vehicle.plant(vertical, true);
      const int steps = drawn.longest * drawn.vehicle.per_period;
      drawn.answer.emplace_back(drawn.plant[vertical], steps);
      if (held) drawn.charged_answer.emplace_back(drawn.charged[vertical], steps);
    }
    return drawn;
  }
}

/// What pushes farthest at step `to`; by random signs after it.
Attack worst(const Case& c, const Answer& answer, Direction d, int to, Random& random) {
  Attack attack{d, 0, 0, {}, to};
  const auto& first = c.drawn->vehicle.vehicle.initial_error;
  const auto at = static_cast<std::size_t>(to);
  const double p = first.position * answer.from_position[at], v = first.velocity * answer.from_velocity[at];
  if (const double norm = std::hypot(p, v); norm > 0) {
    attack.p0 = first.position * p / norm;
    attack.v0 = first.velocity * v / norm;
  }
  for (int i = 0; i < c.steps(); ++i)
    attack.sign.push_back(i < to ? (answer.at(i, to) < 0 ? -1 : 1) : random.uniform(-1, 1));
  return attack;
}

Attack switching(const Case& c, Direction d, Random& random) {
  const auto& first = c.drawn->vehicle.vehicle.initial_error;
  const double turn = random.uniform(0, 2 * std::numbers::pi), rate = random.magnitude(1e-3, 0.5);
  Attack attack{d, first.position * std::cos(turn), first.velocity * std::sin(turn), {}};
  double sign = 1;
  for (int i = 0; i < c.steps(); ++i) {
    attack.sign.push_back(sign);
    sign = random.chance(rate) ? -sign : sign;
  }
  return attack;
}

void fly(const Case& c, const Plant& plant, const Attacks& attacks, const std::function<double(int, Direction)>& push,
         const std::function<void(int, const Motions::Lanes&)>& each) {
  std::array<Direction, Motions::kLanes> d;
  for (std::size_t lane = 0; lane < d.size(); ++lane) d[lane] = attacks[lane].d;
  const Commanded commanded(c, plant, d);
  Motions motions = started(c, plant, attacks);
  for (int i = 0; i <= c.steps(); ++i) {
    each(i, motions.p());
    if (i == c.steps()) break;
    Lanes w = Lanes::Zero();
    for (std::size_t lane = 0; lane < d.size(); ++lane)
      if (!attacks[lane].sign.empty())
        w[static_cast<Eigen::Index>(lane)] = attacks[lane].sign[static_cast<std::size_t>(i)] * push(i, d[lane]);
    motions.step(commanded.off(i), commanded.a(i), w);
  }
}

}  // namespace backwash::promises
