// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/track/frame_alignment.hpp"
#include "core/track/supervisor.hpp"
#include "core/track/tracker.hpp"
#include "firmware_bridge/autopilot_link.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/odometry_gate.hpp"

namespace backwash::daemon {

/// The 50 Hz tick: newest odometry and telemetry in, supervisor, set-point and heartbeat out. The one owner of the
/// link.
class ControlLoop {
 public:
  ControlLoop(Channels& channels, firmware_bridge::AutopilotLink& link, const Vehicle& vehicle);

  /// One tick at `now_ns` (CLOCK_MONOTONIC), `missed` whole periods after it was due, `lateness_us` after its own
  /// period began. Real-time: wait-free, no allocation; system calls: non-blocking reads and writes of the port only.
  void tick(std::int64_t now_ns, int missed, double lateness_us) noexcept;
  /// How long the last tick took, µs; recorded by the next one.
  void took(double compute_us) noexcept { compute_us_ = compute_us; }

 private:
  void take_odometry(std::int64_t now_ns) noexcept;
  void align(std::int64_t now_ns) noexcept;
  void take_segment() noexcept;
  track::SupervisorInput facts(std::int64_t now_ns, int missed) noexcept;
  void send(const track::SupervisorOutput& out, const Setpoint& command, std::int64_t now_ns) noexcept;
  void publish(const track::SupervisorOutput& out, std::int64_t now_ns) noexcept;
  void record(study::RecordKind kind, std::int64_t t_ns, const void* bytes, std::size_t size) noexcept;
  static void on_frame(void* loop, bool outgoing, std::span<const std::uint8_t> frame) noexcept;

  Channels& channels_;
  firmware_bridge::AutopilotLink& link_;
  OdometryGate gate_;
  track::FrameAlignment alignment_;
  track::Supervisor supervisor_;
  track::Tracker tracker_;
  const track::AcceptedSegment* segment_ = nullptr;
  bool port_open_ = true;
  bool jump_ = false, fresh_ = false, new_segment_ = false, was_commanding_ = false;
  std::int64_t last_good_ns_ = -1, now_ns_ = 0;
  firmware_bridge::Time last_local_{};
  track::Inside inside_;
  ControlView view_;
  study::TickRecord row_{};
  double compute_us_ = 0;
};

/// Thread body: ticks every 20 ms on the monotonic clock. Periods that an overrun has passed are skipped whole and
/// counted; the phase is kept. SCHED_FIFO with `priority` (0: ordinary) where the rights allow it.
void run_control(Channels& channels, ControlLoop& loop);

/// Asks for SCHED_FIFO and locked memory for the calling thread; says in one warning what was not allowed.
void make_real_time(int priority);

}  // namespace backwash::daemon
