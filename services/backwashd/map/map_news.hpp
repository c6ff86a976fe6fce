// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/map/voxel_box.hpp"
#include "core/types/geometry.hpp"

/// What comes of maps, scans and windows, as the readers hand it to the map worker and to the control thread.
namespace backwash::daemon {

/// Who wrote a sample on the network: the DDS GUID of its writer. No two writers that live at one time share one.
using WriterId = std::array<std::uint8_t, 16>;

/// Whose map it is. In one term maps are taken of one writer alone: the first whose map was good.
struct MapWriter {
  std::uint32_t term = 0;
  WriterId writer{};
};

/// One octomap_msgs/Octomap as received.
struct MapMessage {
  std::vector<std::int8_t> data;
  double resolution = 0;
  bool binary = true;
  std::string id;
  std::int64_t received_ns = 0;
  MapWriter from{};
  std::optional<std::uint64_t> transfer{};  ///< that it came in parts by; none: it came whole
};

/// One range scan in the map.
struct Scan {
  std::vector<Vec3> points_W;  ///< m
  Vec3 sensor_W = Vec3::Zero();
  std::int64_t received_ns = 0;
  std::uint32_t closures = 0;  ///< loop closures that its map frame has seen
  std::size_t own = 0;         ///< points on the vehicle itself, which are left out
};

/// Boxes of the map's lattice that are not free any more, by a scan, a window or a map, and that the newest snapshot
/// has as free: each a cube, or longer by `more` edges along x, y, z.
struct NewVoxels {
  static constexpr std::size_t kMost = 256;
  std::int64_t received_ns = 0;
  double edge = 0;  ///< m
  std::size_t count = 0;
  std::array<std::array<double, 3>, kMost> centers{};     ///< m
  std::array<std::array<std::int32_t, 3>, kMost> more{};  ///< edges
};

/// What a mapper says of the voxels around the vehicle: a cloud of those that are occupied, or of those that are free.
struct WindowCloud {
  bool free = false;           ///< what is listed
  std::vector<Index3> voxels;  ///< of the lattice that has a corner at the origin of W, within the window
  map::VoxelBox window;        ///< of that lattice, around the vehicle
  std::int64_t stamp_ns = 0, received_ns = 0;
  bool first = false;  ///< of its writer: stamps of those before it say nothing of it
};

}  // namespace backwash::daemon
