// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/field_box.hpp"

#include <algorithm>

namespace backwash::report {
namespace {

/// How many of n are reached from the first one by steps.
int reached(int n, int step) { return (n + step - 1) / step; }

/// Whether the layer holds a bound within the view.
bool some_in(const plan::World& world, const FieldView& view, int layer) {
  for (int j = view.low.y(); j <= view.high.y(); ++j)
    for (int i = view.low.x(); i <= view.high.x(); ++i)
      if (world.bounds.codes({i, j, layer})[kZ] != 0) return true;
  return false;
}

}  // namespace

Index3 nearest_voxel(const map::OccupancyGrid& grid, const Vec3& p_W) {
  return grid.index(p_W).cwiseMax(Index3::Zero()).cwiseMin(grid.size() - Index3::Ones());
}

FieldView field_view(const map::OccupancyGrid& grid, std::span<const Vec3> path_W) {
  Vec3 low = path_W.front(), high = low;
  double height = 0;
  for (const Vec3& p : path_W) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    height += p.z() / static_cast<double>(path_W.size());
  }
  const Vec3 around = Vec3::Constant(2);
  return {nearest_voxel(grid, low - around), nearest_voxel(grid, high + around), height,
          nearest_voxel(grid, {low.x(), low.y(), height}).z()};
}

FieldBox field_box(const plan::World& world, const FieldView& view, std::size_t most) {
  Index3 low = view.low, high = view.high;
  while (low.z() < view.layer && !some_in(world, view, low.z())) ++low.z();
  while (high.z() > view.layer && !some_in(world, view, high.z())) --high.z();
  const Index3 all = high - low + Index3::Ones();
  FieldBox box{{}, world.grid.resolution(), Index3::Ones(), all, 0, {}};
  const auto of_a_layer = [&] {
    return static_cast<std::size_t>(reached(all.x(), box.stride.x())) *
           static_cast<std::size_t>(reached(all.y(), box.stride.y()));
  };
  while (of_a_layer() > most) {
    ++box.stride.x();
    ++box.stride.y();
  }
  const std::size_t layers = std::max<std::size_t>(1, most / of_a_layer());
  const auto kept = [&] {
    return (view.layer - low.z()) / box.stride.z() + (high.z() - view.layer) / box.stride.z() + 1;
  };
  while (static_cast<std::size_t>(kept()) > layers) ++box.stride.z();
  box.level = (view.layer - low.z()) / box.stride.z();
  low.z() = view.layer - box.level * box.stride.z();
  box.count = {reached(all.x(), box.stride.x()), reached(all.y(), box.stride.y()), kept()};
  box.first_W = world.grid.center(low);
  for (int k = 0; k < box.count.z(); ++k)
    for (int j = 0; j < box.count.y(); ++j)
      for (int i = 0; i < box.count.x(); ++i)
        box.codes.push_back(world.bounds.codes(low + Index3(i, j, k).cwiseProduct(box.stride))[kZ]);
  return box;
}

}  // namespace backwash::report
