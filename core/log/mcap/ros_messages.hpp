// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "core/reach/reach_tube.hpp"
#include "core/types/state.hpp"

/// ROS 2 messages as bytes (core/log/mcap/cdr_writer.hpp). Every one is a pure function of what it says.
namespace backwash::log::ros {

using Bytes = std::vector<std::uint8_t>;

// Frames as the daemon calls them by default: a raw log does not hold their names.
inline constexpr std::string_view kMapFrame = "map", kBodyFrame = "base_link";

/// A pose and velocity in W, as odometry says them.
struct Moving {
  State state;
  std::array<double, 4> q{1, 0, 0, 0};  ///< body to W: w, x, y, z
};

/// Of a pose: the frame that it is in, and the one that it is of.
struct Frames {
  std::string_view in = kMapFrame, of = kBodyFrame;
};

/// nav_msgs/Odometry; its twist is in the body's frame, as there. What is not recorded is marked so: variances are 0
/// (unknown), and −1 of the angular velocity (not measured).
Bytes odometry(std::int64_t stamp_ns, const Moving& vehicle, const Frames& frames = {});
/// tf2_msgs/TFMessage of one.
Bytes transform(std::int64_t stamp_ns, const Moving& vehicle, const Frames& frames = {});
/// geometry_msgs/PoseStamped of a set-point.
Bytes pose(std::int64_t stamp_ns, const Setpoint& command);
/// nav_msgs/Path of commands.
Bytes path(std::int64_t stamp_ns, std::span<const Setpoint> commands);
/// visualization_msgs/MarkerArray, as the daemon's topic `markers`: what was shown before is deleted, the commands are
/// a line, the tube boxes.
Bytes markers(std::int64_t stamp_ns, std::span<const Setpoint> commands, const reach::ReachTube& tube);
/// foxglove_msgs/SceneUpdate of the same: one entity `plan`, which takes the place of the one before it, of the
/// commands as a line and the tube as cubes.
Bytes scene(std::int64_t stamp_ns, std::span<const Setpoint> commands, const reach::ReachTube& tube);
/// visualization_msgs/MarkerArray of a map: the occupied voxels that have a face to one that is not.
Bytes voxels(std::int64_t stamp_ns, const map::OccupancyGrid& grid);
/// geometry_msgs/Vector3Stamped in the map's frame.
Bytes vector(std::int64_t stamp_ns, const Vec3& v_W);
/// std_msgs/String.
Bytes text(std::string_view text);
/// rcl_interfaces/Log: one line for the operator.
enum class Level : std::uint8_t { info = 20, warning = 30, error = 40 };
Bytes line(std::int64_t stamp_ns, Level level, std::string_view text);
/// std_msgs/UInt8MultiArray as far as its octets, and the octets of one again; nothing if the bytes are no such
/// message.
Bytes octets(std::size_t octets);
std::optional<std::span<const std::uint8_t>> octets_of(std::span<const std::uint8_t> message) noexcept;

}  // namespace backwash::log::ros
