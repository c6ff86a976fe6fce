// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/plan/world/world.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// What others are shown of the disturbance: its bounds in the layer of voxels at the vehicle's height, within kAround
/// of it along x and y, as a cloud for RViz and Foxglove. A point is the centre of a voxel where the vehicle's centre
/// can be, m; `level` is the largest of the four level bounds, `vertical` the one along z, m/s², float32 all of them.
class ShownField {
 public:
  static constexpr double kAround = 10;  ///< m

  /// Of a world, around `vehicle_W`, m; empty where the layer is not in the map. O(voxels of the layer's part).
  ShownField(const plan::World& world, const Vec3& vehicle_W, std::string map_frame);
  ShownField(const ShownField&) = delete;
  ShownField& operator=(const ShownField&) = delete;

  /// Points into this.
  const dds::Disturbance& cloud() const noexcept { return cloud_; }

 private:
  static constexpr std::array<const char*, 5> kFields = {"x", "y", "z", "level", "vertical"};
  static constexpr std::size_t kPointBytes = kFields.size() * sizeof(float);

  std::string map_frame_;
  std::array<std::string, kFields.size()> names_;
  std::array<dds::PointField, kFields.size()> fields_{};
  std::vector<std::uint8_t> data_;
  dds::Disturbance cloud_{};
};

/// When it is shown anew: at another world, another layer, or a tenth of kAround farther on; once a second at most.
class FieldShows {
 public:
  bool due(const plan::World& world, const Vec3& vehicle_W, std::int64_t now_ns);

 private:
  const plan::World* world_ = nullptr;  // compared, never read
  Vec3 vehicle_W_ = Vec3::Zero();
  std::int64_t last_ns_ = 0;
};

}  // namespace backwash::daemon
