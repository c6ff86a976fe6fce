// SPDX-License-Identifier: BSD-3-Clause
#include "research/compare/compare.hpp"

#include <algorithm>
#include <limits>
#include <numbers>
#include <utility>

#include "core/types/thrust.hpp"

namespace backwash::sim {
namespace {

constexpr double kLeastDistance = 3;           // m
constexpr double kLowest = 0.5, kHighest = 2;  // m above what lies under a hover point
constexpr int kTries = 10'000;                 // per pair
constexpr double kSettle = 1;                  // s
constexpr double kNoDeadline = 1e6;            // s
constexpr double kAirDensity = 1.225;          // kg/m³

/// Largest set of voxels with `open` that are joined through faces, in ascending order.
std::vector<std::size_t> largest_region(const map::OccupancyGrid& grid, const std::vector<std::uint8_t>& open) {
  std::vector<std::uint8_t> seen(open.size());
  std::vector<std::size_t> largest, region;
  for (std::size_t first = 0; first < open.size(); ++first) {
    if (!open[first] || seen[first]) continue;
    region = {first};
    seen[first] = 1;
    for (std::size_t next = 0; next < region.size(); ++next) {
      const Index3 v = grid.voxel(region[next]);
      for (int axis = 0; axis < 3; ++axis)
        for (const int sign : {-1, 1}) {
          const Index3 u = v + sign * Index3::Unit(axis);
          if (!grid.inside(u) || !open[grid.linear(u)] || seen[grid.linear(u)]) continue;
          seen[grid.linear(u)] = 1;
          region.push_back(grid.linear(u));
        }
    }
    if (region.size() > largest.size()) std::swap(region, largest);
  }
  std::ranges::sort(largest);
  return largest;
}

/// Height of a free voxel's centre above the first cell that is not free under it, m.
double height(const map::OccupancyGrid& grid, Index3 v) {
  const int top = v.z();
  while (grid.free(v - Index3::UnitZ())) --v.z();
  return grid.resolution() * (top - v.z() + 0.5);
}

std::vector<Vec3> hover_points(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                               const Vehicle& vehicle) {
  const double least = vehicle.body.radius + vehicle.estimation.position;
  std::vector<std::uint8_t> open(grid.cell_count());
  for (std::size_t n = 0; n < open.size(); ++n)
    open[n] = grid.at(n) == map::Cell::free && distance.at(grid.voxel(n)) > least;
  std::vector<Vec3> points;
  for (const std::size_t n : largest_region(grid, open)) {
    const Index3 v = grid.voxel(n);
    const double above = height(grid, v);
    if (above >= kLowest && above <= kHighest) points.push_back(grid.center(v));
  }
  return points;
}

double induced_power(const Vehicle& vehicle, double thrust_N) {
  const double r = vehicle.body.rotor_radius, disc_area = 4 * std::numbers::pi * r * r;
  return std::pow(thrust_N, 1.5) / std::sqrt(2 * kAirDensity * disc_area);
}

bool outside_set(const plan::World& world, const FlightPiece& piece, std::size_t k) {
  const auto& judged = piece.judged[k];
  if (!world.constant_margin) return !judged.judged || !judged.inside;
  return (piece.samples[k].estimated.p_W - judged.center).norm() > *world.constant_margin;
}

}  // namespace

std::vector<CompareMethod> compare_methods() {
  return {{"tight"},
          {"tight-norm", reach::Method::tight, std::nullopt, true},
          {"paper", reach::Method::paper},
          {"margin-0.1", reach::Method::tight, 0.1},
          {"margin-0.2", reach::Method::tight, 0.2},
          {"margin-0.3", reach::Method::tight, 0.3},
          {"margin-0.4", reach::Method::tight, 0.4}};
}

std::optional<std::vector<RoutePair>> draw_pairs(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                                                 const Vehicle& vehicle, std::size_t count, std::uint64_t seed) {
  const std::vector<Vec3> points = hover_points(grid, distance, vehicle);
  if (points.empty()) return std::nullopt;
  // The standard fixes this engine's numbers, but not those of its distributions.
  std::mt19937_64 random(seed);
  const auto any = [&] { return points[random() % points.size()]; };
  std::vector<RoutePair> pairs;
  while (pairs.size() < count) {
    std::optional<RoutePair> pair;
    for (int n = 0; n < kTries && !pair; ++n) {
      const Vec3 start = any(), goal = any();
      if ((goal - start).norm() >= kLeastDistance) pair = RoutePair{start, goal, random()};
    }
    if (!pair) return std::nullopt;
    pairs.push_back(*pair);
  }
  return pairs;
}

Route fly_route(const plan::World& world, const Vehicle& vehicle, const RoutePair& pair, bool norm_cost) {
  Setpoint hover;
  hover.p_W = pair.start_W;
  ClosedLoop loop(world.grid, vehicle, {pair.start_W, Vec3::Zero()}, pair.seed);
  for (const auto& command : hold_commands(pair.start_W, kSettle)) loop.fly(command);
  const auto& limits = world.reach.vehicle.limits;
  Route route{
      plan::plan(world, {loop.estimated(), hover}, pair.goal_W,
                 {.v_max = limits.v_max, .a_max = limits.a_max, .deadline_s = kNoDeadline, .norm_cost = norm_cost}),
      {}};
  if (route.plan.status != plan::PlanStatus::ok) return route;
  const std::size_t count = route.plan.commands.size();
  route.piece = fly_piece(loop, world, {1, 0, 0, route.plan.commands, route.plan.tube}, 0, kEverywhere, count, 0);
  return route;
}

RouteOutcome measure(const Route& route, const plan::World& world, const Vehicle& vehicle) {
  RouteOutcome outcome;
  outcome.status = route.plan.status;
  outcome.planned = route.plan.metrics;
  outcome.planning_ms =
      outcome.planned.search_ms + outcome.planned.tubes_ms + outcome.planned.optimise_ms + outcome.planned.verify_ms;
  const auto& piece = route.piece;
  outcome.samples = piece.samples.size();
  outcome.clearance_m = std::numeric_limits<double>::infinity();
  const double larger = vehicle.body.radius - world.reach.vehicle.body.radius;  // than the planner believes
  Vec3 before = Vec3::Zero();
  for (std::size_t k = 0; k < outcome.samples; ++k) {
    const auto& sample = piece.samples[k];
    const double thrust = vehicle.propulsion.max_thrust * thrust_share(vehicle, sample.thrust),
                 clearance = piece.clearance_m[k] - larger;
    const Vec3 produced = thrust / vehicle.body.mass * (sample.attitude * Vec3::UnitZ());
    outcome.clearance_m = std::min(outcome.clearance_m, clearance);
    outcome.contacts += clearance < 0 ? 1 : 0;
    outcome.outside += outside_set(world, piece, k) ? 1 : 0;
    for (int axis = 0; axis < 3 && !world.constant_margin; ++axis) {
      const auto d = static_cast<std::size_t>(axis);
      const double ratio = std::abs(piece.judged[k].error[d]) / piece.judged[k].half_widths[d];
      outcome.largest_ratio[axis] = std::max(outcome.largest_ratio[axis], ratio);
    }
    if (k > 0) {
      outcome.flown_m += (sample.truth.p_W - piece.samples[k - 1].truth.p_W).norm();
      outcome.flown_jerk2 += (produced - before).squaredNorm() / kControlPeriod;
      outcome.energy_J += induced_power(vehicle, thrust) * kControlPeriod;
    }
    before = produced;
  }
  return outcome;
}

SceneComparison compare_scene(const std::string& scene, const plan::World& as_built,
                              const std::vector<RoutePair>& pairs, const std::vector<CompareMethod>& methods,
                              const Parallel& parallel) {
  const Vehicle& vehicle = as_built.reach.vehicle;
  SceneComparison comparison{scene, vehicle.name, pairs, {}};
  for (const auto& method : methods) {
    const auto built = plan::rebuilt(
        as_built, {.clearance = plan::Clearance{plan::sets_of(vehicle, method.sets), method.margin}}, parallel);
    const plan::World& world = *built;
    auto& outcomes = comparison.outcomes.emplace_back(pairs.size());
    parallel(pairs.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n)
        outcomes[n] = measure(fly_route(world, vehicle, pairs[n], method.norm_cost), world, vehicle);
    });
  }
  return comparison;
}

GapCampaign fly_narrow_gap(const plan::World& world, std::size_t flights, std::uint64_t seed) {
  const Vehicle& vehicle = world.reach.vehicle;
  GapCampaign campaign;
  campaign.vehicle = vehicle.name;
  for (std::size_t n = 0; n < flights; ++n) {  // a flight uses two consecutive seeds
    const auto route = fly_route(world, vehicle, {{1, 0, 1.2}, {5, 0, 1.2}, seed + 2 * n});
    const auto outcome = measure(route, world, vehicle);
    if (outcome.status != plan::PlanStatus::ok) continue;
    campaign.flights += 1;
    campaign.samples += outcome.samples;
    campaign.outside += outcome.outside;
    campaign.contacts += outcome.contacts > 0 ? 1 : 0;
    campaign.largest_ratio = campaign.largest_ratio.cwiseMax(outcome.largest_ratio);
    if (campaign.shown.empty()) campaign.shown = route.piece.judged;
  }
  return campaign;
}

}  // namespace backwash::sim
