// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/ends.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/field/field_update.hpp"
#include "core/types/text.hpp"

namespace backwash::plan {
namespace {

constexpr double kFirstReach = 0.3;  ///< m about an end: most hover sets are narrower
constexpr double kMostReach = 3;     ///< m: beyond it the whole world costs little more
constexpr double kAround = 1.5;      ///< m: obstacles count up to 1 m from the body and the errors of the estimate

/// Why the place itself is none to hover in.
std::optional<std::string> why_not_free(const map::OccupancyGrid& grid, const Vec3& p_W) {
  const Index3 v = grid.index(p_W);
  if (!p_W.allFinite() || !grid.inside(v)) return to_text(p_W) + " is outside the map";
  if (grid.occupied(v)) return to_text(p_W) + " is occupied";
  if (!grid.free(v)) return to_text(p_W) + " is unknown space";
  return std::nullopt;
}

std::optional<std::string> why_not_clear(const reach::HoverSet& set, const Vec3& p_W, double least_clearance) {
  if (!set.bounded) return to_text(p_W) + " is too near to obstacles: the hover set there has no bound in free space";
  if (!(set.clearance > least_clearance))
    return to_text(p_W) + " is not clear: the hover set's clearance is " + to_text(set.clearance, 3) + " m";
  return std::nullopt;
}

/// The hover set at a free place, from Σ within `within` metres of it alone. Beyond, the disturbance counts as none: a
/// set that leaves that box is too small. `model`: with the vehicle's r0.
reach::HoverSet set_from_around(const map::OccupancyGrid& grid, const Model& model, const reach::Reachability& reach,
                                const Vec3& p_W, double within) {
  const auto box_about = [&](double metres) {
    const Index3 by = Index3::Constant(static_cast<int>(std::ceil(metres / grid.resolution())) + 1);
    const Index3 v = grid.index(p_W), last = grid.size() - Index3::Ones();
    return map::VoxelBox{(v - by).cwiseMax(0), (v + by).cwiseMin(last)};
  };
  const map::VoxelBox read = box_about(within);
  map::VoxelBox needed = field::affected_columns(grid, model, read);
  const map::VoxelBox near =
      box_about(std::sqrt(3.0) * within + kAround + reach.vehicle.body.radius + reach.vehicle.estimation.position);
  needed.add(near.low);
  needed.add(near.high);
  const map::OccupancyGrid part = map::part_of(grid, needed);
  const map::DistanceField distance(part);
  const std::vector<std::size_t> voxels =
      voxels_for_centre(part, distance, reach.vehicle, {read.low - needed.low, read.high - needed.low});
  field::DisturbanceField field(part, voxels);
  const field::WholeField whole(part, model, voxels);
  field.fill(whole, 0, whole.block_count());
  const reach::BoundField bounds(part, field, model.bound);
  return hover_set(reach, part, distance, bounds, p_W);
}

/// why_no_rest() without a world. A set from too little of the field is too small: what it says is blocked is. Where
/// it leaves what was computed, more is, up to kMostReach.
std::optional<std::string> why_blocked(const map::OccupancyGrid& grid, const Model& model,
                                       const reach::Reachability& reach, std::optional<double> constant_margin,
                                       const Vec3& p_W, double least_clearance) {
  if (auto why = why_not_free(grid, p_W)) return why;
  if (constant_margin || !model.extension.empty()) return std::nullopt;
  for (double within = kFirstReach; within < kMostReach; within *= 2) {
    const auto set = set_from_around(grid, model, reach, p_W, within);
    const double widest = *std::ranges::max_element(set.half_widths);
    if (!set.bounded || widest < within) return why_not_clear(set, p_W, least_clearance);
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> why_no_rest(const World& world, const Vec3& p_W, double least_clearance) {
  if (auto why = why_not_free(world.grid, p_W)) return why;
  const auto set = reach::hover_set(world.reach, world.grid, world.distance, world.bounds, p_W, world.constant_margin);
  return why_not_clear(set, p_W, least_clearance);
}

std::optional<std::string> why_blocked_now(const World& world, const PlanStart& start, double least_clearance) {
  auto tube =
      reach::tube_over_field(world.reach, start.estimated, start.command, std::span(&start.command, 1), world.bounds);
  tube.pop_back();
  const double clearance = tube_clearance(world, tube, 0, least_clearance);
  if (clearance > least_clearance) return std::nullopt;
  return to_text(start.estimated.p_W) + ", where the vehicle is now, is not clear: the clearance is " +
         to_text(clearance, 3) + " m";
}

std::optional<Plan> refused_at_once(const map::OccupancyGrid& grid, const Model& model, const Vehicle& vehicle,
                                    reach::Method method, std::optional<double> constant_margin, const PlanStart& start,
                                    const Vec3& goal_W, const PlanOptions& options) {
  const Model vehicle_model = with_vehicle(model, vehicle);
  const reach::Reachability reach = sets_of(vehicle, method);
  const auto refused = [&](PlanStatus status, const char* end, const Vec3& p_W) -> std::optional<Plan> {
    const auto why = why_blocked(grid, vehicle_model, reach, constant_margin, p_W, options.least_clearance_m);
    if (!why) return std::nullopt;
    Plan plan;
    plan.status = status;
    plan.message = end + *why;
    return plan;
  };
  if (!model.bound.stated)  // by a risk a start is asked less than a place of rest
    if (auto plan = refused(PlanStatus::start_blocked, "start ", start.command.p_W)) return plan;
  return refused(PlanStatus::goal_blocked, "goal ", goal_W);
}

}  // namespace backwash::plan
