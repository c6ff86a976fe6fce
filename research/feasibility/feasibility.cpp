// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/feasibility.hpp"

#include <cstdio>

#include "research/feasibility/set_cost.hpp"
#include "services/backwash/files.hpp"
#include "services/backwash/json.hpp"
#include "services/backwash/site/world_cache.hpp"
#include "services/backwash/tool.hpp"

namespace backwash::services {
namespace {

struct FeasibilityOptions {
  std::string map, model, vehicle;
  reach::Method method = reach::Method::tight;
  std::optional<Vec3> start, goal;
  std::optional<double> margin;
  bool json = false;
};

/// What only the sets of method tight are asked.
struct Sets {
  plan::SetCost cost;
  std::vector<plan::AgainstMargin> against;
};

/// The question about one way: its ends' regions and its tightest place.
struct Way {
  plan::Regions::Number start_region, goal_region;  ///< none where an end is not hover-safe
  bool connected() const { return start_region && start_region == goal_region; }
  std::optional<plan::Bottleneck> bottleneck;
};

plan::Regions::Number region_of(const plan::World& world, const plan::Regions& regions, const Vec3& p) {
  const auto v = world.grid.index(p);
  if (!world.grid.inside(v)) return std::nullopt;
  return regions.of_voxel[world.grid.linear(v)];
}

void print_json(const plan::World& world, const plan::Regions& regions, const std::optional<Way>& way,
                const std::optional<Sets>& sets) {
  Json list = Json::array();
  std::size_t voxels = 0;
  for (const auto& region : regions.regions) {
    list.push_back(services::to_json(region));
    voxels += region.voxels;
  }
  Json json = {{"resolution_m", world.grid.resolution()}, {"hover_safe_voxels", voxels}, {"regions", std::move(list)}};
  if (way) {
    Json entry = {{"start_region", way->start_region ? Json(*way->start_region) : Json()},
                  {"goal_region", way->goal_region ? Json(*way->goal_region) : Json()},
                  {"connected", way->connected()}};
    entry["bottleneck"] = nullptr;
    if (way->bottleneck) {
      const auto& b = *way->bottleneck;
      entry["bottleneck"] = {{"p", services::to_json(b.place_W)},
                             {"hover_safe", b.passable},
                             {"clearance_m", b.clearance_m},
                             {"free_distance_m", b.free_distance_m},
                             {"way_length_m", b.length_m}};
    }
    json["way"] = std::move(entry);
  }
  if (sets) {
    json["sigma_over_set"] = {{"safe_voxels_at_centre", sets->cost.safe_at_centre},
                              {"lost_voxels", sets->cost.lost},
                              {"margin_median_m", sets->cost.median_m},
                              {"margin_95_m", sets->cost.quantile95_m}};
    Json against = Json::array();
    for (const auto& a : sets->against)
      against.push_back({{"margin_m", a.margin_m},
                         {"voxels", a.voxels},
                         {"ball_inside_set", a.ball_inside_set},
                         {"set_inside_ball", a.set_inside_ball},
                         {"unbounded", a.unbounded},
                         {"only_ball_safe", a.only_ball_safe},
                         {"only_set_safe", a.only_set_safe}});
    json["set_against_margins"] = std::move(against);
  }
  print(json);
}

void print_text(const plan::World& world, const plan::Regions& regions, const std::optional<Way>& way,
                const std::optional<Sets>& sets) {
  std::printf("%zu hover-safe regions, voxels of %.3f m\n", regions.regions.size(), world.grid.resolution());
  constexpr std::size_t kShown = 10;
  for (std::size_t n = 0; n < std::min(kShown, regions.regions.size()); ++n) {
    const auto& r = regions.regions[n];
    std::printf("%3zu: %8zu voxels %9.3f m3, from %s to %s, widest at %s: %.3f m to spare\n", n, r.voxels, r.volume_m3,
                to_text(r.low_W).c_str(), to_text(r.high_W).c_str(), to_text(r.widest_W).c_str(), r.widest_clearance_m);
  }
  if (regions.regions.size() > kShown) std::printf("     and %zu smaller ones\n", regions.regions.size() - kShown);
  if (sets) {
    std::printf(
        "the disturbance over the set, not at its centre, costs %.1f mm of clearance (95 %%: %.1f mm) and %zu of "
        "%zu voxels\n",
        1e3 * sets->cost.median_m, 1e3 * sets->cost.quantile95_m, sets->cost.lost, sets->cost.safe_at_centre);
    for (const auto& a : sets->against)
      std::printf(
          "against a ball of %.1f m, of %zu voxels free for the body: safe with the ball alone %zu, with the set alone "
          "%zu\n",
          a.margin_m, a.voxels, a.only_ball_safe, a.only_set_safe);
  }
  if (!way) return;
  const auto name = [](plan::Regions::Number region) {
    return region ? "region " + std::to_string(*region) : std::string("no region");
  };
  std::printf("start in %s, goal in %s: %s\n", name(way->start_region).c_str(), name(way->goal_region).c_str(),
              way->connected() ? "connected" : "not connected");
  if (!way->bottleneck) {
    std::printf("no way through free voxels\n");
    return;
  }
  const auto& b = *way->bottleneck;
  std::printf("tightest place of the widest way (%.1f m): %s, %.3f m to the nearest obstacle, %s\n", b.length_m,
              to_text(b.place_W).c_str(), b.free_distance_m,
              b.passable ? (to_text(b.clearance_m, 3) + " m to spare").c_str() : "too tight for body and hover set");
}

int run(const FeasibilityOptions& options) {
  if (options.start.has_value() != options.goal.has_value())
    throw Failure(kUsage, "give both --start and --goal, or neither");
  const auto vehicle = read_vehicle(options.vehicle);
  const auto model = read_model(options.model);
  auto grid = read_map(options.map);
  const auto world =
      world_of({std::move(grid), model, options.model, vehicle, options.vehicle, options.method, options.margin});
  const auto regions = plan::hover_regions(*world);
  std::optional<Way> way;
  if (options.start) {
    way = Way{region_of(*world, regions, *options.start), region_of(*world, regions, *options.goal),
              plan::widest_way(*world, *options.start, *options.goal)};
  }
  std::optional<Sets> sets;
  if (options.method == reach::Method::tight && !options.margin)
    sets =
        Sets{plan::cost_of_set(*world, run_shown), plan::set_against_margins(*world, {0.1, 0.2, 0.3, 0.4}, run_shown)};
  options.json ? print_json(*world, regions, way, sets) : print_text(*world, regions, way, sets);
  return kOk;
}

Verb feasibility_verb(Command& app) {
  auto options = std::make_shared<FeasibilityOptions>();
  auto& command = app.add_subcommand("feasibility", "Where a vehicle can hover safely, and where a way is too tight");
  command.add_option("--map", options->map, "OctoMap file or builtin:NAME").required();
  command.add_option("--model", options->model, "model file or builtin:NAME").required();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME").required();
  add_method(command, options->method);
  command.add_option("--margin", options->margin, "constant margin in place of the sets, m").check(not_negative());
  add_point(command, "--start", options->start, "one end of a way, m");
  add_point(command, "--goal", options->goal, "its other end, m");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.footer(
      "Example:\n  backwash feasibility --map builtin:apartment --model builtin:quad-5in --vehicle builtin:quad-5in "
      "\\\n"
      "    --start 4,2,1.2 --goal 8,2,1.2");
  return {&command, [options] { return run(*options); }};
}

}  // namespace
}  // namespace backwash::services

/// `backwash feasibility`, which runs this program.
int main(int argc, char** argv) {
  return backwash::services::run_tool(argc, argv, {backwash::services::feasibility_verb});
}
