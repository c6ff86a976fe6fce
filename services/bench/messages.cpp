// SPDX-License-Identifier: BSD-3-Clause
#include "services/bench/messages.hpp"

#include "core/map/octomap/octomap_message.hpp"
#include "services/bench/scans.hpp"

namespace backwash::bench {

dds::Octomap octomap(const map::OccupancyGrid& grid, std::vector<std::int8_t>& data, const std::string& frame) {
  static const std::string id = "OcTree";
  data = map::encode_octomap(grid);
  dds::Octomap m{};
  m.header.frame_id = dds::c_string(frame);
  m.binary = true;
  m.id = dds::c_string(id);
  m.resolution = grid.resolution();
  const auto size = static_cast<std::uint32_t>(data.size());
  m.data = {size, size, reinterpret_cast<decltype(m.data._buffer)>(data.data()), false};
  return m;
}

dds::TransformStamped loop_closure(const Vec3& t_map_odom, double t) {
  static const std::string frame = "map", child = "odom";
  dds::TransformStamped m{};
  m.header = {stamp(t), dds::c_string(frame)};
  m.child_frame_id = dds::c_string(child);
  m.transform.translation = {t_map_odom.x(), t_map_odom.y(), t_map_odom.z()};
  m.transform.rotation = {0, 0, 0, 1};
  return m;
}

dds::Odometry odometry(const VioSample& sample, bool drifting) {
  const auto& [estimate, q, t] = sample;
  static const std::string map_frame = "map", odom_frame = "odom", child = "base_link";
  const std::string& frame = drifting ? odom_frame : map_frame;
  dds::Odometry m{};
  m.header.stamp = stamp(t);
  m.header.frame_id = dds::c_string(frame);
  m.child_frame_id = dds::c_string(child);
  m.pose.pose.position = {estimate.p_W.x(), estimate.p_W.y(), estimate.p_W.z()};
  m.pose.pose.orientation = {q.x(), q.y(), q.z(), q.w()};
  const Vec3 v_B = q.conjugate() * estimate.v_W;
  m.twist.twist.linear = {v_B.x(), v_B.y(), v_B.z()};
  return m;
}

dds::Odometry odometry(const VioSample& sample, const config::OdometryProfile& profile) {
  dds::Odometry m = odometry(sample, false);
  const auto text = [](std::string_view view) { return const_cast<char*>(view.data()); };
  m.header.frame_id = text(profile.frame);
  m.child_frame_id = text(profile.child);
  const Vec3& v_W = sample.estimate.v_W;
  if (profile.twist == config::Twist::world) m.twist.twist.linear = {v_W.x(), v_W.y(), v_W.z()};
  if (profile.twist == config::Twist::none) m.twist.twist.linear = {0, 0, 0};
  return m;
}

namespace {

void write(dds::Writer<dds::Odometry>& writer, const dds::Odometry& m) { writer.write(m); }
void write(dds::Writer<dds::PoseStamped>& writer, const dds::Odometry& m) { writer.write({m.header, m.pose.pose}); }
void write(dds::Writer<dds::PoseWithCovarianceStamped>& writer, const dds::Odometry& m) {
  writer.write({m.header, m.pose});
}

// A joint's transform goes before it, as a robot's tree of them holds many.
void write(dds::Writer<dds::TfMessage>& writer, const dds::Odometry& m) {
  static const std::string joint = "camera_mount";
  const auto& p = m.pose.pose.position;
  dds::TransformStamped transforms[2] = {
      {{m.header.stamp, m.child_frame_id}, dds::c_string(joint), {{0.1, 0, 0}, {0, 0, 0, 1}}},
      {m.header, m.child_frame_id, {{p.x, p.y, p.z}, m.pose.pose.orientation}}};
  writer.write({{2, 2, transforms, false}});
}

}  // namespace

PoseWriter::Writers PoseWriter::made(const dds::Participant& to, const std::string& name_space,
                                     config::PoseMessage message) {
  const std::string topic = dds::topic(name_space, dds::TopicOf<dds::Odometry>::kName);
  using enum config::PoseMessage;
  using dds::Delivery;
  switch (message) {
    case pose:
      return dds::Writer<dds::PoseStamped>(to, geometry_msgs_msg_dds__PoseStamped__desc, topic, Delivery::latest);
    case pose_with_covariance:
      return dds::Writer<dds::PoseWithCovarianceStamped>(to, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc,
                                                         topic, Delivery::latest);
    case tf:  // reliable, as tf2's broadcasters are
      return dds::Writer<dds::TfMessage>(to, tf2_msgs_msg_dds__TFMessage__desc, topic, Delivery::reliable);
    case odometry:
      break;
  }
  return dds::make_writer<dds::Odometry>(to, name_space);
}

PoseWriter::PoseWriter(const dds::Participant& participant, const std::string& name_space, config::PoseMessage message)
    : writers_(made(participant, name_space, message)) {}

void PoseWriter::write(const dds::Odometry& m) {
  std::visit([&](auto& writer) { bench::write(writer, m); }, writers_);
}

}  // namespace backwash::bench
