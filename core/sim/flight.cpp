// SPDX-License-Identifier: BSD-3-Clause
#include "core/sim/flight.hpp"

#include <algorithm>
#include <chrono>
#include <limits>

#include "core/plan/rest.hpp"
#include "core/plan/search/ends.hpp"
#include "core/reach/response/integrator.hpp"
#include "core/types/minimum_jerk.hpp"
#include "core/types/text.hpp"

namespace backwash::sim {
namespace {

using Clock = std::chrono::steady_clock;

tl::unexpected<FlightRefused> refuse(const std::string& message) { return tl::make_unexpected(FlightRefused{message}); }

/// What keeps a vehicle from hovering at a point; empty if nothing does.
std::string obstacle_to_hover(const plan::World& world, const std::string& name, const Vec3& p_W) {
  const auto v = world.grid.index(p_W);
  const std::string where = name + " " + to_text(p_W) + " ";
  if (!world.grid.inside(v)) return where + "lies outside the map; choose a point in it";
  if (world.grid.occupied(v)) return where + "lies in an occupied voxel; choose free space";
  if (!world.grid.free(v)) return where + "lies in unknown space; choose space that the map knows to be free";
  if (plan::may_rest_at(world, p_W, 0)) return {};
  return where + "is not hover-safe: " + to_text(world.distance.exact(world.grid, p_W), 3) +
         " m to the nearest obstacle, body and reachable set need more; choose a more open point";
}

/// The tube a piece is judged with: w̄ of Σ scaled, propagated from the same state along the same commands.
reach::ReachTube scaled_tube(const plan::World& world, const reach::ReachTube& tube, const Setpoint& previous,
                             const std::vector<Setpoint>& commands, const BoundModel& bounds, double sigma_scale) {
  std::vector<DisturbanceBound> scaled;
  std::vector<Vec3> pushes;
  for (std::size_t k = 0; k < commands.size(); ++k) {
    DisturbanceBound b = tube[k].w_bar;
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double mean = d == kZ ? bounds.mean_vertical : bounds.mean_horizontal;
      b.w[d] = mean + std::sqrt(sigma_scale) * (b.w[d] - mean);
    }
    scaled.push_back(b);
    const bool held_off = reach::has_integrator(world.reach.vehicle);  // then the centre keeps to the set-points
    pushes.push_back(held_off ? Vec3::Zero().eval() : world.bounds.push(tube[k].center.p_W, tube[k].center.v_W));
  }
  return reach::tube_with_bounds(world.reach, tube.front().center, previous, commands, scaled, pushes);
}

void append(std::vector<Setpoint>& commands, const std::vector<Setpoint>& more) {
  commands.insert(commands.end(), more.begin(), more.end());
}

/// Why a take-off tube with this clearance may not be flown; empty if it may.
std::string obstacle_to_take_off(const reach::ReachTube& tube, double clearance) {
  if (clearance > 0) return {};
  return "the take-off column under " + to_text(tube.back().center.p_W) + " is not clear (" + to_text(clearance, 3) +
         " m); choose a start with more room below and beside it";
}

}  // namespace

FlightPiece fly_piece(ClosedLoop& loop, const plan::World& world, track::AcceptedSegment accepted, double t_start,
                      double z_safe, std::size_t hover_from, int hover_number) {
  FlightPiece piece{std::move(accepted), {}, {}, {}};
  if (const auto& stated = world.bounds.model().stated) {
    piece.accepted.worst = stated->worst;
    piece.accepted.worst_at_rest = stated->worst / stated->at_rest;
  }
  track::Tracker tracker(piece.accepted.commands.front(), world.reach.vehicle);
  tracker.accept(piece.accepted, piece.accepted.tube.front().center);  // its tube was propagated from the state of now
  for (std::size_t k = 0; k < piece.accepted.tube.size(); ++k) {
    piece.judged.push_back(tracker.judge(loop.estimated().p_W));
    const Setpoint command = tracker.step();
    auto sample = loop.sample(command, k >= hover_from ? std::optional(hover_number) : std::nullopt);
    sample.t = t_start + static_cast<double>(k) * kControlPeriod;
    piece.clearance_m.push_back(true_clearance(world, sample.truth.p_W, z_safe));
    piece.samples.push_back(sample);
    if (k + 1 < piece.accepted.tube.size()) loop.fly(command);
  }
  return piece;
}

double true_clearance(const plan::World& world, const Vec3& p_W, double z_safe) {
  const auto& vehicle = world.reach.vehicle;
  if (p_W.z() >= z_safe) return world.distance.exact(world.grid, p_W) - vehicle.body.radius;
  reach::TubeStep point{};
  point.center.p_W = p_W;
  point.shape.setZero();
  return plan::lateral_clearance(world, {point}) + vehicle.estimation.position;
}

MethodTube method_tube(const plan::World& world, const reach::Reachability& reach, const State& start,
                       const Setpoint& previous, const std::vector<Setpoint>& commands) {
  const auto begin = Clock::now();
  MethodTube method{reach::tube_over_field(reach, start, previous, commands, world.bounds), 0, 0, 0};
  method.tube_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  method.clearance_m = plan::nearest_approach(world, method.tube).clearance;
  for (const auto& step : method.tube) {
    const auto& h = step.half_widths;
    const double axis = reach.method == reach::Method::paper ? step.r_max : std::max({h[kX], h[kY], h[kZ]});
    method.largest_half_axis_m = std::max(method.largest_half_axis_m, axis);
  }
  return method;
}

