// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "core/types/geometry.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// What a sensor_msgs/PointCloud2 holds of a range scan, in the message's own frame, m.
struct Cloud {
  std::vector<Vec3> points;       ///< those that are not finite are left out
  std::size_t left_out = 0;       ///< of them
  std::optional<Vec3> viewpoint;  ///< the sensor: fields vp_x, vp_y, vp_z of the first point, if the cloud has them
};

/// Largest cloud that is read: four times a dense depth image of 320 × 240, of points as drivers send them at most.
inline constexpr std::size_t kMaxCloudPoints = std::size_t{320} * 240 * 4, kMaxCloudFields = 32, kMaxPointBytes = 128;

/// Reads x, y, z (float32 or float64) of every point; nothing is read outside `data`. Errors, one line: no such fields
/// or another type, sizes that do not agree with each other or with the data (docs/faults.md row 27), big-endian data,
/// more than `most_points`. O(points).
tl::expected<Cloud, std::string> decode_cloud(const dds::PointCloud& message,
                                              std::size_t most_points = kMaxCloudPoints);

/// Smallest and largest value of a field of float32 or float64; NaN where a point has one. Nothing: no such field, or
/// no point. Precondition: decode_cloud() took the message.
std::optional<std::pair<double, double>> range_of(const dds::PointCloud& message, const std::string& field);

}  // namespace backwash::daemon
