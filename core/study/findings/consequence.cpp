// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/consequence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "core/loop/position_loop.hpp"
#include "core/plan/planner.hpp"
#include "core/study/findings/extend.hpp"
#include "core/study/inference/coverage.hpp"
#include "core/types/quantile.hpp"

namespace backwash::study {
namespace {

/// What all causes add to the means and the ln variances of a window, fitted without its flight.
struct Added {
  std::array<std::vector<double>, 3> mean, ln_variance;
};
Added held_out(const StudyResult& result, const Observations& seen) {
  Added added;
  for (auto* part : {&added.mean, &added.ln_variance})
    for (auto& axis : *part) axis.assign(seen.windows.size(), 0);
  Evidence evidence(seen);
  std::vector<DesignColumn> all;
  for (const auto& cause : result.causes) all.insert(all.end(), cause.found.columns.begin(), cause.found.columns.end());
  evidence.whiten(all);
  for (const auto& cause : result.causes) {
    const auto& columns = cause.found.columns;
    const auto nuisance = cause.found.form->constant ? std::vector<DesignColumn>{} : offsets(columns, seen);
    const NormalEquations normal = evidence.normal(columns, nuisance);
    if (!normal.solvable || !cause.applied.refused.empty()) continue;
    for (std::size_t f = 0; f < seen.units.size(); ++f) {
      const SmallVector theta = normal.fit_without(f);
      for (std::size_t k = 0; k < columns.size(); ++k)
        for (const auto& part : columns[k].parts) {
          if (part.channel > kVarZ) continue;
          auto& to = part.channel <= kMeanZ ? added.mean[part.channel] : added.ln_variance[part.channel - kVarX];
          for (std::size_t i = seen.units.first[f]; i < seen.units.first[f + 1]; ++i)
            to[i] += theta[static_cast<Eigen::Index>(k)] * part.x[i];
        }
    }
    auto open = companions(*cause.found.form, seen);
    open.resize(std::min(open.size(), cause.applied.beside.size()));
    each_value(open, cause.applied.beside, [&](Channel c, std::size_t i, double x) {
      if (c <= kMeanZ) added.mean[c][i] += x;
    });
  }
  return added;
}

/// Share of the samples within push ± w̄, w̄ = mean + κ√Σ; `added`: what a model says beside Σ and mean, or null.
double inside(const Observations& seen, const BoundModel& bound, const Added* added) {
  double sum = 0, count = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < seen.windows.size(); ++i) {
      if (!(seen.weight[kVarX + axis][i] > 0) || !(seen.weight[kMeanX + axis][i] > 0)) continue;
      const auto& w = seen.windows[i];
      const auto a = static_cast<Eigen::Index>(axis);
      const double mean = seen.y[kMeanX + axis][i] - (added ? added->mean[axis][i] : 0);
      const double sigma = w.sigma[a] * (added ? std::exp(added->ln_variance[axis][i]) : 1);
      const double limit = (axis == 2 ? bound.mean_vertical : bound.mean_horizontal) + bound.kappa * std::sqrt(sigma);
      sum += share_within(mean, w.measured_variance[a], limit);
      count += 1;
    }
  return count > 0 ? sum / count : 0;
}

/// Places by map, in the order in which they were flown; a null pointer stands for no map.
std::vector<std::pair<const map::OccupancyGrid*, std::vector<Vec3>>> places_of(
    const Observations& seen, std::span<const map::OccupancyGrid* const> grids) {
  std::vector<std::pair<const map::OccupancyGrid*, std::vector<Vec3>>> all;
  const std::size_t every = seen.windows.size() / static_cast<std::size_t>(kRules.places) + 1;
  for (std::size_t i = 0; i < seen.windows.size(); i += every) {
    const auto* grid = grids.empty() ? nullptr : grids[seen.windows[i].flight];
    auto found = std::ranges::find(all, grid, [](const auto& one) { return one.first; });
    if (found == all.end()) found = all.insert(all.end(), {grid, {}});
    found->second.push_back(seen.windows[i].p_W);
  }
  return all;
}

void describe(FlightOutcome& outcome, const std::vector<reach::HoverSet>& sets) {
  std::vector<double> extent, shift;
  for (const auto& set : sets) {
    if (!set.bounded) continue;
    const auto& h = set.half_widths;
    extent.push_back(std::max({h[kX], h[kY], h[kZ]}));
    shift.push_back(set.shift.norm());
  }
  if (extent.empty()) return;  // no set is bounded
  outcome.hover = {quantile(extent, 0.5), quantile(extent, kRules.told_quantile), quantile(shift, 0.5),
                   quantile(shift, kRules.told_quantile)};
}

double safe_share(const std::vector<reach::HoverSet>& sets) {
  double share = 0;
  for (const auto& set : sets)
    if (set.safe()) share += 1 / static_cast<double>(sets.size());
  return share;
}

std::vector<reach::HoverSet> sets_at(const plan::World& world, const std::vector<Vec3>& places) {
  std::vector<reach::HoverSet> sets;
  sets.reserve(places.size());
  for (const Vec3& p : places)
    sets.push_back(reach::hover_set(world.reach, world.grid, world.distance, world.bounds, p));
  return sets;
}

/// Without a map: Σ_0, and what the extension says of open air.
std::vector<reach::HoverSet> sets_in_the_open(const Model& model, const Vehicle& vehicle) {
  const reach::Reachability reach(vehicle);
  const Air air = field::air_moving(model.extension, Vec3::Zero());
  const auto base = Variance::horizontal_vertical(model.base.horizontal, model.base.vertical);
  const auto sigma = std::exp(air.ln_variance) * base;
  reach::HoverSet set;
  const auto w = bound(sigma, model.bound);
  for (std::size_t d = 0; d < kDirections; ++d)
    set.half_widths[d] =
        d == kZ ? reach.vertical.h_inf * (w.w[d] + air.vertical) : reach.horizontal.h_inf * (w.w[d] + air.level);
  set.bounded = true;
  if (reach::has_integrator(vehicle)) {  // one voxel of open air
    const map::OccupancyGrid voxel(Vec3::Zero(), 1, Index3::Ones(), map::Cell::free);
    reach::BoundField bounds(voxel, model.bound, field::Extension(voxel, model));
    const std::size_t all[] = {0};
    bounds.update(map::all_of(voxel.size()), all, [&](const auto& store) { store(0, base); });
    const auto net = reach::NetDisturbance(
        reach, bounds)(bounds.max_without_push_over(Vec3::Zero(), Index3::Zero(), Index3::Zero()));
    for (std::size_t d = 0; d < kDirections; ++d)
      set.half_widths[d] = (d == kZ ? reach.vertical : reach.horizontal).h_inf * net.w[d];
    return {set};
  }
  set.shift = air.push_W.cwiseQuotient(loop::PositionLoop(vehicle).kp);
  return {set};
}

void try_plan(FlightOutcome& outcome, const plan::World& world, const Vec3& start_W, const Vec3& goal_W) {
  Setpoint hover;
  hover.p_W = start_W;
  const auto& limits = world.reach.vehicle.limits;
  const plan::PlanOptions options{.v_max = limits.v_max, .a_max = limits.a_max, .deadline_s = kRules.plan_deadline};
  const auto plan = plan::plan(world, {{start_W, Vec3::Zero()}, hover}, goal_W, options);
  outcome.plan = plan.status;
  outcome.flown.reset();
  if (plan.status == plan::PlanStatus::ok) outcome.flown = plan.metrics;
}

/// The two safe places farthest apart.
std::pair<Vec3, Vec3> farthest(const std::vector<Vec3>& places, const std::vector<reach::HoverSet>& sets) {
  std::pair<Vec3, Vec3> ends{places.front(), places.front()};
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (sets[i].safe() && sets[j].safe() && (places[i] - places[j]).norm() > (ends.first - ends.second).norm())
        ends = {places[j], places[i]};
  return ends;
}

}  // namespace