tl::expected<TakeOff, FlightRefused> take_off(const plan::World& world, const FlightOptions& options) {
  const auto column = plan::takeoff_column(world, options.start_W, 0);
  if (!column) {
    return refuse("start " + to_text(options.start_W) +
                  " has no known floor to take off from; choose a start above one");
  }
  TakeOff rise{*column, {}, {}, 0, 0};
  rise.ground.p_W = options.start_W;
  rise.ground.p_W.z() = column->z_floor + world.reach.vehicle.body.radius;
  rise.commands = rest_to_rest(rise.ground.p_W, options.start_W, options.limits.v_max, options.limits.a_max);
  rise.risen = rise.commands.size();
  append(rise.commands, hold_commands(options.start_W, options.settle_s));
  plan::hold_until_settled(world.reach, rise.commands);
  const auto tube = plan::tube_to_rest(world, {rise.ground.p_W, Vec3::Zero()}, rise.ground, rise.commands);
  rise.clearance_m = plan::takeoff_clearance(world, tube, column->z_safe);
  if (auto why = obstacle_to_take_off(tube, rise.clearance_m); !why.empty()) return refuse(why);
  return rise;
}

tl::expected<Flight, FlightRefused> fly(const plan::World& world, const Vehicle& vehicle, const BoundModel& bounds,
                                        const FlightOptions& options) {
  for (const auto& [name, p] : {std::pair{"start", options.start_W}, std::pair{"goal", options.goal_W}}) {
    if (auto why = obstacle_to_hover(world, name, p); !why.empty()) return refuse(why);
  }
  const auto rise = take_off(world, options);
  if (!rise) return tl::make_unexpected(rise.error());
  const double z_safe = rise->column.z_safe;
  const Simulation simulation{.terms = options.terms};
  ClosedLoop loop(world.grid, vehicle, {rise->ground.p_W, Vec3::Zero()}, options.seed, simulation);
  auto commands = rise->commands;
  auto tube = plan::tube_to_rest(world, loop.estimated(), rise->ground, commands);
  if (auto why = obstacle_to_take_off(tube, plan::takeoff_clearance(world, tube, z_safe)); !why.empty())
    return refuse(why);
  if (options.sigma_scale != 1) tube = scaled_tube(world, tube, rise->ground, commands, bounds, options.sigma_scale);
  Flight flight{};
  flight.column = rise->column;
  flight.take_off = fly_piece(loop, world, {1, 0, 0, commands, tube, {}}, 0, z_safe, rise->risen, 0);

  // Route: planned from the state estimated now, with the hold at the goal; its tube is propagated once, here.
  Setpoint hover;
  hover.p_W = options.start_W;
  const State start = loop.estimated();
  flight.plan = plan::plan(world, {start, hover}, options.goal_W, options.limits);
  if (flight.plan.status != plan::PlanStatus::ok) {
    return refuse(std::string(plan::to_string(flight.plan.status)) + ": " + flight.plan.message);
  }
  commands = flight.plan.commands;
  const std::size_t arrived = commands.size();
  append(commands, hold_commands(options.goal_W, options.hold_s));
  flight.tight = method_tube(world, world.reach, start, hover, commands);
  const reach::Reachability paper(vehicle, reach::Method::paper, reach::Loop::continuous);
  flight.paper = method_tube(world, paper, start, hover, commands);
  tube = flight.tight.tube;
  if (options.sigma_scale != 1) tube = scaled_tube(world, tube, hover, commands, bounds, options.sigma_scale);
  flight.route =
      fly_piece(loop, world, {2, 0, 0, commands, tube, {}}, flight.take_off.samples.back().t, kEverywhere, arrived, 1);
  return flight;
}

FlightSummary summarise(const Flight& flight, const plan::World& world, const Vec3& goal_W) {
  FlightSummary s{};
  const auto smallest = [](const std::vector<double>& values) {
    return *std::min_element(values.begin(), values.end());
  };
  s.clearance_m = smallest(flight.route.clearance_m);
  s.take_off_clearance_m = smallest(flight.take_off.clearance_m);
  s.largest_ratio = Vec3::Zero();
  for (const auto* piece : {&flight.take_off, &flight.route}) {
    for (std::size_t k = 0; k < piece->samples.size(); ++k) {
      const auto& judged = piece->judged[k];
      for (int axis = 0; axis < 3; ++axis) {
        const auto d = static_cast<std::size_t>(axis);
        s.largest_ratio[axis] = std::max(s.largest_ratio[axis], std::abs(judged.error[d]) / judged.half_widths[d]);
      }
      s.samples += 1;
      s.inside += judged.inside ? 1 : 0;
      if (k > 0) s.length_m += (piece->samples[k].truth.p_W - piece->samples[k - 1].truth.p_W).norm();
    }
  }
  const auto& last = flight.route.samples.back();
  s.time_s = last.t;
  s.goal_error_m = (last.truth.p_W - goal_W).norm();
  // At the end the vehicle must be within the hover set of the goal, measured with the vehicle's own uncertainty.
  const auto at_goal = reach::hover_set(world.reach, world.grid, world.distance, world.bounds, goal_W);
  const auto& h = at_goal.half_widths;
  s.goal_reached = s.goal_error_m <= Vec3(h[kX], h[kY], h[kZ]).norm() + world.reach.vehicle.estimation.position;
  s.touched = std::min(s.clearance_m, s.take_off_clearance_m) <= 0;
  return s;
}

}  // namespace backwash::sim
