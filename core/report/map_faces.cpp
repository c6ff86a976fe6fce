// SPDX-License-Identifier: BSD-3-Clause
#include "core/report/map_faces.hpp"

#include <algorithm>
#include <limits>

namespace backwash::report {
namespace {

using Face = MapFaces::Face;

/// The rectangles of one side in one plane: each begins at the first cell that is left, grows along the first axis,
/// then along the second.
class PlaneMerger {
 public:
  PlaneMerger(int side, const Index3& low, const Index3& high)
      : side_(side), axis_(side / 2), u_(axis_ == 0 ? 1 : 0), v_(axis_ == 2 ? 1 : 2), low_(low), high_(high) {
    width_ = high_[u_] - low_[u_] + 1;
    height_ = high_[v_] - low_[v_] + 1;
  }

  void merge(const map::OccupancyGrid& grid, int layer, std::vector<Face>& faces) {
    fill(grid, layer);
    for (int j = 0; j < height_; ++j)
      for (int i = 0; i < width_; ++i)
        if (at(i, j)) faces.push_back(grown(i, j, layer));
  }

 private:
  char& at(int i, int j) {
    return shown_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i)];
  }

  void fill(const map::OccupancyGrid& grid, int layer) {
    shown_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
    for (int j = 0; j < height_; ++j)
      for (int i = 0; i < width_; ++i) {
        Index3 voxel;
        voxel[axis_] = layer;
        voxel[u_] = low_[u_] + i;
        voxel[v_] = low_[v_] + j;
        if (!grid.occupied(voxel)) continue;
        voxel[axis_] += side_ % 2 == 1 ? 1 : -1;
        at(i, j) = grid.free(voxel) ? 1 : 0;
      }
  }

  Face grown(int i, int j, int layer) {
    int right = i, top = j;
    while (right + 1 < width_ && at(right + 1, j)) ++right;
    const auto whole = [&](int row) {
      for (int n = i; n <= right; ++n)
        if (!at(n, row)) return false;
      return true;
    };
    while (top + 1 < height_ && whole(top + 1)) ++top;
    for (int row = j; row <= top; ++row)
      for (int n = i; n <= right; ++n) at(n, row) = 0;
    return {side_, layer + side_ % 2, {low_[u_] + i, low_[v_] + j}, {low_[u_] + right + 1, low_[v_] + top + 1}};
  }

  int side_, axis_, u_, v_, width_, height_;
  Index3 low_, high_;
  std::vector<char> shown_;
};

Vec3 middle(const Face& face, const MapFaces& of) {
  Vec3 p;
  const int axis = face.side / 2;
  p[axis] = face.plane;
  p[axis == 0 ? 1 : 0] = 0.5 * (face.low[0] + face.high[0]);
  p[axis == 2 ? 1 : 2] = 0.5 * (face.low[1] + face.high[1]);
  return of.origin_W + of.side_m * p;
}

/// Keeps those whose middles are nearest to the path.
void keep_nearest(MapFaces& map, std::span<const Vec3> path_W, std::size_t most) {
  constexpr std::size_t kPlaces = 200;  // of the path, to be measured to
  if (map.faces.size() <= most) return;
  const std::size_t stride = path_W.size() / kPlaces + 1;
  std::vector<std::pair<double, std::size_t>> by_distance;
  for (std::size_t n = 0; n < map.faces.size(); ++n) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < path_W.size(); k += stride)
      least = std::min(least, (middle(map.faces[n], map) - path_W[k]).norm());
    by_distance.emplace_back(least, n);
  }
  std::ranges::sort(by_distance);
  std::vector<Face> kept;
  for (std::size_t n = 0; n < most; ++n) kept.push_back(map.faces[by_distance[n].second]);
  map.left_out = map.faces.size() - most;
  map.beyond_m = by_distance[most].first;
  map.faces = std::move(kept);
}

}  // namespace

MapFaces map_faces(const map::OccupancyGrid& grid, std::span<const Vec3> path_W, std::size_t most, double around_m) {
  Vec3 low = path_W.front(), high = low;
  for (const Vec3& p : path_W) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3 around = Vec3::Constant(around_m);
  const Index3 last = grid.size() - Index3::Ones();
  const Index3 from = grid.index(low - around).cwiseMax(Index3::Zero()).cwiseMin(last),
               to = grid.index(high + around).cwiseMax(Index3::Zero()).cwiseMin(last);
  MapFaces map{grid.origin(), grid.resolution(), around_m, 0, 0, {}};
  for (int side = 0; side < 6; ++side) {
    PlaneMerger merger(side, from, to);
    for (int layer = from[side / 2]; layer <= to[side / 2]; ++layer) merger.merge(grid, layer, map.faces);
  }
  keep_nearest(map, path_W, most);
  return map;
}

}  // namespace backwash::report
