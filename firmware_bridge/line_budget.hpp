// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>

#include "core/types/vehicle.hpp"
#include "firmware_bridge/telemetry.hpp"

namespace backwash::firmware_bridge {

/// How many bytes a line carries, ours of them, and how many a frame has on it.
struct LineRate {
  double bytes_per_second = std::numeric_limits<double>::infinity();
  std::size_t frame = 0;  ///< bytes of each frame; 0: as many as it has in MAVLink
};

/// Share of a serial line's rate that is used: each end may be 2.5 % off (SerialPort), and a queue must run dry.
inline constexpr double kSerialShare = 0.95;

/// A line of `baud` bit/s, 8N1, of which the share in (0, 1] is ours. `plain`: it carries the plain link.
LineRate serial_line(double baud, double share, bool plain) noexcept;

/// Whole control periods from one ODOMETRY to the next that an estimator must not have to wait longer than: 160 ms. PX4
/// begins to use external vision only while samples are less than 200 ms apart (EV_MAX_INTERVAL, EKF/common.h; it stops
/// after 400 ms), and a VIO at 30 Hz adds its own 33 ms. ArduPilot waits 300 ms (AP_VISUALODOM_TIMEOUT_MS).
inline constexpr int kLongestOdometryTicks = 8;

/// Bytes per second that a flight needs at least: set-points at 50 Hz, an ODOMETRY every kLongestOdometryTicks, and
/// what else there is. `frame`: as in LineRate. `authenticated`: MAVLink frames bear signatures.
double least_rate(std::size_t frame, bool authenticated) noexcept;

/// How much later than it believes an autopilot gets ODOMETRY, s: set-point and ODOMETRY on the line. 0 where a
/// TIMESYNC question and its answer take less than kUsefulRoundTrip on it: then the autopilot finds out by itself.
double untold_delay(const LineRate& line, bool authenticated) noexcept;
inline constexpr double kUsefulRoundTrip = 0.010;  ///< s: PX4 takes no longer one (MAX_RTT_SAMPLE, Timesync.hpp)

/// How long a question and its answer may take on a line, s: as long as set-point and ODOMETRY together may be under
/// way for the sets to be true (the vehicle file's controller.latency and feedback_delay; kUsefulRoundTrip where they
/// say less), and what the autopilot was told.
double line_allowed(const Vehicle& vehicle, double untold_delay) noexcept;

/// Thins ODOMETRY to what its line carries. A line is busy from when it is given a frame until all that it was given
/// has left it. In one such time there is at most one ODOMETRY, so that no set-point waits behind two of them, and the
/// next one comes as soon as the line has run dry. Nothing else is held back. Real-time.
class LineBudget {
 public:
  explicit LineBudget(const LineRate& line = {}) noexcept : line_(line) {}

  /// Whether an ODOMETRY may be given to the line now.
  bool carries_odometry(Time now) const noexcept { return free_at_ <= now || !odometry_; }
  /// A frame of so many bytes (MAVLink's) was given to the line.
  void give(std::size_t bytes, bool odometry, Time now) noexcept;
  /// What was given is no longer under way.
  void forget() noexcept { *this = LineBudget(line_); }
  const LineRate& line() const noexcept { return line_; }

 private:
  LineRate line_;
  Time free_at_{};
  bool odometry_ = false;  // among what is under way
};

}  // namespace backwash::firmware_bridge
