// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/planner.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/plan/rest.hpp"
#include "core/plan/search/ends.hpp"
#include "core/plan/spline/refinement.hpp"
#include "core/reach/clearance.hpp"
#include "core/types/text.hpp"

namespace backwash::plan {

namespace {

constexpr double kSearchShare = 0.9;   ///< of the limits: re-timing has little left to do
constexpr double kClearanceCap = 2.0;  ///< m
constexpr std::size_t kPiece = 8;      ///< steps that a clearance looks at together

Plan refused(Plan plan, PlanStatus status, std::string message) {
  plan.status = status;
  plan.message = std::move(message);
  return plan;
}

/// Why nothing is begun from there, where the vehicle has hovered. By a stated risk the sets of a moment are asked: it
/// is left, and a minute there would be no safer.
std::optional<std::string> why_not_from(const World& world, const Vec3& p_W, double least_clearance) {
  if (!world.bounds.model().stated || !world.grid.free(world.grid.index(p_W)))
    return why_no_rest(world, p_W, least_clearance);
  std::vector<Setpoint> hover(1, {p_W, Vec3::Zero(), Vec3::Zero(), 0});
  hold_until_settled(world.reach, hover);
  const auto tube = reach::tube_over_field(world.reach, {p_W, Vec3::Zero()}, hover.front(), hover, world.bounds);
  const double clearance = nearest_approach(world, tube).clearance;
  if (clearance > least_clearance) return std::nullopt;
  return to_text(p_W) + " is not clear: the clearance of hovering is " + to_text(clearance, 3) + " m";
}

/// A cap on states is a budget like the deadline: it says nothing about whether a path exists.
PlanStatus status_of(SearchFailure::Kind kind) {
  switch (kind) {
    case SearchFailure::Kind::no_path:
      return PlanStatus::no_path;
    case SearchFailure::Kind::infeasible:
      return PlanStatus::infeasible;
    default:
      return PlanStatus::deadline;
  }
}

PlanMetrics measured(PlanMetrics metrics, const BSpline& spline, const std::vector<Setpoint>& commands,
                     double clearance) {
  metrics.time_s = spline.duration();
  metrics.jerk2 = spline.jerk2();
  metrics.min_clearance_m = clearance;
  for (std::size_t k = 0; k + 1 < commands.size(); ++k)
    metrics.length_m += (commands[k + 1].p_W - commands[k].p_W).norm();
  return metrics;
}

/// At most the distance of the sets of the steps from `first` to before `end`, or `limit`: of a straight flight that
/// holds them, m.
double hull_distance(const World& world, const reach::ReachTube& tube, std::size_t first, std::size_t end, bool ball,
                     double limit) {
  const Vec3 &from = tube[first].center.p_W, &to = tube[std::min(end, tube.size() - 1)].center.p_W;
  const Vec3 along = to - from;
  const double length2 = along.squaredNorm();
  PerDirection hull{};
  double off = 0;
  for (std::size_t k = first; k <= std::min(end, tube.size() - 1); ++k) {
    const Vec3 p = tube[k].center.p_W - from;
    const double share = length2 > 0 ? std::clamp(p.dot(along) / length2, 0.0, 1.0) : 0.0;
    off = std::max(off, (p - share * along).norm());
    for (std::size_t d = 0; d < kDirections && k < end && !ball; ++d)
      hull[d] = std::max(hull[d], tube[k].half_widths_interval[d]);
  }
  return reach::swept_prism_distance(world.grid, from, to, hull, limit + off) - off;
}

}  // namespace

const char* to_string(PlanStatus status) noexcept {
  switch (status) {
    case PlanStatus::ok:
      return "ok";
    case PlanStatus::no_path:
      return "no_path";
    case PlanStatus::infeasible:
      return "infeasible";
    case PlanStatus::start_blocked:
      return "start_blocked";
    case PlanStatus::goal_blocked:
      return "goal_blocked";
    default:
      return "deadline";
  }
}

Plan plan(const World& world, const PlanStart& start, const Vec3& goal_W, const PlanOptions& options) {
  const auto begun = Clock::now();
  const auto deadline =
      begun + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.deadline_s));
  Plan result;
  if (const auto why = why_not_from(world, start.command.p_W, options.least_clearance_m))
    return refused(result, PlanStatus::start_blocked, "start " + *why);
  if (const auto why = why_blocked_now(world, start, options.least_clearance_m))
    return refused(result, PlanStatus::start_blocked, "start " + *why);
  if (const auto why = why_no_rest(world, goal_W, options.least_clearance_m))
    return refused(result, PlanStatus::goal_blocked, "goal " + *why);

  const auto path = search(SafeView(world.safe, {world.grid.index(start.command.p_W), world.grid.index(goal_W)}),
                           {start.command.p_W, start.command.v_W}, goal_W,
                           {kSearchShare * options.v_max, kSearchShare * options.a_max, options.max_nodes, deadline});
  result.metrics.search_ms = ms_since(begun);
  if (!path) return refused(result, status_of(path.error().kind), path.error().message);
  result.metrics.expanded = path->expanded;

  Refinement refined = refine(world, path->motions, start, goal_W, options, deadline);
  result.metrics.tubes_ms = refined.tubes_ms;
  result.metrics.optimise_ms = refined.optimise_ms;
  result.metrics.verify_ms = refined.verify_ms;
  result.metrics.evaluations = refined.evaluations;
  if (!refined.found && refined.out_of_time)
    return refused(result, PlanStatus::deadline, "optimisation ran out of time");
  if (!refined.found) return refused(result, PlanStatus::infeasible, refined.why);
  Refined& found = *refined.found;
  result.metrics = measured(result.metrics, found.trajectory, found.commands, found.clearance_m);
  result.metrics.risk = found.risk;
  result.status = PlanStatus::ok;
  result.trajectory = std::move(found.trajectory);
  result.commands = facing_ahead(std::move(found.commands), {start.command.yaw, 0}, options.yaw);
  result.tube = std::move(found.tube);
  return result;
}

