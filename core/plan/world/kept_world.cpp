// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "core/map/voxel_box.hpp"
#include "core/plan/world/world.hpp"

namespace backwash::plan {
namespace {

constexpr std::size_t kBytes =
    sizeof(reach::BoundCodes) + 1;  // of a voxel where the centre can be: w̄, and whether safe

std::vector<std::size_t> listed(const map::OccupancyGrid& grid, const map::DistanceField& distance,
                                const Vehicle& vehicle) {
  return voxels_for_centre(grid, distance, vehicle, map::all_of(grid.size()));
}

}  // namespace

std::string kept_of(const World& world) {
  const auto voxels = listed(world.grid, world.distance, world.reach.vehicle);
  std::string kept(voxels.size() * kBytes, '\0');
  char* to = kept.data();
  for (const std::size_t n : voxels) {
    const Index3 v = world.grid.voxel(n);
    std::memcpy(to, world.bounds.codes(v).data(), sizeof(reach::BoundCodes));
    to[kBytes - 1] = static_cast<char>(world.hover.safe(v));
    to += kBytes;
  }
  return kept;
}

std::shared_ptr<const World> restored_world(map::OccupancyGrid grid, const Model& model, const Vehicle& vehicle,
                                            reach::Method method, std::optional<double> constant_margin,
                                            std::string_view kept, const Parallel& parallel) {
  map::DistanceField distance(grid);
  const auto voxels = listed(grid, distance, vehicle);
  if (kept.size() != voxels.size() * kBytes) return nullptr;
  std::vector<reach::BoundCodes> codes(voxels.size());
  reach::HoverMap hover(grid);
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    std::memcpy(codes[n].data(), kept.data() + n * kBytes, sizeof(reach::BoundCodes));
    if (kept[n * kBytes + kBytes - 1]) hover.set_safe(grid.voxel(voxels[n]));
  }
  field::Extension air(grid, with_vehicle(model, vehicle));
  if (air.by_place()) air.fill(grid, voxels);
  reach::BoundField bounds(grid, model.bound, std::move(air));
  bounds.restore(voxels, codes, parallel);
  map::OccupancySums sums(grid);
  SafeSpace safe(hover.safe_voxels());
  reach::Reachability reach = sets_of(vehicle, method);
  CentreResponse response(vehicle, reach.loop);
  return std::make_shared<const World>(World{std::move(grid), std::move(distance), std::move(sums), std::move(bounds),
                                             std::move(hover), std::move(safe), std::move(reach), std::move(response),
                                             constant_margin});
}

}  // namespace backwash::plan
