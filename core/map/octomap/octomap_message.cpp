// SPDX-License-Identifier: BSD-3-Clause
#include "core/map/octomap/octomap_message.hpp"

#include <limits>
#include <stdexcept>

#include "core/map/octomap/octomap_tree.hpp"

namespace backwash::map {
namespace {

using octomap_tree::kCenter;
using octomap_tree::kDepth;

/// What a cube of voxels holds: one value throughout, or a subtree.
enum class Content : std::uint16_t { unknown = 0, free = 1, occupied = 2, subtree = 3 };  // the codes of the stream

/// Appends the subtree of the cube at `key` with 2^level voxels edge; nothing if one value fills it (pruning).
Content append_node(const OccupancyGrid& grid, const Index3& key, const Index3& corner, int level,
                    std::vector<std::int8_t>& out) {
  const Index3 low = key - corner;
  const int edge = 1 << level;
  if ((low.array() + edge <= 0).any() || (low.array() >= grid.size().array()).any()) return Content::unknown;
  if (level == 0) return static_cast<Content>(grid.at(low));

  const std::size_t start = out.size();
  out.resize(start + 2);
  std::uint16_t children = 0;
  for (int i = 0; i < 8; ++i) {
    const Index3 child = octomap_tree::child_key(key, i, edge / 2);
    const auto code = static_cast<std::uint16_t>(append_node(grid, child, corner, level - 1, out));
    children = static_cast<std::uint16_t>(children | code << (2 * i));
  }
  const auto first = static_cast<std::uint16_t>(children & 3);
  if (first != 3 && children == first * 0x5555) {
    out.resize(start);
    return static_cast<Content>(first);
  }
  out[start] = static_cast<std::int8_t>(children & 0xff);
  out[start + 1] = static_cast<std::int8_t>(children >> 8);
  return Content::subtree;
}

struct Extent {
  Index3 low = Index3::Constant(std::numeric_limits<int>::max());
  Index3 high = Index3::Constant(std::numeric_limits<int>::min());  // one past the last voxel
};

tl::unexpected<MapError> corrupt(const std::string& what) {
  return tl::make_unexpected(MapError{MapError::Kind::corrupt, "octomap: " + what});
}

std::string by(const Index3& n) {
  return std::to_string(n.x()) + " x " + std::to_string(n.y()) + " x " + std::to_string(n.z());
}

}  // namespace

std::vector<std::int8_t> encode_octomap(const OccupancyGrid& grid) {
  const Vec3 voxels = grid.origin() / grid.resolution();
  const Vec3 lattice = voxels.array().round();
  if (!((voxels - lattice).cwiseAbs().maxCoeff() < 1e-3)) {
    throw std::invalid_argument("octomap: the grid's corner is not a multiple of its resolution");
  }
  if (lattice.minCoeff() < -kCenter || (lattice + grid.size().cast<double>()).maxCoeff() > kCenter) {
    throw std::invalid_argument("octomap: the grid reaches beyond 32768 voxels from the origin");
  }
  std::vector<std::int8_t> out;
  append_node(grid, Index3::Zero(), lattice.cast<int>().array() + kCenter, kDepth, out);
  return out;
}

tl::expected<OccupancyGrid, MapError> decode_octomap(std::span<const std::int8_t> data, double resolution, bool binary,
                                                     const std::string& id, std::size_t max_bytes) {
  const auto beside = octomap_tree::bytes_beside(id);
  if (!beside)
    return corrupt(
        "the id is not OcTree, ColorOcTree or OcTreeStamped; of another tree's file: convert_octree IN OUT.bt");
  if (!(resolution >= 1e-3 && resolution <= 10)) {
    return corrupt("resolution " + std::to_string(resolution) + " m, expected 0.001 to 10 m");
  }
  Extent extent;
  const auto found = octomap_tree::walk(data, binary, *beside, [&](const Index3& key, int edge, Cell) {
    extent.low = extent.low.cwiseMin(key);
    extent.high = extent.high.cwiseMax(key + Index3::Constant(edge));
  });
  if (found.fault) return corrupt(found.fault);

  const Index3 size = extent.high - extent.low;
  const auto bytes = sizeof(Cell) * size.cast<std::uint64_t>().prod();  // at most 2^48
  if (bytes > max_bytes) {
    return tl::make_unexpected(
        MapError{MapError::Kind::too_large, "octomap: " + by(size) + " voxels need " + std::to_string(bytes >> 20) +
                                                " MiB, the cap is " + std::to_string(max_bytes >> 20) + " MiB"});
  }
  OccupancyGrid grid(resolution * (extent.low.array() - kCenter).cast<double>(), resolution, size);
  octomap_tree::walk(data, binary, *beside, [&](const Index3& key, int edge, Cell cell) {
    const Index3 low = key - extent.low;
    for (int k = 0; k < edge; ++k) {
      for (int j = 0; j < edge; ++j) {
        for (int i = 0; i < edge; ++i) grid.set(low + Index3(i, j, k), cell);
      }
    }
  });
  return grid;
}

}  // namespace backwash::map
