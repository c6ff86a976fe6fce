// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/site/map_info.hpp"

#include <algorithm>
#include <cstdio>

#include "core/plan/feasibility.hpp"
#include "core/report/figures.hpp"
#include "services/backwash/files.hpp"
#include "services/parallel/parallel.hpp"

namespace backwash::services {
namespace {

struct MapInfoOptions {
  std::string map, vehicle, model, out;
  std::optional<double> height;
  bool json = false, force = false;
};

/// Middle of the layer below which half of the free voxels lie, m: at it a room shows doors and furniture.
double middle_height(const map::OccupancyGrid& grid) {
  std::vector<std::size_t> free(static_cast<std::size_t>(grid.size().z()));
  std::size_t all = 0;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const bool is_free = grid.at(n) == map::Cell::free;
    free[static_cast<std::size_t>(grid.voxel(n).z())] += is_free;
    all += is_free;
  }
  int layer = 0;
  for (std::size_t below = free[0]; 2 * below < all; below += free[static_cast<std::size_t>(layer)]) ++layer;
  return grid.center({0, 0, layer}).z();
}

void write_picture(const MapInfoOptions& options, const map::OccupancyGrid& grid) {
  const double z = options.height.value_or(middle_height(grid));
  const Vec3& low = grid.origin();
  const Vec3 high = low + grid.resolution() * grid.size().cast<double>();
  if (z < low.z() || z >= high.z())
    throw Failure(kUnavailable, options.map + ": --height " + to_text(z, 2) +
                                    " is outside the map, whose heights are " + to_text(low.z(), 2) + " to " +
                                    to_text(high.z(), 2));
  auto picture = report::seen_from_above(grid, low, high, z, z);
  picture.x.name += ", at z = " + to_text(z, 2) + " m (white: free)";
  write_file(options.out, report::picture_file(std::span(&picture, 1), options.out), options.force);
}

/// Where the vehicle may hover in this map; empty: nowhere.
plan::Regions regions_of(const MapInfoOptions& options, const map::OccupancyGrid& grid) {
  const auto vehicle = read_vehicle(options.vehicle);
  const auto model = read_model(model_of(options.vehicle, options.model));
  read_reachability(vehicle, reach::Method::tight, reach::Loop::vehicle, options.vehicle);
  progress("building the world");
  return plan::hover_regions(
      *plan::build_world(grid, model, vehicle, reach::Method::tight, std::nullopt, run_parallel));
}

Json flyable_json(const plan::Regions& regions) {
  std::size_t voxels = 0;
  for (const auto& region : regions.regions) voxels += region.voxels;
  Json json = {{"flyable", voxels > 0}, {"hover_safe_voxels", voxels}, {"regions", regions.regions.size()}};
  json["largest"] = regions.regions.empty() ? Json() : services::to_json(regions.regions.front());
  return json;
}

void print_flyable(const plan::Regions& regions) {
  if (regions.regions.empty()) {
    std::printf("flyable     no: the vehicle may hover nowhere\n");
    return;
  }
  const auto& largest = regions.regions.front();
  std::printf("flyable     yes: %zu regions to hover in, the largest %.2f m3 from %s to %s\n", regions.regions.size(),
              largest.volume_m3, to_text(largest.low_W).c_str(), to_text(largest.high_W).c_str());
  std::printf("widest at   %s, %.2f m beyond the hover set\n", to_text(largest.widest_W).c_str(),
              largest.widest_clearance_m);
}

int run(const MapInfoOptions& options) {
  if (!options.out.empty() && !options.out.ends_with(".svg") && !options.out.ends_with(".png"))
    throw Failure(kUsage, "--out " + options.out + " is no picture that can be drawn; name it .svg or .png");
  if (options.height && options.out.empty()) throw Failure(kUsage, "--height is of the picture --out; give one");
  if (!options.model.empty() && options.vehicle.empty())
    throw Failure(kUsage, "--model is asked with a --vehicle; give one");
  check_output(options.out, options.force);
  const auto grid = read_map(options.map);
  const auto count = count_cells(grid);
  std::optional<plan::Regions> regions;
  if (!options.vehicle.empty()) regions = regions_of(options, grid);
  if (!options.out.empty()) write_picture(options, grid);
  if (options.json) {
    Json json = extent_json(grid, count);
    if (regions) json.update(flyable_json(*regions));
    print(json);
  } else {
    print_extent(grid, count);
    if (regions) print_flyable(*regions);
  }
  return kOk;
}

}  // namespace

CellCount count_cells(const map::OccupancyGrid& grid) {
  CellCount count;
  std::size_t open = 0;
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const auto cell = grid.at(n);
    count.occupied += cell == map::Cell::occupied;
    count.unknown += cell == map::Cell::unknown;
    if (cell != map::Cell::free) continue;
    ++count.free;
    const Index3 v = grid.voxel(n);
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) open += grid.at(v + step * Index3::Unit(axis)) == map::Cell::unknown;
  }
  count.open_m2 = static_cast<double>(open) * grid.resolution() * grid.resolution();
  return count;
}

Json extent_json(const map::OccupancyGrid& grid, const CellCount& count) {
  const double a = grid.resolution();
  return {{"resolution_m", a},
          {"size", {grid.size().x(), grid.size().y(), grid.size().z()}},
          {"low", to_json(grid.origin())},
          {"high", to_json(Vec3(grid.origin() + a * grid.size().cast<double>()))},
          {"free_voxels", count.free},
          {"occupied_voxels", count.occupied},
          {"unknown_voxels", count.unknown},
          {"free_m3", static_cast<double>(count.free) * a * a * a},
          {"open_m2", count.open_m2}};
}

void print_extent(const map::OccupancyGrid& grid, const CellCount& count) {
  const double a = grid.resolution(), all = static_cast<double>(grid.cell_count());
  const Vec3 high = grid.origin() + a * grid.size().cast<double>();
  std::printf("resolution  %g m, %d x %d x %d voxels\n", a, grid.size().x(), grid.size().y(), grid.size().z());
  std::printf("box         %s to %s\n", to_text(grid.origin()).c_str(), to_text(high).c_str());
  std::printf("free        %zu voxels, %.1f %%, %.2f m3\n", count.free, 100 * static_cast<double>(count.free) / all,
              static_cast<double>(count.free) * a * a * a);
  std::printf("occupied    %zu voxels, %.1f %%\n", count.occupied, 100 * static_cast<double>(count.occupied) / all);
  std::printf("unknown     %zu voxels, %.1f %%; %.2f m2 between free and unknown\n", count.unknown,
              100 * static_cast<double>(count.unknown) / all, count.open_m2);
}

Verb map_info_verb(Command& group) {
  auto options = std::make_shared<MapInfoOptions>();
  auto& command = group.add_subcommand("info", "Size, what is known, and whether a vehicle can fly in a map");
  command.add_option("map", options->map, "OctoMap file or builtin:NAME").required();
  command.add_option("--vehicle", options->vehicle, "vehicle file or builtin:NAME: whether it can fly there");
  command.add_option("--model", options->model, "its model; a built-in vehicle has one of its own");
  command.add_option("--out", options->out, "picture of one height, .svg or .png");
  command.add_option("--height", options->height, "of the picture, m; default the middle of what is free");
  command.add_flag("--json", options->json, "one JSON object on stdout");
  command.add_flag("--force", options->force, "overwrite --out");
  command.footer("Example:\n  backwash map info builtin:apartment --vehicle builtin:quad-5in --out apartment.svg");
  return {&command, [options] { return run(*options); }};
}

}  // namespace backwash::services
