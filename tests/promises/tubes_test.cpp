// SPDX-License-Identifier: BSD-3-Clause
// 10⁷ tubes (a thousandth in a block): centres, bounds over the set, and half widths, against motions of our own
// (motion.hpp). No motion leaves its set, and the worst one reaches 0.99 of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/promises/tube_case.hpp"

namespace backwash::promises {
namespace {

using Lanes = Motions::Lanes;
constexpr double kWithin = 1 + 1e-5, kReached = 0.99, kIntervalReached = 0.9, kRounding = 1e-9;
constexpr double kCentre = 1e-6;  // m
/// What tails of the responses may add at most: of what the largest bound so far and the first errors can do at all.
constexpr double kTails = 4e-6;

/// The largest bound so far.
double largest_bound(const Case& c, int step, Direction d) {
  double largest = 0;
  for (int i = 0; i < step; i += c.drawn->vehicle.per_period) largest = std::max(largest, c.bound(i, d));
  return largest;
}

/// What the tails of the responses may add.
double tails(const Case& c, int step, Direction d) {
  const Answer& answer = c.drawn->answer[d == kZ];
  const auto& first = c.drawn->vehicle.vehicle.initial_error;
  return kRounding +
         kTails * (answer.reach * largest_bound(c, step, d) + first.position + answer.speed * first.velocity);
}

/// Of a position along d at a step: its error is within the half widths of that instant and of the interval around it.
void demand_inside(const Case& c, int step, Direction d, double p, const char* whose) {
  const int per_period = c.drawn->vehicle.per_period;
  const double error = std::abs(p - unit(d).dot(c.centre[static_cast<std::size_t>(step)]));
  const auto k = static_cast<std::size_t>(step / per_period);
  const std::string what = std::string(whose) + " in direction " + std::to_string(d) + " at step " +
                           std::to_string(step) + " of " + std::to_string(per_period);
  demand_at_most(error, c.tube[k].half_widths_interval[d] * kWithin + kRounding, what + ", interval");
  if (step % per_period != 0) return;
  demand_at_most(error, c.tube[k].half_widths[d] * kWithin + kRounding, what);
  if (k > 0) demand_at_most(error, c.tube[k - 1].half_widths_interval[d] * kWithin + kRounding, what + ", end");
}

/// Centres of the tube, then its sets: the calm motions of lanes 0 and 1 (0 alone along z) are the centre.
void demand_sets(Case& c, bool vertical, Random& random) {
  const Drawn& drawn = *c.drawn;
  const Answer& answer = drawn.answer[vertical];
  const int per_period = drawn.vehicle.per_period, first = vertical ? 1 : 2;
  constexpr Direction kLevel[] = {kX, kY, kX, kY, kXyPlus, kXyMinus};
  Attacks attacks;
  for (int lane = 0; lane < Motions::kLanes; ++lane) {
    const Direction d = vertical ? kZ : lane < 6 ? kLevel[lane] : kLevel[random.whole(2, 5)];
    const int to = per_period * random.whole(1, static_cast<int>(c.commands.size()));
    auto& attack = attacks[static_cast<std::size_t>(lane)];
    if (lane < first)
      attack.d = d;
    else
      attack = lane < 6 ? worst(c, answer, d, to, random) : switching(c, d, random);
  }
  const auto push = [&](int i, Direction d) { return c.bound(i, d); };
  c.centre.resize(static_cast<std::size_t>(c.steps()) + 1, Vec3::Zero());
  fly(c, drawn.plant[vertical], attacks, push, [&](int i, const Lanes& p) {
    Vec3& centre = c.centre[static_cast<std::size_t>(i)];
    if (vertical)
      centre.z() = p[0];
    else
      centre.head<2>() = p.head<2>().matrix();
    if (i % per_period == 0) {
      const Vec3 off = centre - c.tube[static_cast<std::size_t>(i / per_period)].center.p_W;
      demand_at_most(vertical ? std::abs(off.z()) : off.head<2>().norm(), kCentre, "centre at " + std::to_string(i));
    }
    for (int lane = first; lane < Motions::kLanes; ++lane) {
      const Attack& attack = attacks[static_cast<std::size_t>(lane)];
      demand_inside(c, i, attack.d, p[lane], lane < 6 ? "worst" : "switching");
      if (i != attack.to) continue;
      const double error = std::abs(p[lane] - unit(attack.d).dot(centre));
      const double h = c.tube[static_cast<std::size_t>(i / per_period)].half_widths[attack.d];
      demand_at_most(kReached * h, error + tails(c, i, attack.d),
                     "half width not reached, direction " + std::to_string(attack.d));
    }
  });
}

/// The half width of an interval is no more than what is reached in it.
void demand_tight_interval(const Case& c, Random& random) {
  const Drawn& drawn = *c.drawn;
  const auto& first = drawn.vehicle.vehicle.initial_error;
  const int per_period = drawn.vehicle.per_period, k = random.whole(0, static_cast<int>(c.commands.size()) - 1);
  const Direction d = static_cast<Direction>(random.whole(0, kDirections - 1));
  const Answer& answer = drawn.answer[d == kZ];
  double largest = 0;
  for (int to = k * per_period; to <= (k + 1) * per_period; ++to) {
    const auto at = static_cast<std::size_t>(to);
    double h = std::hypot(first.position * answer.from_position[at], first.velocity * answer.from_velocity[at]);
    for (int i = 0; i < to; ++i) h += c.bound(i, d) * std::abs(answer.at(i, to));
    largest = std::max(largest, h);
  }
  // A chord between two of eight phases may be passed by δ²/8·|ë|.
  const double w = largest_bound(c, (k + 1) * per_period, d), phase = kControlPeriod / 8;
  const double bow = phase * phase / 8 *
                     (answer.by_push * w + answer.by_position * first.position + answer.by_velocity * first.velocity);
  demand_at_most(kIntervalReached * (c.tube[static_cast<std::size_t>(k)].half_widths_interval[d] - bow),
                 largest + tails(c, (k + 1) * per_period, d),
                 "interval " + std::to_string(k) + " not reached, direction " + std::to_string(d));
}

/// With an integrator in air that pushes steadily: the vehicle as it flies, the charge of its own manoeuvres included.
void demand_charged_inside(const Case& c, bool vertical, Random& random) {
  const Drawn& drawn = *c.drawn;
  const auto& model = drawn.air->drawn.model.bound;
  constexpr Direction kLevel[] = {kX, kY, kXyPlus, kXyMinus};
  Attacks attacks;
  for (int lane = 0; lane < Motions::kLanes; ++lane) {
    const Direction d = vertical ? kZ : kLevel[lane % 4];
    auto& attack = attacks[static_cast<std::size_t>(lane)];
    attack = lane < 4 ? worst(c, drawn.charged_answer[vertical], d, random.whole(1, c.steps()), random)
                      : switching(c, d, random);
  }
  const double push = vertical ? model.mean_vertical : model.mean_horizontal;
  fly(
      c, drawn.charged[vertical], attacks, [&](int, Direction) { return push; },
      [&](int i, const Lanes& p) {
        for (std::size_t lane = 0; lane < attacks.size(); ++lane)
          demand_inside(c, i, attacks[lane].d, p[static_cast<Eigen::Index>(lane)], "charged");
      });
}

void demand_tube(const Drawn& drawn, Random& random) {
  Case c = draw_case(drawn, random);
  if (c.through) drawn.air->demand_bounds(c.tube, drawn.charged_answer, random);
  for (const bool vertical : {false, true}) demand_sets(c, vertical, random);
  if (c.commands.size() < 150) demand_tight_interval(c, random);
  if (drawn.charged_answer.empty() || !drawn.air->calm()) return;
  for (const bool vertical : {false, true}) demand_charged_inside(c, vertical, random);
}

TEST(Promises, NoMotionLeavesItsTubeAndTheWorstReachesIt) {
  constexpr unsigned kVehicles = 100, kTubes = 100;
  draw_all(1, kVehicles, [](Random& random) {
    const Drawn drawn = draw_vehicle_and_air(random);
    for (unsigned n = 0; n < kTubes; ++n) demand_tube(drawn, random);
  });
}

}  // namespace
}  // namespace backwash::promises
