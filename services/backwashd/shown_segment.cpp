// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/shown_segment.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace backwash::daemon {
geometry_msgs_msg_dds__Point_ point(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

ShownSegment::ShownSegment(const track::AcceptedSegment& segment, std::string map_frame)
    : map_frame_(std::move(map_frame)) {
  const std_msgs_msg_dds__Header_ header{dds::wall_clock(), dds::c_string(map_frame_)};
  for (const auto& s : segment.tube) {
    dds::TubeStep step{s.t, point(s.center.p_W), {}};
    std::copy(s.half_widths_interval.begin(), s.half_widths_interval.end(), step.half_widths);
    steps_.push_back(step);
  }
  for (const Setpoint& c : segment.commands)
    poses_.push_back({header, {point(c.p_W), {0, 0, std::sin(c.yaw / 2), std::cos(c.yaw / 2)}}});
  const auto steps = static_cast<std::uint32_t>(steps_.size()), poses = static_cast<std::uint32_t>(poses_.size());
  tube_.header = header;
  tube_.steps = {steps, steps, steps_.data(), false};
  trajectory_.header = header;
  trajectory_.poses = {poses, poses, poses_.data(), false};
}

}  // namespace backwash::daemon
