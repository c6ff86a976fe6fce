// SPDX-License-Identifier: BSD-3-Clause
#include "tests/study_worlds/design_trial.hpp"

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/study/design/design.hpp"
#include "tests/study_worlds/observe.hpp"
#include "tests/study_worlds/plan.hpp"

namespace study_worlds {
namespace {

namespace study = backwash::study;

study::StudyResult studied(const study::Observations& seen) {
  study::StudyOptions options;
  options.minimum_detectable = options.dependence = false;
  return study::study(seen, options);
}

/// Set-points 20 ms apart at the generator's steps.
std::vector<Command> at_steps(const std::vector<backwash::Setpoint>& commands) {
  const int share = static_cast<int>(std::lround(backwash::kControlPeriod / kStep));
  std::vector<Command> plan;
  for (std::size_t k = 0; k + 1 < commands.size(); ++k) {
    const auto &a = commands[k], &b = commands[k + 1];
    for (int i = 0; i < share; ++i) {
      const double s = static_cast<double>(i) / share;
      plan.push_back({a.p_W + s * (b.p_W - a.p_W), a.v_W + s * (b.v_W - a.v_W), a.a_W + s * (b.a_W - a.a_W),
                      a.yaw + s * std::remainder(b.yaw - a.yaw, 2 * M_PI), -1});
    }
  }
  return plan;
}

/// The battery's charge where a flight of the world ends, by what a hover of its length takes.
double used_charge(const HiddenWorld& world, const Table& flown) {
  const double begun = world.request.confound == "battery" ? 1.0 : 0.5 * (0.55 + 1.0);
  return begun - 14 * flown.rows.back().front() / 3600 / 1.6;
}

/// The first so many seconds.
std::vector<Command> begun(std::vector<Command> plan, double seconds) {
  plan.resize(std::min(plan.size(), static_cast<std::size_t>(seconds / kStep)));
  return plan;
}

struct Arms {
  const HiddenWorld& world;
  const study::Design& design;
  double seconds, used;
  Rng rng;

  Table flight(Further kind, int number) {
    if (kind == Further::same_kind) return fly_along(world, number, begun(draw_plan(world, rng), seconds));
    if (kind == Further::free_kind) {
      HiddenWorld free = world;  // the same room, craft and cause
      free.request.confound.clear();
      const double charge = std::uniform_real_distribution(0.55, 1.0)(rng);
      return fly_along(world, number, begun(draw_plan(free, rng), seconds), charge);
    }
    const auto& all = design.flights;
    const std::size_t drawn = std::uniform_int_distribution<std::size_t>(0, all.size() - 1)(rng);
    const study::NextFlight& next = kind == Further::designed ? all.front() : all[drawn];
    return fly_along(world, number, begun(at_steps(next.commands), seconds), next.used_battery ? used : 0);
  }
};

}  // namespace

Trial trial(const MatrixCell& cell, std::uint64_t seed, const TrialOptions& options,
            const std::filesystem::path& folder) {
  Trial out;
  out.cell = cell.name;
  out.seed = seed;
  const HiddenWorld world = draw_world({seed, cell.causes, options.size, options.flights, cell.confound});
  const auto first = fly_all(world);
  const auto seen = observe(world, first, folder);
  const auto result = studied(seen);
  out.told = told(result);
  const auto sets = sets_of(result);
  out.applies = result.verdict == study::StudyVerdict::cannot_distinguish && sets.size() == 1 &&
                std::ranges::find(sets.front(), cell.causes.front()) != sets.front().end();
  if (!out.applies) return out;
  const auto vehicle = backwash::config::load_vehicle((folder / "vehicle.toml").string()).value();
  auto model = backwash::config::load_model("builtin:" + world.craft.model).value();
  model.ground.r0 = vehicle.body.diagonal_radius;
  const auto room =
      backwash::plan::build_world(backwash::map::load_map((folder / "map.bt").string()).value(), model, vehicle);
  const Vec3 start(0.5 * world.room.inside.high.x(), 0.5 * world.room.inside.high.y(), 1.2);
  const auto design = study::design(seen, result, *room, model, start, options.seconds);
  out.fitting = design.flights.size();
  out.left_out = design.left_out.size();
  out.message = design.message;
  if (design.flights.empty()) return out;
  const auto& best = design.flights.front();
  out.way = best.name + (best.used_battery ? ", used battery" : "");
  out.expected = best.flights.value_or(0);
  out.separated = best.separated;
  Arms arms{world, design, options.seconds, used_charge(world, first.front()), Rng(seed ^ 0x5eed)};
  const int before = options.flights + 1000;  // numbers, hence gusts, that no first flight has
  for (const Further kind : {Further::designed, Further::same_kind, Further::free_kind, Further::of_list})
    out.needed.push_back(observe_further(
        world, first, folder, options.most, [&](int n) { return arms.flight(kind, before + n); },
        [&](const auto& now) { return sets_of(studied(now)) == std::vector<std::vector<std::string>>{cell.causes}; }));
  return out;
}

nlohmann::json to_json(const Trial& t) {
  return {{"cell", t.cell},       {"seed", t.seed},         {"told", t.told},         {"way", t.way},
          {"message", t.message}, {"applies", t.applies},   {"expected", t.expected}, {"separated", t.separated},
          {"fitting", t.fitting}, {"left_out", t.left_out}, {"needed", t.needed}};
}

Trial trial_from_json(const nlohmann::json& j) {
  Trial t;
  t.cell = j["cell"];
  t.seed = j["seed"];
  t.told = j["told"];
  t.way = j["way"];
  t.message = j["message"];
  t.applies = j["applies"];
  t.expected = j["expected"];
  t.separated = j["separated"];
  t.fitting = j["fitting"];
  t.left_out = j["left_out"];
  t.needed = j["needed"].get<std::vector<int>>();
  return t;
}

}  // namespace study_worlds
