// SPDX-License-Identifier: BSD-3-Clause
// An extended model's mean pushes against the simulated vehicle, which integrates them at 1 kHz at its true position by
// formulas written here.
#include <gtest/gtest.h>

#include <cmath>

#include "core/config/config.hpp"
#include "core/plan/planner.hpp"
#include "core/plan/world/world.hpp"
#include "core/reach/chance.hpp"
#include "core/sim/vehicle/quadrotor.hpp"
#include "core/types/minimum_jerk.hpp"

namespace backwash {
namespace {

constexpr double kCeiling = 2.4, kWall = 3.0;  // undersides of the room's ceiling, and its wall, m

/// 3 × 4 × 2.4 m of air over a floor, under a ceiling, beside a wall at y = 3.
map::OccupancyGrid room() {
  map::OccupancyGrid grid(Vec3(0, -1, -0.1), 0.1, Index3(30, 41, 26), map::Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    if (v.z() == 0 || v.z() == 25 || v.y() == 40) grid.set(v, map::Cell::occupied);
  }
  return grid;
}

Vehicle vehicle() { return config::load_vehicle("builtin:quad-5in").value(); }

/// Hardly any variance: what the sets hold then is what the pushes do.
Model calm(std::vector<ModelEffect> extension) {
  Model m;
  m.base = {1e-9, 1e-9};
  m.ground.lambda = {0, 0};
  m.ground.k1 = {0, 0};
  m.corner.lambda = {0, 0, 0};
  m.wall.k1 = {0, 0, 0};
  m.extension = std::move(extension);
  return m;
}

ModelEffect effect(Law kind, const Vec3& value, double scale = 0, double error = 0) {
  return {kind, value, Vec3(error, 0, 0), scale};
}
const ModelEffect kSuction = effect(Law::push_under_surface, Vec3(0.6, 0, 0), 0.4);
const ModelEffect kPull = effect(Law::push_to_walls, Vec3(-0.4, 0, 0), 0.5);

Vec3 suction(const Vec3& p) { return {0, 0, 0.6 * std::exp(-(kCeiling - p.z() - 0.3) / 0.4)}; }
Vec3 pushed_off(const Vec3& p) { return {0, -0.4 * std::exp(-(kWall - p.y() - 0.4) / 0.5), 0}; }

/// Flies commands with a push w(p, v) and returns the states at their instants, one more than commands.
template <typename Push>
std::vector<State> flown(const State& start, const std::vector<Setpoint>& commands, const Push& push) {
  sim::Quadrotor quad(vehicle(), start);
  std::vector<State> states{quad.state()};
  for (const Setpoint& command : commands) {
    quad.command(command);
    for (int i = 0; i < 20; ++i) quad.step(push(quad.state()), quad.state());
    states.push_back(quad.state());
  }
  return states;
}

std::vector<Setpoint> way(const Vec3& from, const Vec3& to) {
  auto commands = rest_to_rest(from, to, 1, 2);
  commands.insert(commands.end(), 150, Setpoint{to});
  return commands;
}

/// Largest distance of the flown positions from a tube's centres, and whether all lay in its sets.
struct Fit {
  double off = 0, furthest_push = 0;
  bool inside = true;
};
Fit fit(const reach::ReachTube& tube, const std::vector<State>& states, const reach::ReachTube& without) {
  Fit fit;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const Vec3 e = states[k].p_W - tube[k].center.p_W;
    fit.off = std::max(fit.off, e.norm());
    fit.furthest_push = std::max(fit.furthest_push, (states[k].p_W - without[k].center.p_W).norm());
    for (std::size_t d = 0; d < kDirections; ++d)
      fit.inside = fit.inside && std::abs(unit(static_cast<Direction>(d)).dot(e)) <= tube[k].half_widths[d] + 2e-3;
  }
  return fit;
}

reach::ReachTube tube_of(const plan::World& world, const State& start, const std::vector<Setpoint>& commands) {
  return reach::tube_over_field(world.reach, start, {.p_W = start.p_W}, commands, world.bounds);
}

TEST(ExtendedModel, TubesAreCentredWhereACeilingsAndAWallsPushTakeTheVehicle) {
  Vehicle v = vehicle();
  v.initial_error = {0, 0};
  const auto world = plan::build_world(room(), calm({kSuction, kPull}), v);
  const auto plain = plan::build_world(room(), calm({}), v);
  const State start{Vec3(1.5, 1, 1), Vec3::Zero()};
  const auto commands = way(start.p_W, Vec3(1.5, 2.4, 2.0));
  const auto states = flown(start, commands, [](const State& s) -> Vec3 { return suction(s.p_W) + pushed_off(s.p_W); });
  const Fit f = fit(tube_of(*world, start, commands), states, tube_of(*plain, start, commands));
  EXPECT_GT(f.furthest_push, 0.045);
  EXPECT_LT(f.off, 0.15 * f.furthest_push);
  EXPECT_TRUE(f.inside);
}

TEST(ExtendedModel, TubesFollowDraftAndDragAlongTheWay) {
  Vehicle v = vehicle();
  v.initial_error = {0, 0};
  const Vec3 draft(0.3, -0.2, -0.1);
  const double drag = 0.3, lift = 0.25;
  const auto world = plan::build_world(room(),
                                       calm({effect(Law::push, draft), effect(Law::push_against_velocity, {drag, 0, 0}),
                                             effect(Law::push_with_speed, {lift, 0, 0})}),
                                       v);
  const auto plain = plan::build_world(room(), calm({}), v);
  const State start{Vec3(0.7, 0, 1), Vec3::Zero()};
  const auto commands = way(start.p_W, Vec3(2.2, 1.8, 1.4));
  const auto states = flown(start, commands, [&](const State& s) -> Vec3 {
    return draft - drag * Vec3(s.v_W.x(), s.v_W.y(), 0) + Vec3(0, 0, lift * s.v_W.squaredNorm());
  });
  const Fit f = fit(tube_of(*world, start, commands), states, tube_of(*plain, start, commands));
  EXPECT_GT(f.furthest_push, 0.04);
  EXPECT_LT(f.off, 0.04 * f.furthest_push);
}

TEST(ExtendedModel, ChanceConstrainedTubesFollowThePushToo) {
  Model model;
  model.extension = {kSuction, kPull};
  const auto world = plan::build_world(room(), model, vehicle());
  const State start{Vec3(1.5, 1, 1), Vec3::Zero()};
  const auto commands = way(start.p_W, Vec3(1.5, 2.2, 1.8));
  const auto tight = tube_of(*world, start, commands);
  const auto chance = reach::chance_tube_over_field(world->reach, start, {.p_W = start.p_W}, commands, world->bounds,
                                                    model.bound, 1e-3);
  for (std::size_t k = 0; k < tight.size(); ++k)
    ASSERT_LT((tight[k].center.p_W - chance.steps[k].center.p_W).norm(), 1e-12);
}

TEST(ExtendedModel, HoverSetsUnderACeilingAreWhereTheVehicleComesToRest) {
  const auto world = plan::build_world(room(), calm({kSuction}), vehicle());
  double shift_near = 0, shift_far = 0;
  for (const double z : {1.0, 2.0}) {
    const Vec3 p(1.5, 1, z);
    const auto states =
        flown({p, Vec3::Zero()}, std::vector<Setpoint>(500, {.p_W = p}), [](const State& s) { return suction(s.p_W); });
    const auto set = reach::hover_set(world->reach, world->grid, world->distance, world->bounds, p);
    ASSERT_TRUE(set.bounded);
    const Vec3 rest = states.back().p_W - p;
    EXPECT_NEAR(set.shift.z(), rest.z(), 0.35 * rest.z());  // taken at the set-point, not where it comes to rest
    EXPECT_LE(std::abs(set.shift.z() - rest.z()), set.half_widths[kZ]);
    (z < 1.5 ? shift_far : shift_near) = set.shift.z();
  }
  EXPECT_GT(shift_near, 5 * shift_far);
}

TEST(ExtendedModel, SuctionTakesHoverPlacesUnderTheCeilingAndAPushAwayGivesSomeBack) {
  const auto safe_below_ceiling = [](double variance, std::vector<ModelEffect> extension) {
    Model model = calm(std::move(extension));
    model.base.vertical = variance;
    const auto world = plan::build_world(room(), model, vehicle());
    int safe = 0;
    for (std::size_t n = 0; n < world->grid.cell_count(); ++n)
      safe += world->grid.voxel(n).z() > 20 && world->hover.safe(world->grid.voxel(n));
    return safe;
  };
  EXPECT_LT(safe_below_ceiling(0.05, {kSuction}), safe_below_ceiling(0.05, {}));
  // Sets of 10 cm: the voxels a quarter metre below the ceiling fit with the push alone.
  EXPECT_GT(safe_below_ceiling(0.1, {effect(Law::push, {0, 0, -0.8})}), safe_below_ceiling(0.1, {}));
}

TEST(ExtendedModel, VarianceByPlaceAndSpeedWidensTheSetsByItsRoot) {
  Model model;
  model.bound.kappa = 3;
  const auto plain = plan::build_world(room(), model, vehicle());
  model.extension = {effect(Law::ln_variance_under_surface, {1, 0, 0}, 0.3)};
  const auto ceiling = plan::build_world(room(), model, vehicle());
  for (const int k : {10, 20}) {
    const Index3 v(15, 20, k);
    const double gap = kCeiling - plain->grid.center(v).z();
    const double factor = std::exp(std::exp(-(gap - 0.3) / 0.3));
    EXPECT_NEAR(ceiling->bounds.at(v).w[kZ], std::sqrt(factor) * plain->bounds.at(v).w[kZ],
                1e-3 * plain->bounds.at(v).w[kZ]);
  }
  model.extension = {effect(Law::ln_variance_with_speed, {0.8, 0, 0}, 2)};
  const auto fast = plan::build_world(room(), model, vehicle());
  const Index3 v(15, 20, 10);
  const auto at = [&](double speed) {
    return fast->bounds.max_about_voxels(Vec3::Zero(), Vec3(0, speed, 0), v, v).w[kY] / plain->bounds.at(v).w[kY];
  };
  EXPECT_NEAR(at(0), 1, 1e-9);
  EXPECT_NEAR(at(1.5), std::exp(0.4 * 2.25), 1e-9);
}

TEST(ExtendedModel, EffectsOfNothingLeaveEveryTubeAndSetAsWithoutThem) {
  Model model;
  const auto plain = plan::build_world(room(), model, vehicle());
  model.extension = {effect(Law::push, Vec3::Zero()), effect(Law::push_under_surface, Vec3::Zero(), 0.3)};
  const auto zero = plan::build_world(room(), model, vehicle());
  const State start{Vec3(1.5, 1, 1), Vec3(0.1, 0, 0)};
  const auto commands = way(start.p_W, Vec3(1.5, 2.2, 1.8));
  const auto a = tube_of(*plain, start, commands), b = tube_of(*zero, start, commands);
  for (std::size_t k = 0; k < a.size(); ++k) {
    ASSERT_EQ(a[k].center.p_W, b[k].center.p_W);
    ASSERT_EQ(a[k].half_widths, b[k].half_widths);
    ASSERT_EQ(a[k].half_widths_interval, b[k].half_widths_interval);
  }
  for (std::size_t n = 0; n < plain->grid.cell_count(); ++n)
    ASSERT_EQ(plain->hover.safe(plain->grid.voxel(n)), zero->hover.safe(zero->grid.voxel(n)));
}

}  // namespace
}  // namespace backwash
