// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "core/map/load_map.hpp"
#include "core/types/geometry.hpp"

/// Readers of what others make maps of: meshes and point clouds. They see neither OctoMap nor the command line.
namespace backwash::maps {

/// Most points, or corners of triangles, that are taken from one file: 1.5 GiB of them.
inline constexpr std::size_t kMostPoints = std::size_t{64} << 20;

/// What a file holds, in its own unit and frame.
struct Geometry {
  std::vector<Vec3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< by position in `points`; none: a cloud
  std::vector<std::uint32_t> lines;                     ///< of a text: where each triangle's face is, or 0
  std::vector<Vec3> sensors;                            ///< of a cloud: where each point was seen from, or empty
  std::size_t not_finite = 0;                           ///< points of a cloud that were left out
  std::optional<std::size_t> first_not_finite;          ///< which was the first of them, counted from 1
  std::size_t stated = 0, taken = 0;                    ///< faces, or points, by the file's own count; that were read
  std::size_t no_returns = 0;                           ///< points at the sensor itself that were left out
  std::size_t fans = 0;                                 ///< faces that cross themselves
  bool single = false;                                  ///< coordinates had 32 bits
  std::string up = "z";                                 ///< the axis that its format says is up; z where it says none
  std::vector<std::string> notes;                       ///< what was found and not used, a sentence each
};

using Read = tl::expected<Geometry, map::MapError>;

/// Reads a file by its content, and by the ending of its name where that does not tell: PLY, PCD, CSV, MCAP, OBJ, glTF
/// or STL, also one that gzip made (but for a glTF that is a text). `topic`: of a recording's clouds, where it holds
/// others; `body_radius` as in read_recording. What was read is held against the file's own count. Errors, with the
/// file's name: not_found; unknown_name (another kind; of LAS, E57 and the like the command that makes a file for us);
/// corrupt (line, byte or element, the value seen and what would be right); too_large.
Read read_geometry(const std::string& path, const std::string& topic = "", double body_radius = 0);
/// Whether a regular file begins as an OctoMap file does.
bool is_octomap(const std::string& path);

/// The formats by themselves, of a file's content. PLY: ascii and both binary ones, any property types, faces of three
/// and more corners.
Read read_ply(const std::string& path, std::string_view content);
/// PCD 0.6 and 0.7: ascii, binary and binary_compressed; x, y, z of any type.
Read read_pcd(const std::string& path, std::string_view content);
/// Columns x_m, y_m, z_m or x, y, z (m), with sensor_x_m, sensor_y_m, sensor_z_m for where each was seen from.
Read read_point_csv(const std::string& path, std::string_view content);
/// The clouds of one topic in an MCAP of ROS 2 (PointCloud2, Livox' CustomMsg), in the frame that all others lead to by
/// its TFMessage and, where none places a frame, its Odometry. A frame that neither places is the body's whose poses
/// name none (PoseStamped, VehicleOdometry, an Odometry of a frame in itself), or its clouds are refused: they would
/// lie on each other. Each point's sensor is where its cloud's frame was; of a cloud in that last frame itself, the
/// body whose odometry was recorded. Left out: a cloud without a pose at its time, points at their sensor (no returns)
/// and those within `body_radius` (m) of the body, or of the sensor where no body is known: its own arms.
Read read_recording(const std::string& path, std::string_view content, const std::string& topic, double body_radius);
/// OBJ: v, f, l and p, in any order; texture and normals are not asked.
Read read_obj(const std::string& path, std::string_view content);
/// STL, whose count must be that of its bytes or words, and glTF by assimp in a process of its own: a damaged file ends
/// that, or its time, and not the caller.
Read read_mesh(const std::string& path, std::string_view content, bool gltf);

/// Adds a face of the file as triangles: a corner is a place, two are a line, and what has more is cut into ears. Where
/// it crosses itself, or has no plane, it is a fan around its first corner, which covers all of it and maybe more: that
/// is counted in `fans`. `line` is where the file says it, or 0. Precondition: the corners are in geometry.points.
/// O(corners²), seldom O(corners³).
void add_face(Geometry& geometry, std::span<const std::uint32_t> corners, std::size_t line);

/// An error of a file; `where` is empty, ":LINE" or what else follows its name.
tl::unexpected<map::MapError> corrupt(const std::string& path, const std::string& what);
tl::unexpected<map::MapError> too_large(const std::string& path, std::size_t points);

}  // namespace backwash::maps
