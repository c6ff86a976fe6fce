// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tuple>

#include "services/dds/topics.hpp"

namespace backwash::dds {

/// A member of the status, and where it is shown besides DDS.
template <typename T>
struct StatusMember {
  const char* key;  ///< in JSON, and in ROS 2's diagnostics: with its unit, where it has one
  T Status::*at;
  const char* on_page = nullptr;    ///< its name on the live page; none: it is not in its list, or with others
  const char* diagnosed = nullptr;  ///< printf format in the diagnostics, "" of texts and counts; none: not there
};

/// Every member but the stamp, the newest command's number and the lists: whoever copies, prints or shows the status
/// goes through these.
inline constexpr std::tuple kStatusMembers{
    StatusMember{"vehicle", &Status::vehicle},
    StatusMember{"state", &Status::state},
    StatusMember{"reason", &Status::reason},
    StatusMember{"task", &Status::task, nullptr, ""},
    StatusMember{"place", &Status::place, nullptr, ""},
    StatusMember{"refused", &Status::refused, nullptr, ""},
    StatusMember{"position", &Status::position, "position, m"},
    StatusMember{"setpoint", &Status::setpoint, "set-point, m"},
    StatusMember{"armed", &Status::armed},
    StatusMember{"offboard", &Status::offboard},
    StatusMember{"landed", &Status::landed},
    StatusMember{"moving", &Status::moving},
    StatusMember{"frames_aligned", &Status::frames_aligned},
    StatusMember{"odometry_age_s", &Status::odometry_age, "age of odometry", "%.3f"},
    StatusMember{"odometry_lost_after_s", &Status::odometry_lost_after},
    StatusMember{"heartbeat_age_s", &Status::heartbeat_age, nullptr, "%.3f"},
    StatusMember{"map_age_s", &Status::map_age, "age of map", "%.1f"},
    StatusMember{"tick_us", &Status::tick, "tick, p50 / p99 / max", "%.0f"},
    StatusMember{"lateness_us", &Status::lateness, "wake-up late"},
    StatusMember{"odometry_to_wire_us", &Status::odometry_to_wire, "odometry to wire"},
    StatusMember{"ticks", &Status::ticks},
    StatusMember{"ticks_missed", &Status::ticks_missed, "periods missed", ""},
    StatusMember{"setpoints_sent", &Status::setpoints_sent},
    StatusMember{"samples_inside", &Status::samples_inside, nullptr, ""},
    StatusMember{"samples_outside", &Status::samples_outside, nullptr, ""},
    StatusMember{"odometry_received", &Status::odometry_received},
    StatusMember{"odometry_rejected", &Status::odometry_rejected},
    StatusMember{"odometry_refused", &Status::odometry_refused},
    StatusMember{"maps_accepted", &Status::maps_accepted},
    StatusMember{"maps_rejected", &Status::maps_rejected},
    StatusMember{"scans_accepted", &Status::scans_accepted},
    StatusMember{"scans_rejected", &Status::scans_rejected},
    StatusMember{"loop_closures", &Status::loop_closures},
    StatusMember{"closures_refused", &Status::closures_refused},
    StatusMember{"foreign_writers", &Status::foreign_writers},
    StatusMember{"commands_refused", &Status::commands_refused},
    StatusMember{"frames_bad", &Status::frames_bad},
    StatusMember{"frames_refused", &Status::frames_refused},
    StatusMember{"records_lost", &Status::records_lost},
    StatusMember{"page_faults", &Status::page_faults},
    StatusMember{"parts_filtered", &Status::parts_filtered},
    StatusMember{"frame_residual_m", &Status::frame_residual_m},
    StatusMember{"frame_residual_rad", &Status::frame_residual_rad},
    StatusMember{"frame_mismatch", &Status::mismatch},
    StatusMember{"clock_offset_s", &Status::clock_offset},
    StatusMember{"clock_delay_s", &Status::clock_delay},
    StatusMember{"stop_switch", &Status::stop_switch, "stop switch"},
    StatusMember{"autopilot", &Status::autopilot},
    StatusMember{"autopilot_version", &Status::autopilot_version},
    StatusMember{"autopilot_says", &Status::autopilot_says},
    StatusMember{"air", &Status::air, "air"},
};

/// Calls `each` with every row, in that order.
template <typename Each>
void each_status_member(Each&& each) {
  std::apply([&](const auto&... member) { (each(member), ...); }, kStatusMembers);
}

}  // namespace backwash::dds
