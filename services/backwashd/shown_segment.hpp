// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/track/flight_tick.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// The message of a point; same frame, m.
geometry_msgs_msg_dds__Point_ point(const Vec3& p);

/// What others are shown of a segment: its tube and its trajectory, in the frame that the configuration calls the
/// map's. The messages point into it.
class ShownSegment {
 public:
  ShownSegment(const track::AcceptedSegment& segment, std::string map_frame);
  ShownSegment(const ShownSegment&) = delete;
  ShownSegment& operator=(const ShownSegment&) = delete;

  const dds::Tube& tube() const noexcept { return tube_; }
  const dds::Path& trajectory() const noexcept { return trajectory_; }

 private:
  std::string map_frame_;
  std::vector<dds::TubeStep> steps_;
  std::vector<dds::PoseStamped> poses_;
  dds::Tube tube_{};
  dds::Path trajectory_{};
};

}  // namespace backwash::daemon
