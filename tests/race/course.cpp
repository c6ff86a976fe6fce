// SPDX-License-Identifier: BSD-3-Clause
#include "tests/race/course.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <random>

#include "core/config/builtin_files.hpp"
#include "core/map/load_map.hpp"
#include "tests/race/flown.hpp"

namespace backwash::race {
namespace {

struct Body {
  const char* name;
  double mass, radius, diagonal, rotor;
};
constexpr Body kNano{"35g", 0.035, 0.065, 0.07, 0.023}, kWhoop{"80g", 0.08, 0.08, 0.09, 0.02},
    kSmall{"250g", 0.25, 0.11, 0.125, 0.038}, kFive{"5in", 0.9, 0.16, 0.18, 0.0635},
    kSeven{"7in", 1.9, 0.22, 0.25, 0.089};
struct Gains {
  const char* name;
  double kp, kd, kp_z, kd_z, delay, lag;
};
// Of the vehicle files, of PX4 (MPC_XY_P 0.95, MPC_XY_VEL_P_ACC 1.8; MPC_Z_P 1, MPC_Z_VEL_P_ACC 4), of ArduCopter
// (PSC_POSXY_P 1, PSC_VELXY_P 2; PSC_POSZ_P 1, PSC_VELZ_P 5), stiff ones, and soft ones with a delay.
constexpr Gains kShipped5{"shipped", 10, 5.5, 12, 6, 0, 0.05}, kShipped7{"shipped", 8, 5, 10, 5.5, 0, 0.06},
    kPx4{"px4", 1.71, 1.8, 4, 4, 0, 0.1}, kArdupilot{"ardupilot", 2, 2, 5, 5, 0, 0.1},
    kStiff{"stiff", 16, 8, 16, 8, 0, 0.03}, kFirm{"firm", 12, 6, 12, 6, 0, 0.03},
    kSoft{"soft", 4, 3.2, 6, 4, 0.04, 0.08};

Vehicle vehicle_of(const Body& b, const Gains& g) {
  Vehicle v;
  v.name = std::string(b.name) + "-" + g.name;
  v.body = {b.radius, b.diagonal, b.rotor, b.mass};
  v.controller = {{g.kp, g.kp_z}, {g.kd, g.kd_z}, 0.02, g.delay, g.lag};
  v.estimation.position = 0.02;
  v.limits = {3, 2};
  v.propulsion = {2.1 * kGravity * b.mass, 0.3};
  v.initial_error = {0.02, 0.05};
  return v;
}

constexpr int kDoors = 7;
constexpr double kRoom = 3, kResolution = 0.1;

/// Eight rooms of 3 × 4 × 2.4 m in a row, walls of 0.2 m between them, doors from floor to ceiling.
map::OccupancyGrid gaps() {
  const auto cells = [](double m) { return static_cast<int>(std::lround(m / kResolution)); };
  map::OccupancyGrid grid({-kResolution, -2.1, -kResolution}, kResolution,
                          {cells((kDoors + 1) * kRoom) + 2, cells(4.2), cells(2.4) + 2}, map::Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n);
    const Vec3 p = grid.center(v);
    bool wall = (v.array() == 0).any() || (v.array() == grid.size().array() - 1).any();
    for (int door = 0; door < kDoors; ++door) {
      const double at = p.x() - (door + 1) * kRoom, half = door_of(static_cast<std::size_t>(door)) / 2;
      wall = wall || (std::abs(at) < 0.1 && std::abs(p.y() - 0.05 * (cells(2 * half) % 2)) > half);
    }
    if (wall) grid.set(v, map::Cell::occupied);
  }
  return grid;
}

std::vector<sim::RoutePair> through_doors(const Vehicle& vehicle, std::size_t count) {
  std::mt19937_64 random(std::hash<std::string>{}(vehicle.name));
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<sim::RoutePair> pairs;
  for (std::size_t n = 0; n < count; ++n) {
    const double x = kRoom * static_cast<double>(n % kDoors + 1);
    const Vec3 start(x - uniform(1.3, 1.7), uniform(-0.9, 0.9), uniform(1, 1.4));
    const Vec3 goal(x + uniform(1.3, 1.7), uniform(-0.9, 0.9), uniform(1, 1.4));
    pairs.push_back({start, goal, random()});
    if (random() % 2) std::swap(pairs.back().start_W, pairs.back().goal_W);
  }
  return pairs;
}

}  // namespace

const std::vector<Vehicle>& population() {
  static const std::vector<Vehicle> all = {
      vehicle_of(kNano, kFirm),      vehicle_of(kNano, kPx4),       vehicle_of(kWhoop, kFirm),
      vehicle_of(kSmall, kPx4),      vehicle_of(kSmall, kStiff),    vehicle_of(kFive, kShipped5),
      vehicle_of(kFive, kPx4),       vehicle_of(kFive, kArdupilot), vehicle_of(kFive, kStiff),
      vehicle_of(kFive, kSoft),      vehicle_of(kSeven, kShipped7), vehicle_of(kSeven, kPx4),
      vehicle_of(kSeven, kArdupilot)};
  return all;
}

const Vehicle& vehicle_named(std::string_view name) { return *std::ranges::find(population(), name, &Vehicle::name); }

