// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "firmware_bridge/telemetry.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// The autopilot's battery as ROS 2 says it (sensor_msgs/BatteryState): NaN, or its UNKNOWN, for what the autopilot
/// does not say. The message points into it.
class ShownBattery {
 public:
  ShownBattery() = default;
  ShownBattery(const ShownBattery&) = delete;
  ShownBattery& operator=(const ShownBattery&) = delete;

  /// What is to be sent at `now`, which is `wall_ns` by the wall clock: the newest that the autopilot said, stamped
  /// with when that came here; once, when it says nothing any more, that nothing is known. Null: it has said nothing
  /// since the last one, or that was sent less than a second ago.
  const dds::BatteryState* next(const firmware_bridge::Latest<firmware_bridge::Battery>& said,
                                firmware_bridge::Time now, std::int64_t wall_ns);

 private:
  std::optional<firmware_bridge::Time> said_, sent_;  // of the last one
  dds::BatteryState message_{};
};

}  // namespace backwash::daemon