Consequence consequence(const StudyResult& result, const Observations& seen, const Model& model, const Vehicle& vehicle,
                        std::span<const map::OccupancyGrid* const> grids, const std::optional<Vehicle>& corrected,
                        const Parallel& parallel) {
  Consequence c;
  const Added added = held_out(result, seen);
  c.before.inside = inside(seen, model.bound, nullptr);
  c.after.inside = inside(seen, model.bound, &added);
  const Model after = extended(model, result, seen);
  const auto by_map = places_of(seen, grids);
  for (const auto& [grid, places] : by_map) c.places += places.size();
  struct Way {
    FlightOutcome& outcome;
    const Model& model;
    const Vehicle& vehicle;
    std::vector<reach::HoverSet> sets = {};
  };
  std::vector<Way> ways{{c.before, model, vehicle}, {c.after, after, vehicle}};
  if (corrected) ways.push_back({c.corrected.emplace(), model, *corrected});
  if (grids.empty() || by_map.empty()) {
    for (auto& way : ways) describe(way.outcome, sets_in_the_open(way.model, way.vehicle));
    return c;
  }
  double longest = kRules.least_route;
  for (const auto& [grid, places] : by_map) {
    std::optional<std::pair<Vec3, Vec3>> ends;  // of the plan: where it is safe before
    for (auto& way : ways) {
      const auto world = plan::build_world(*grid, way.model, way.vehicle, reach::Method::tight, std::nullopt, parallel);
      const auto here = sets_at(*world, places);
      way.sets.insert(way.sets.end(), here.begin(), here.end());
      if (!ends) ends = farthest(places, here);
      if (const auto& [start_W, goal_W] = *ends; (goal_W - start_W).norm() > longest)
        try_plan(way.outcome, *world, start_W, goal_W);
    }
    if (const double length = (ends->second - ends->first).norm(); length > longest) {
      longest = length;
      std::tie(c.start_W, c.goal_W) = *ends;
    }
  }
  for (auto& way : ways) {
    describe(way.outcome, way.sets);
    way.outcome.safe = safe_share(way.sets);
  }
  return c;
}

}  // namespace backwash::study