const std::vector<Way>& ways() {
  static const std::vector<Way> all = [] {
    std::vector<Way> w = {{"tight", {}, {}}, {"risk 1e-2", 1e-2, {}}, {"risk 1e-3", 1e-3, {}}, {"risk 1e-4", 1e-4, {}}};
    for (int n = 0; n <= 12; ++n) {
      char name[32];
      std::snprintf(name, sizeof name, "margin %.2f", 0.05 * n);
      w.push_back({name, {}, 0.05 * n});
    }
    return w;
  }();
  return all;
}

const std::vector<std::string>& maps() {
  static const std::vector<std::string> names = {"forest-1", "corridors", "apartment", "gaps", "geb079"};
  return names;
}

Place place_named(const std::string& name) {
  map::OccupancyGrid grid = name == "gaps" ? gaps()
                            : name == "geb079"
                                ? map::load_octomap(BACKWASH_SOURCE_DIR "/tests/data/maps/geb079.bt").value()
                                : map::builtin_scene(name, kResolution).value();
  map::DistanceField distance(grid);
  map::OccupancySums sums(grid);
  return {name, std::move(grid), std::move(distance), std::move(sums)};
}

double door_of(std::size_t pair) { return 0.6 + 0.1 * static_cast<double>(pair % kDoors); }

std::vector<sim::RoutePair> pairs_of(const Place& place, const Vehicle& vehicle, std::size_t count) {
  if (place.name == "gaps") return through_doors(vehicle, count);
  return sim::draw_pairs(place.grid, place.distance, vehicle, count,
                         std::hash<std::string>{}(vehicle.name + place.name))
      .value_or(std::vector<sim::RoutePair>{});
}

Calibrated calibrated(const Vehicle& vehicle, double strength) {
  Model model;
  const auto grid = map::builtin_scene("parallel-walls-4m", kResolution).value();
  const map::DistanceField distance(grid);
  const field::ProximityField field(grid, plan::with_vehicle(model, vehicle));
  Calibrated result;
  std::vector<double> ratios;
  for (const double y : {-1.4, -0.8, 0.0, 0.9, 1.5}) {
    const Vec3 at(0, y, 0.6 + 0.2 * std::abs(y));
    const auto [mean, variance] = hover_disturbance(
        grid, vehicle, at, std::hash<std::string>{}(vehicle.name) + static_cast<std::uint64_t>(100 + 10 * y), strength);
    const Variance modelled = field.at(at).sigma();
    for (int axis = 0; axis < 3; ++axis)
      ratios.push_back(variance[axis] / (axis == 0 ? modelled.xx : axis == 1 ? modelled.yy : modelled.zz));
    result.bound.mean_horizontal = std::max(result.bound.mean_horizontal, mean.head<2>().norm());
    result.bound.mean_vertical = std::max(result.bound.mean_vertical, std::abs(mean.z()));
  }
  const auto n = static_cast<double>(ratios.size());
  double mean = 0, spread = 0;
  for (const double r : ratios) mean += std::log(r) / n;
  for (const double r : ratios) spread += std::pow(std::log(r) - mean, 2) / (n - 1);
  result.factor = std::exp(mean + spread / 2 + 1.64 * std::sqrt(spread / n));
  return result;
}

Worlds::Worlds(const Place& place, const Vehicle& vehicle, const Parallel& parallel)
    : place_(place),
      voxels_(plan::voxels_for_centre(place.grid, place.distance, vehicle, map::all_of(place.grid.size()))),
      field_(place.grid, voxels_),
      reach_(plan::sets_of(vehicle, reach::Method::tight)) {
  const field::WholeField whole(place.grid, plan::with_vehicle(Model{}, vehicle), voxels_);
  parallel(whole.block_count(), [&](std::size_t begin, std::size_t end) { field_.fill(whole, begin, end); });
}

plan::World Worlds::make(const Calibrated& air, const Way& way, const Parallel& parallel) const {
  Model model;
  model.bound = air.bound;
  if (way.risk) model = plan::model_for(model, reach_.vehicle, *way.risk);
  const BoundModel& bound = model.bound;
  reach::BoundField bounds(place_.grid, bound);
  bounds.update(map::all_of(place_.grid.size()), voxels_, [&](const auto& store) {
    for (const std::size_t n : voxels_) store(n, air.factor * field_.at(n));
  });
  reach::HoverMap hover(place_.grid);
  parallel(voxels_.size(), [&](std::size_t begin, std::size_t end) {
    hover.fill(reach_, place_.grid, place_.distance, place_.sums, bounds,
               std::span(voxels_).subspan(begin, end - begin), way.margin);
  });
  plan::SafeSpace safe(hover.safe_voxels());
  return {.model = plan::with_vehicle(model, reach_.vehicle),
          .grid = place_.grid,
          .distance = place_.distance,
          .sums = place_.sums,
          .bounds = std::move(bounds),
          .hover = std::move(hover),
          .safe = std::move(safe),
          .reach = reach_,
          .constant_margin = way.margin};
}

plan::Plan planned(const plan::World& world, const sim::RoutePair& pair, double v_max) {
  Setpoint hover;
  hover.p_W = pair.start_W;
  return plan::plan(world, {{hover.p_W, Vec3::Zero()}, hover}, pair.goal_W,
                    {.v_max = v_max, .a_max = 2, .deadline_s = 1e6, .max_nodes = 40'000});
}

}  // namespace backwash::race
