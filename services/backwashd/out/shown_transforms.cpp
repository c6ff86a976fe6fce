// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_transforms.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace backwash::daemon {

ShownTransforms::ShownTransforms(const config::Daemon& config)
    : shown_(config.dds.tf), map_(config.frames.map), odometry_(config.frames.odometry), body_(config.frames.body) {}

/// The identity, as it was `age_ns` ago by the wall clock.
dds::TransformStamped ShownTransforms::transform(const std::string& frame, const std::string& child,
                                                 std::int64_t age_ns) const {
  dds::TransformStamped t{};
  const std::int64_t at_ns = dds::nanoseconds(dds::wall_clock()) - std::max<std::int64_t>(age_ns, 0);
  t.header.stamp = {static_cast<std::int32_t>(at_ns / 1'000'000'000),
                    static_cast<std::uint32_t>(at_ns % 1'000'000'000)};
  t.header.frame_id = dds::c_string(frame);
  t.child_frame_id = dds::c_string(child);
  t.transform.rotation.w = 1;
  return t;
}

void ShownTransforms::add_body(const track::OdometrySample& sample, std::int64_t now_ns) {
  const bool of_odometry = sample.closures > 0;
  const track::RigidShift from_map = of_odometry ? sample.map_from_odom.inverse() : track::RigidShift{};
  const Vec3 p = from_map.point(sample.state.p_W);
  const Eigen::Quaterniond q = Eigen::AngleAxisd(from_map.yaw, Vec3::UnitZ()) *
                               Eigen::Quaterniond(sample.q[0], sample.q[1], sample.q[2], sample.q[3]);
  dds::TransformStamped t = transform(of_odometry ? odometry_ : map_, body_, now_ns - sample.received_ns);
  t.transform = {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
  transforms_[message_.transforms._length++] = t;
}

const dds::TfMessage& ShownTransforms::message(std::int64_t now_ns) {
  message_.transforms = {2, 0, transforms_.data(), false};
  if (const auto newest = closures_.read_new()) map_from_odom_ = *newest;
  const auto sample = samples_.read_new();
  if (shown_ == config::Transforms::none) return message_;
  if (map_from_odom_) {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(map_from_odom_->yaw, Vec3::UnitZ()));
    const Vec3& p = map_from_odom_->t;
    dds::TransformStamped t = transform(map_, odometry_, 0);
    t.transform = {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
    transforms_[message_.transforms._length++] = t;
  }
  if (shown_ == config::Transforms::vehicle && sample) add_body(*sample, now_ns);
  return message_;
}

}  // namespace backwash::daemon
