// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/preflight.hpp"

#include <algorithm>
#include <cstdio>

#include "core/types/odometry_timing.hpp"

namespace backwash::ctl {
namespace {

constexpr double kRounding = 1e-6;  // s

std::string number(const char* format, double value) {
  char text[128];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace

std::vector<Finding> preflight(const StatusCopy& before, const StatusCopy& after, double seconds) {
  const auto& n = after.said;
  const auto rate = [&](std::uint64_t from, std::uint64_t to) { return static_cast<double>(to - from) / seconds; };
  std::vector<Finding> findings;
  const auto add = [&](const std::string& name, bool good, const std::string& found, const std::string& advice) {
    findings.push_back({name, good, found, good ? "" : advice});
  };
  const double odometry = rate(before.said.odometry_received, n.odometry_received);
  // What the daemon was told of a slower one is in the age that it flies by (docs/model.md 4-13).
  const double longer_gap = n.odometry_lost_after - OdometryTiming::kHoldAfter;
  const double wanted = longer_gap > kRounding ? 1 / (1 / OdometryTiming::kUsual + longer_gap) : 30;
  add("odometry rate", odometry >= wanted, number("%.1f Hz used", odometry),
      number("send nav_msgs/Odometry at %.0f Hz or more on dds.odometry_topic; slower: odometry.rate_least", wanted));
  const double rejected =
      rate(before.said.odometry_rejected + before.said.odometry_refused, n.odometry_rejected + n.odometry_refused);
  add("odometry good", rejected == 0, number("%.1f rejected a second", rejected),
      after.text(&dds::Status::refused).empty() ? "see the daemon's warnings: covariance, stamps or jumps are wrong"
                                                : "refused: " + after.text(&dds::Status::refused));
  const double lost_after = OdometryTiming::kHoldAfter + std::max(0.0, longer_gap);
  add("odometry age", n.odometry_age < lost_after, number("%.3f s", n.odometry_age),
      number("the VIO or the network is late: %.3f s without odometry is HOLD", lost_after));
  add("heartbeat",
      n.heartbeat_age<1.5, controller(after) + ", " + number("%.1f s old", std::min(n.heartbeat_age, 1e6)),
                      n.frames_refused> 0
          ? "frames come without a good signature: give both sides the same key, or neither (link.signing_key)"
          : "check link.device, link.baud and link.system, and that the autopilot is on");
  add("frames, position", n.frames_aligned != 0, number("residual %.3f m", n.frame_residual_m),
      "the autopilot must follow the VIO: the residual has to fall below 0.05 m and 3 degrees");
  add("frames, motion", mismatch_named(after.text(&dds::Status::mismatch)) == Mismatch::none,
      after.text(&dds::Status::mismatch),
      "move the vehicle by hand along x, y and z: the axis named is mirrored, turned or dead in VIO or autopilot");
  const double missed = rate(before.said.ticks_missed, n.ticks_missed);
  add("control clock", missed == 0, number("%.1f periods missed a second", missed),
      "grant SCHED_FIFO (LimitRTPRIO) and keep the processors free");
  add("tick time", n.tick.p99 < 5000, number("p99 %.0f us", static_cast<double>(n.tick.p99)),
      "the control thread takes a quarter of its period and more: look for what else runs");
  add("map overlap", after.text(&dds::Status::place).empty(),
      after.text(&dds::Status::place).empty() ? "the vehicle stands in known free space"
                                              : after.text(&dds::Status::place),
      "send the map of this place, or align the VIO with it, and put the vehicle where there is room to rise");
  const auto map_age = measured(n.map_age);
  add("map age", map_age.has_value(), map_age ? number("%.1f s", *map_age) : "no map", "send a map");
  for (const auto& [name, value] : after.parameters) {
    const auto advice = std::ranges::find(after.advice, name, &std::pair<std::string, std::string>::first);
    add(name, advice == after.advice.end(), number("%g", value), advice == after.advice.end() ? "" : advice->second);
  }
  for (const auto& [name, advice] : after.advice)
    if (std::ranges::find(after.parameters, name, &std::pair<std::string, double>::first) == after.parameters.end())
      add(name, false, "not known", advice);
  return findings;
}

}  // namespace backwash::ctl
