// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>

#include "core/config/daemon_config.hpp"
#include "core/sync/latest_value.hpp"
#include "core/track/odometry_gate.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// What goes to ROS 2's topic of transforms (dds.tf): frames.odometry in frames.map by the newest loop closure, and, if
/// asked for, the body where the newest odometry has it: in frames.odometry if that is what it came in, else in
/// frames.map. A body that is not heard of any more is not repeated.
class ShownTransforms {
 public:
  explicit ShownTransforms(const config::Daemon& config);
  ShownTransforms(const ShownTransforms&) = delete;
  ShownTransforms& operator=(const ShownTransforms&) = delete;

  /// By the reader of odometry and loop closures. Wait-free.
  void close(const track::RigidShift& map_from_odom) noexcept { closures_.write(map_from_odom); }
  void add(const track::OdometrySample& sample) noexcept { samples_.write(sample); }
  /// By one other thread: what is to be sent now, CLOCK_MONOTONIC; none may be in it. Points into this.
  const dds::TfMessage& message(std::int64_t now_ns);

 private:
  dds::TransformStamped transform(const std::string& frame, const std::string& child, std::int64_t age_ns) const;
  void add_body(const track::OdometrySample& sample, std::int64_t now_ns);

  config::Transforms shown_;
  std::string map_, odometry_, body_;  // frames
  sync::LatestValue<track::RigidShift> closures_;
  sync::LatestValue<track::OdometrySample> samples_;
  std::optional<track::RigidShift> map_from_odom_;
  std::array<dds::TransformStamped, 2> transforms_{};
  dds::TfMessage message_{};
};

}  // namespace backwash::daemon
