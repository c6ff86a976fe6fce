// SPDX-License-Identifier: BSD-3-Clause
#include "firmware_bridge/line_budget.hpp"

#include <algorithm>

#include "core/types/geometry.hpp"
#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"
#include "firmware_bridge/plain/plain.h"

namespace backwash::firmware_bridge {
namespace {

constexpr double kBitsPerByte = 10;  // 8N1
constexpr double kOtherFrames = 17;  // a second, TIMESYNC's most of them: 410 bytes to ArduPilot, 500 to PX4 measured

// On the line, of a message with such a payload.
double bytes_of(std::size_t payload, std::size_t frame, bool authenticated) noexcept {
  const std::size_t around = mavlink::kHeaderV2 + mavlink::kChecksum + (authenticated ? mavlink::kSignature : 0);
  return static_cast<double>(frame > 0 ? frame : payload + around);
}

}  // namespace

LineRate serial_line(double baud, double share, bool plain) noexcept {
  return {share * baud / kBitsPerByte, plain ? std::size_t{PLAIN_COMMAND_SIZE} : 0};
}

double least_rate(std::size_t frame, bool authenticated) noexcept {
  const auto bytes = [&](std::size_t payload) { return bytes_of(payload, frame, authenticated); };
  return bytes(mavlink::info<mavlink::SetPositionTargetLocalNed>().full_length) / kControlPeriod +
         bytes(mavlink::info<mavlink::Odometry>().full_length) / (kLongestOdometryTicks * kControlPeriod) +
         bytes(mavlink::info<mavlink::Timesync>().full_length) * kOtherFrames;
}

double untold_delay(const LineRate& line, bool authenticated) noexcept {
  const auto takes = [&](std::size_t payload) {
    return bytes_of(payload, line.frame, authenticated) / line.bytes_per_second;
  };
  if (2 * takes(mavlink::info<mavlink::Timesync>().full_length) < kUsefulRoundTrip) return 0;
  return takes(mavlink::info<mavlink::SetPositionTargetLocalNed>().full_length) +
         takes(mavlink::info<mavlink::Odometry>().full_length);
}

double line_allowed(const Vehicle& vehicle, double untold_delay) noexcept {
  return std::max(kUsefulRoundTrip, vehicle.controller.latency + vehicle.controller.feedback_delay) + untold_delay;
}

void LineBudget::give(std::size_t bytes, bool odometry, Time now) noexcept {
  const std::size_t wire = line_.frame > 0 ? line_.frame : bytes;
  if (free_at_ <= now) odometry_ = false;
  odometry_ = odometry_ || odometry;
  const std::chrono::duration<double> takes(static_cast<double>(wire) / line_.bytes_per_second);
  free_at_ = std::max(free_at_, now) + std::chrono::duration_cast<Time::duration>(takes);
}

}  // namespace backwash::firmware_bridge
