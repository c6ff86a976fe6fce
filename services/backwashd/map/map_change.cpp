// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map/map_change.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

namespace backwash::daemon {
namespace {

using map::Cell;
using map::OccupancyGrid;
using map::VoxelBox;

// What there is to say, in a grid: occupied is what is not free any more, free is what no box may hold, and the rest
// is free neither before nor after, so that boxes may reach through it.

/// The same in cubes of twice the edge: what one of its voxels is not, a cube is not.
OccupancyGrid halved(const OccupancyGrid& said) {
  OccupancyGrid half(said.origin(), 2 * said.resolution(), (said.size() + Index3::Ones()) / 2);
  map::for_each_voxel(map::all_of(said.size()),
                      [&](const Index3& v) { half.set(v / 2, std::max(half.at(Index3(v / 2)), said.at(v))); });
  return half;
}

/// Boxes that hold all that is occupied, and nothing that is free: grown along x, then y, then z. Nothing: there are
/// more than `most`.
std::optional<std::vector<VoxelBox>> boxes(OccupancyGrid said, std::size_t most, bool grown) {
  std::vector<VoxelBox> found;
  for (std::size_t n = 0; n < said.cell_count(); ++n) {
    if (said.at(n) != Cell::occupied) continue;
    if (found.size() == most) return std::nullopt;
    VoxelBox box{said.voxel(n), said.voxel(n)};
    for (int axis = 0; axis < 3 && grown; ++axis)
      for (VoxelBox next = box; ++next.high[axis] < said.size()[axis]; box.high = next.high) {
        next.low[axis] = next.high[axis];
        bool clear = true;
        map::for_each_voxel(next, [&](const Index3& v) { clear = clear && !said.free(v); });
        if (!clear) break;
      }
    map::for_each_voxel(box, [&](const Index3& v) { said.set(v, Cell::unknown); });
    found.push_back(box);
  }
  return found;
}

NewVoxels in_boxes(OccupancyGrid said, std::int64_t received_ns) {
  auto found = boxes(said, NewVoxels::kMost, false);
  for (; !found; said = halved(said))
    if ((found = boxes(said, NewVoxels::kMost, true))) break;
  NewVoxels result;
  result.received_ns = received_ns;
  result.edge = said.resolution();
  result.count = found->size();
  for (std::size_t n = 0; n < found->size(); ++n) {
    const auto& [low, high] = (*found)[n];
    const Vec3 center = (said.center(low) + said.center(high)) / 2;
    result.centers[n] = {center.x(), center.y(), center.z()};
    result.more[n] = {high.x() - low.x(), high.y() - low.y(), high.z() - low.z()};
  }
  return result;
}

/// Along an axis, the voxels of `in` that each voxel of `of` shares more than a face with.
std::vector<std::pair<int, int>> met(const OccupancyGrid& of, const OccupancyGrid& in, int axis) {
  constexpr double kFace = 1e-6;  // of a voxel
  std::vector<std::pair<int, int>> spans;
  for (int n = 0; n < of.size()[axis]; ++n) {
    const double low = (of.origin()[axis] + n * of.resolution() - in.origin()[axis]) / in.resolution();
    const double high = low + of.resolution() / in.resolution();
    spans.emplace_back(static_cast<int>(std::floor(low + kFace)), static_cast<int>(std::ceil(high - kFace)) - 1);
  }
  return spans;
}

}  // namespace

bool same_place(const OccupancyGrid& a, const OccupancyGrid& b) {
  return a.size() == b.size() && a.resolution() == b.resolution() &&
         (a.origin() - b.origin()).cwiseAbs().maxCoeff() < 1e-6 * a.resolution();
}

VoxelBox difference(const OccupancyGrid& before, const OccupancyGrid& after) {
  VoxelBox box;
  for (std::size_t n = 0; n < after.cell_count(); ++n)
    if (before.at(n) != after.at(n)) box.add(after.voxel(n));
  return box;
}

NewVoxels news(const OccupancyGrid& before, const OccupancyGrid& after, std::int64_t received_ns) {
  const std::array spans{met(before, after, 0), met(before, after, 1), met(before, after, 2)};
  OccupancyGrid said(before.origin(), before.resolution(), before.size());
  VoxelBox around;
  map::for_each_voxel(map::all_of(before.size()), [&](const Index3& v) {
    VoxelBox there;
    for (int axis = 0; axis < 3; ++axis)
      std::tie(there.low[axis], there.high[axis]) =
          spans[static_cast<std::size_t>(axis)][static_cast<std::size_t>(v[axis])];
    bool all = true, any = false;
    map::for_each_voxel(there, [&](const Index3& at) {
      const bool free = after.free(at);
      all = all && free;
      any = any || free;
    });
    const bool new_one = !all && before.free(v);
    said.set(v, new_one ? Cell::occupied : any ? Cell::free : Cell::unknown);
    if (new_one) around.add(v);
  });
  if (around.empty()) return {received_ns};
  return in_boxes(map::part_of(said, around), received_ns);
}

NewVoxels news(const OccupancyGrid& before, std::span<const Index3> not_free, std::int64_t received_ns) {
  VoxelBox around;
  for (const Index3& v : not_free)
    if (before.free(v)) around.add(v);
  if (around.empty()) return {received_ns};
  const Index3 size = around.high - around.low + Index3::Ones();
  OccupancyGrid said(before.origin() + before.resolution() * around.low.cast<double>(), before.resolution(), size,
                     Cell::free);
  for (const Index3& v : not_free)
    if (before.free(v)) said.set(v - around.low, Cell::occupied);
  return in_boxes(std::move(said), received_ns);
}

}  // namespace backwash::daemon
