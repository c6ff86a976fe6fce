// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_segment.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/reach/bound/tube_boxes.hpp"

namespace backwash::daemon {
namespace {

// Of visualization_msgs/Marker.
constexpr std::int32_t kCube = 1, kLineStrip = 4, kDeleteAll = 3;

}  // namespace

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
  shapes_.push_back(marker(0, kCube));
  shapes_.back().action = kDeleteAll;
  show_line();
  show_boxes(segment.tube);
  const auto shapes = static_cast<std::uint32_t>(shapes_.size());
  markers_.markers = {shapes, shapes, shapes_.data(), false};
}

dds::Marker ShownSegment::marker(std::int32_t id, std::int32_t type) {
  static const std::string name = "backwash", none;
  dds::Marker m{};
  m.header = tube_.header;
  m.ns = dds::c_string(name);
  m.id = id;
  m.type = type;
  m.pose.orientation.w = 1;
  m.texture.header.frame_id = m.texture.format = m.texture_resource = m.text = m.mesh_resource = m.mesh_file.filename =
      dds::c_string(none);
  return m;
}

void ShownSegment::show_line() {
  constexpr double kWide = 0.02;  // m
  for (const auto& pose : poses_) line_.push_back(pose.pose.position);
  dds::Marker m = marker(0, kLineStrip);
  const auto points = static_cast<std::uint32_t>(line_.size());
  m.points = {points, points, line_.data(), false};
  m.scale.x = kWide;
  m.color = {0.1F, 0.4F, 0.9F, 1};
  shapes_.push_back(m);
}

void ShownSegment::show_boxes(const reach::ReachTube& tube) {
  for (const auto& [low, high] : reach::tube_boxes(tube, kBoxes)) {
    dds::Marker m = marker(static_cast<std::int32_t>(shapes_.size()), kCube);
    m.pose.position = point((low + high) / 2);
    m.scale = {high.x() - low.x(), high.y() - low.y(), high.z() - low.z()};
    m.color = {0.9F, 0.6F, 0.1F, 0.25F};
    shapes_.push_back(m);
  }
}

}  // namespace backwash::daemon
