// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/status_output.hpp"

#include <cstdio>

namespace backwash::ctl {
namespace {

nlohmann::json timing(const dds::Timing& t) { return {{"p50", t.p50}, {"p99", t.p99}, {"max", t.max}}; }

}  // namespace

nlohmann::json json_of(const StatusCopy& s) {
  const auto& n = s.numbers;
  return {{"vehicle", s.vehicle},
          {"state", s.state},
          {"reason", s.reason},
          {"task", s.task},
          {"armed", static_cast<bool>(n.armed)},
          {"offboard", static_cast<bool>(n.offboard)},
          {"landed", static_cast<bool>(n.landed)},
          {"moving", static_cast<bool>(n.moving)},
          {"frames_aligned", static_cast<bool>(n.frames_aligned)},
          {"position", {n.position.x, n.position.y, n.position.z}},
          {"setpoint", {n.setpoint.x, n.setpoint.y, n.setpoint.z}},
          {"ticks", n.ticks},
          {"ticks_missed", n.ticks_missed},
          {"setpoints_sent", n.setpoints_sent},
          {"samples_inside", n.samples_inside},
          {"samples_outside", n.samples_outside},
          {"odometry_received", n.odometry_received},
          {"odometry_rejected", n.odometry_rejected},
          {"odometry_age_s", n.odometry_age},
          {"maps_accepted", n.maps_accepted},
          {"maps_rejected", n.maps_rejected},
          {"scans_accepted", n.scans_accepted},
          {"scans_rejected", n.scans_rejected},
          {"odometry_refused", n.odometry_refused},
          {"loop_closures", n.loop_closures},
          {"closures_refused", n.closures_refused},
          {"foreign_writers", n.foreign_writers},
          {"map_age_s", n.map_age},
          {"commands_refused", n.commands_refused},
          {"frames_bad", n.frames_bad},
          {"frames_refused", n.frames_refused},
          {"stop_switch", s.stop_switch},
          {"records_lost", n.records_lost},
          {"page_faults", n.page_faults},
          {"frame_residual_m", n.frame_residual_m},
          {"frame_residual_rad", n.frame_residual_rad},
          {"frame_mismatch", s.mismatch},
          {"heartbeat_age_s", n.heartbeat_age},
          {"clock_offset_s", n.clock_offset},
          {"clock_delay_s", n.clock_delay},
          {"place", s.place},
          {"parts_filtered", n.parts_filtered},
          {"refused", s.refused},
          {"autopilot", s.autopilot},
          {"autopilot_says", s.autopilot_says},
          {"parameters", s.parameters},
          {"tick_us", timing(n.tick)},
          {"lateness_us", timing(n.lateness)},
          {"odometry_to_wire_us", timing(n.odometry_to_wire)}};
}

void print(const StatusCopy& s) {
  const auto& n = s.numbers;
  std::printf("%s: %s (%s)  %s %s  at (%.2f, %.2f, %.2f)  inside %llu of %llu  ticks %llu, %llu missed\n",
              s.vehicle.c_str(), s.state.c_str(), s.reason.c_str(), n.armed ? "armed" : "disarmed",
              n.landed ? "on the ground" : (n.moving ? "flying" : "hovering"), n.position.x, n.position.y, n.position.z,
              static_cast<unsigned long long>(n.samples_inside),
              static_cast<unsigned long long>(n.samples_inside + n.samples_outside),
              static_cast<unsigned long long>(n.ticks), static_cast<unsigned long long>(n.ticks_missed));
  std::fflush(stdout);
}

}  // namespace backwash::ctl
