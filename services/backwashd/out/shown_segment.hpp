// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/track/flight_tick.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// The message of a point; same frame, m.
geometry_msgs_msg_dds__Point_ point(const Vec3& p);

/// What others are shown of a segment: its tube, its trajectory, and both as markers for RViz and Foxglove, in the
/// frame that the configuration calls the map's. The messages point into it.
class ShownSegment {
 public:
  ShownSegment(const track::AcceptedSegment& segment, std::string map_frame);
  ShownSegment(const ShownSegment&) = delete;
  ShownSegment& operator=(const ShownSegment&) = delete;

  const dds::Tube& tube() const noexcept { return tube_; }
  const dds::Path& trajectory() const noexcept { return trajectory_; }
  /// What was shown before is deleted first. The trajectory is a line; the tube boxes as wide as the set is along x, y
  /// and z, at most kBoxes of them, each around the sets of all steps that it stands for.
  const dds::MarkerArray& markers() const noexcept { return markers_; }
  static constexpr std::size_t kBoxes = 100;

 private:
  dds::Marker marker(std::int32_t id, std::int32_t type);
  void show_line();
  void show_boxes(const reach::ReachTube& tube);

  std::string map_frame_;
  std::vector<dds::TubeStep> steps_;
  std::vector<dds::PoseStamped> poses_;
  dds::Tube tube_{};
  dds::Path trajectory_{};
  std::vector<geometry_msgs_msg_dds__Point_> line_;
  std::vector<dds::Marker> shapes_;
  dds::MarkerArray markers_{};
};

}  // namespace backwash::daemon
