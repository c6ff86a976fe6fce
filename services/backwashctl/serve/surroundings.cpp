// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

#include "core/plan/planner.hpp"
#include "services/backwashctl/serve/control.hpp"
#include "services/backwashctl/serve/slice.hpp"

namespace backwash::ctl {
namespace {

struct Interrupted {};

/// One thread, which looks now and then whether all is to end: what a large map takes is not waited for.
void run_interruptible(std::size_t count, const std::function<void(std::size_t, std::size_t)>& work) {
  const std::size_t part = std::max<std::size_t>(1, count / 64);
  for (std::size_t begin = 0; begin < count; begin += part) {
    if (interrupted()) throw Interrupted{};
    work(begin, std::min(count, begin + part));
  }
}

ShownPath shown(const plan::Plan& plan) {
  ShownPath path;
  for (const Setpoint& c : plan.commands) path.commands_W.push_back(c.p_W);
  for (const auto& step : plan.tube) path.tube.push_back({step.center.p_W, step.half_widths_interval});
  return path;
}

}  // namespace

Reply Surroundings::propose(const nlohmann::json& said) {
  const auto goal = said.is_object() && said.contains("goal") ? point_of(said["goal"]) : std::nullopt;
  if (!goal || !said.contains("page") || !said["page"].is_string())
    return refusal(400, "page and goal are needed, the goal as three finite numbers, m in the map");
  const std::lock_guard lock(mutex_);
  page_ = said["page"];
  proposal_ = Proposal{page_, *goal, ++numbers_};
  preview_ = {{"number", numbers_}, {"goal", said["goal"]}, {"state", "planning"}, {"message", ""}};
  proposed_.notify_all();
  return {202, nlohmann::json{{"number", numbers_}}.dump()};
}

nlohmann::json Surroundings::preview(const std::string& page) const {
  const std::lock_guard lock(mutex_);
  return page == page_ ? preview_ : nlohmann::json();
}

nlohmann::json Surroundings::bounds_at(const map::OccupancyGrid& grid, double z) const {
  std::shared_ptr<const plan::World> world;
  {
    const std::lock_guard lock(mutex_);
    if (&grid != grid_.get()) return {};
    world = world_;
  }
  if (!world) return {};
  constexpr double kStep = 0.01;  // m/s²
  const int layer = layer_at(grid, z);
  std::vector<long> values;
  for (int j = 0; j < grid.size().y(); ++j)
    for (int i = 0; i < grid.size().x(); ++i)
      values.push_back(std::lround(world->bounds.at({i, j, layer}).w[kX] / kStep));
  return {{"values", std::move(values)}, {"most", world->bounds.largest().w[kX]}};
}

void Surroundings::build(const std::shared_ptr<const map::OccupancyGrid>& grid) {
  {
    const std::lock_guard lock(mutex_);
    grid_ = grid;
    world_ = nullptr;
  }
  std::shared_ptr<const plan::World> world;
  std::string failure;
  try {
    world = plan::build_world(*grid, model_, vehicle_, reach::Method::tight, std::nullopt, run_interruptible);
  } catch (const std::exception& e) {  // a map that is too large for this machine: the page goes on without
    failure = std::string("the map cannot be computed with here: ") + e.what();
  }
  const std::lock_guard lock(mutex_);
  world_ = std::move(world);
  failure_ = std::move(failure);
}

nlohmann::json Surroundings::planned(const Proposal& proposal) const {
  constexpr double kOld_s = 0.7, kDeadline_s = 5;
  const Vec3& goal = proposal.goal_W;
  nlohmann::json told{{"number", proposal.number}, {"goal", {goal.x(), goal.y(), goal.z()}}, {"state", "refused"}};
  const Seen seen = feed_.seen();
  const auto refused = [&](const std::string& why) {
    told["message"] = why;
    return told;
  };
  if (!world_) return refused(failure_.empty() ? "there is no map yet" : failure_);
  if (!seen.status || Clock::now() - seen.status_at > std::chrono::duration<double>(kOld_s))
    return refused("where the vehicle is is not known now");
  const auto& n = seen.status->said;
  if (n.landed || n.moving) return refused("the way begins where the vehicle rests in the air: hold first");
  Setpoint hover;
  hover.p_W = Vec3(n.setpoint.x, n.setpoint.y, n.setpoint.z);
  const plan::PlanStart start{State{Vec3(n.position.x, n.position.y, n.position.z), Vec3::Zero()}, hover};
  const auto plan =
      plan::plan(*world_, start, goal,
                 {.v_max = vehicle_.limits.v_max, .a_max = vehicle_.limits.a_max, .deadline_s = kDeadline_s});
  if (plan.status != plan::PlanStatus::ok) return refused(std::string(to_string(plan.status)) + ": " + plan.message);
  told.update(json_of(shown(plan)));
  told["state"] = "ok";
  told["message"] = "";
  told["time_s"] = plan.metrics.time_s;
  told["clearance_m"] = plan.metrics.min_clearance_m;
  return told;
}

void Surroundings::run(const std::stop_token& stopped) try {
  while (!interrupted() && !stopped.stop_requested()) {
    const Seen seen = feed_.seen();
    if (seen.grid && seen.grid != grid_) build(seen.grid);
    std::optional<Proposal> proposal;
    {
      std::unique_lock lock(mutex_);
      proposed_.wait_for(lock, std::chrono::milliseconds(200), [&] { return proposal_.has_value(); });
      std::swap(proposal, proposal_);
    }
    if (!proposal) continue;
    auto told = planned(*proposal);
    const std::lock_guard lock(mutex_);
    if (proposal->number == numbers_) preview_ = std::move(told);
  }
} catch (const Interrupted&) {
}

}  // namespace backwash::ctl
