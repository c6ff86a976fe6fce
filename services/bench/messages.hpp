// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "core/config/odometry_profile.hpp"
#include "services/bench/emulation/faults.hpp"
#include "services/dds/topics.hpp"

namespace backwash::bench {

// What the bench publishes. Strings are literals, and live as long as the program.

/// A whole OcTree in a frame. `data` holds its bytes; the message points into it and into `frame`.
dds::Octomap octomap(const map::OccupancyGrid& grid, std::vector<std::int8_t>& data, const std::string& frame);

/// map <- odom, a translation (m) at `t` (s).
dds::TransformStamped loop_closure(const Vec3& t_map_odom, double t);

/// Pose in `odom` if the VIO drifts, else in `map`; twist in the body.
dds::Odometry odometry(const VioSample& sample, bool drifting);
/// The same as an estimator fills it; the message points into `profile`, whose names end with a 0.
dds::Odometry odometry(const VioSample& sample, const config::OdometryProfile& profile);

/// What a topic of poses carries (config::PoseMessage), said by the same estimate; their frames are the odometry's.
class PoseWriter {
 public:
  PoseWriter(const dds::Participant& participant, const std::string& name_space, config::PoseMessage message);
  void write(const dds::Odometry& odometry);

 private:
  using Writers = std::variant<dds::Writer<dds::Odometry>, dds::Writer<dds::PoseStamped>,
                               dds::Writer<dds::PoseWithCovarianceStamped>, dds::Writer<dds::TfMessage>>;
  static Writers made(const dds::Participant& participant, const std::string& name_space, config::PoseMessage message);

  Writers writers_;
};

}  // namespace backwash::bench