Model model_for(Model model, const Vehicle& vehicle, double risk) {
  if (reach::has_integrator(vehicle))
    throw std::invalid_argument("no risk is known of a loop with controller.velocity_integrator");
  if (!model.extension.empty()) throw std::invalid_argument("no risk is known of an extended model");
  constexpr double kMoment = 0.05;  // s that a flight is as near as its sets allow: a choice of where to look
  const auto reach = sets_of(vehicle, reach::Method::tight);
  auto& bound = model.bound;
  const double worst = bound.kappa, a_minute = reach::kappa_of(reach, bound.tau_w, risk, 60);
  if (!(worst >= a_minute))
    throw std::invalid_argument("bound.kappa is below what the risk asks for, " + to_text(a_minute, 2));
  bound.kappa = reach::kappa_of(reach, bound.tau_w, risk, kMoment);
  bound.stated = StatedRisk{risk, a_minute / bound.kappa, worst / bound.kappa};
  return model;
}

Approach nearest_approach(const World& world, const reach::ReachTube& tube) {
  const auto& vehicle = world.reach.vehicle;
  const std::optional<double> ball = world.constant_margin;
  const double taken = reach::body_and_estimation(vehicle) + ball.value_or(0.0);
  const auto half_widths = [&](std::size_t k) { return ball ? PerDirection{} : tube[k].half_widths_interval; };
  const auto next = [&](std::size_t k) { return std::min(k + 1, tube.size() - 1); };
  // The interpolated distance is off by half a voxel's diagonal at most: that bounds each step from below. Steps whose
  // hull about a straight flight is no nearer than the nearest are passed over together.
  const double slack = world.grid.resolution() * std::sqrt(3.0) / 2 + 1e-6;
  std::vector<double> bound(tube.size());
  std::vector<std::pair<double, std::size_t>> pieces;
  double least = kClearanceCap + taken;
  for (std::size_t k = 0; k < tube.size(); ++k) {
    const PerDirection h = half_widths(k);
    const double extent = reach::circumradius(h);
    const double motion = (tube[next(k)].center.p_W - tube[k].center.p_W).norm();
    const double distance = world.distance.interpolated(tube[k].center.p_W);
    bound[k] = distance - slack - extent - motion;
    if (!std::isfinite(bound[k]))
      return {-taken, tube[k].center, tube[k].t};  // no number: nothing is known to be clear
    if (k % kPiece == 0) pieces.emplace_back(bound[k], k);
    pieces.back().first = std::min(pieces.back().first, bound[k]);
    least = std::min(least, distance + slack);  // the set holds its centre
  }
  std::ranges::sort(pieces);
  std::size_t where = pieces.front().second;
  for (const auto& [lowest, first] : pieces) {
    if (lowest >= least) break;
    const std::size_t end = std::min(first + kPiece, tube.size());
    if (hull_distance(world, tube, first, end, ball.has_value(), least) >= least) continue;
    for (std::size_t k = first; k < end; ++k) {
      if (bound[k] >= least) continue;
      const double distance =
          reach::swept_prism_distance(world.grid, tube[k].center.p_W, tube[next(k)].center.p_W, half_widths(k), least);
      if (distance < least) {
        least = distance;
        where = k;
      }
    }
  }
  return {least - taken, tube[where].center, tube[where].t};
}

reach::Risk risk_of(const World& world, const reach::ReachTube& tube, std::size_t from, double apart) {
  const BoundModel& model = world.bounds.model();
  if (!model.stated) return {};
  return reach::risk_of_touching(world.reach, world.grid, world.distance, model, tube, model.stated->touch, from,
                                 apart);
}

bool keeps(const World& world, const reach::Risk& risk) noexcept {
  const auto& stated = world.bounds.model().stated;
  return !stated || (risk.total <= stated->touch && risk.a_minute <= stated->touch);
}

double tube_clearance(const World& world, const reach::ReachTube& tube, std::size_t from, double apart) {
  from = std::min(from, tube.size() - 1);
  const double clearance =
      nearest_approach(world, {tube.begin() + static_cast<std::ptrdiff_t>(from), tube.end()}).clearance;
  return clearance > 0 && !keeps(world, risk_of(world, tube, from, apart)) ? 0 : clearance;
}

}  // namespace backwash::plan
