// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/adapt/in_flight.hpp"
#include "core/track/flight_tick.hpp"
#include "core/track/orders.hpp"
#include "firmware_bridge/autopilot_link.hpp"
#include "firmware_bridge/message_requests.hpp"
#include "services/backwashd/control/controlled.hpp"
#include "services/backwashd/control/pilot_reaction.hpp"
#include "services/backwashd/control/switch_reaction.hpp"
#include "services/backwashd/in/parameter_reader.hpp"
#include "services/backwashd/in/sender_clock.hpp"
#include "services/backwashd/plan/lookout.hpp"
#include "services/backwashd/service_manager.hpp"

namespace backwash::daemon {

struct Channels;

/// The 50 Hz tick: gathers what has arrived into a track::TickInput, lets track::FlightTick decide, sends what it
/// decided, and records both. The one owner of the link.
class ControlLoop {
 public:
  /// `air`: what it learns of the air from; none: it learns nothing.
  ControlLoop(Channels& channels, firmware_bridge::AutopilotLink& link, const Vehicle& vehicle, double battery_land,
              const MapSettings& map = {}, const OdometryTiming& timing = {},
              const std::optional<adapt::InFlightConstants>& air = {});

  /// One tick at `now_ns` (CLOCK_MONOTONIC), `missed` whole periods after it was due, `lateness_us` after its own
  /// period began. Real-time: wait-free, no allocation; system calls: non-blocking reads and writes of the port,
  /// getrusage.
  void tick(std::int64_t now_ns, int missed, double lateness_us) noexcept;
  /// Between ticks: takes what has arrived on the port, each message at its time, and answers TIMESYNC, which an
  /// autopilot takes for useless after 10 ms (PX4: "RTT too high"). Decides nothing. Real-time as tick().
  void listen(std::int64_t now_ns) noexcept;
  /// How long the last tick took, µs; recorded by the next one.
  void took(double compute_us) noexcept { compute_us_ = compute_us; }
  /// As of the last tick.
  const ControlView& view() const noexcept { return view_; }

 private:
  void poll(std::int64_t now_ns) noexcept;
  track::TickInput gather(std::int64_t now_ns, int missed) noexcept;
  track::AutopilotFacts autopilot(std::int64_t now_ns) const noexcept;
  bool line_slow(const track::AutopilotFacts& autopilot, std::int64_t now_ns) noexcept;
  void learn(const track::TickInput& in, const track::TickOutput& out) noexcept;
  void carry_out(adapt::AirOrder order, const track::TickInput& in) noexcept;
  void hand_over_air() noexcept;
  void tell_of_air(const AirFactors& before, const track::TickInput& in) noexcept;
  void send(const track::TickInput& in, const track::TickOutput& out) noexcept;
  void forward_odometry(std::uint8_t resets) noexcept;
  void ask_for_messages(std::int64_t now_ns) noexcept;
  void give_origin(const track::AutopilotFacts& autopilot) noexcept;
  void publish(const track::TickInput& in, const track::TickOutput& out) noexcept;
  void report(const track::TickInput& in, const track::TickOutput& out) noexcept;
  void record(log::RecordKind kind, std::int64_t t_ns, const void* bytes, std::size_t size) noexcept;
  static void on_frame(void* loop, bool outgoing, std::span<const std::uint8_t> frame) noexcept;

  Channels& channels_;
  firmware_bridge::AutopilotLink& link_;
  track::FlightTick flight_;
  Lookout lookout_;
  std::optional<adapt::InFlight> air_;
  std::uint64_t air_falls_ = 0;
  SenderClock sender_clock_;  // of the odometry's
  ParameterReader parameters_;
  bool port_open_ = true;
  firmware_bridge::MessageRequests requests_;
  int origin_asked_ = 0;
  std::optional<std::int64_t> takeoff_asked_ns_;  ///< of the autopilot, for the first time in this lift-off
  track::Orders orders_;
  SwitchReaction switch_;
  PilotReaction pilot_;
  const double line_allowed_;        ///< s
  int slow_ = 0;                     ///< ticks in a row whose newest pose is older than that
  std::optional<double> vio_sigma_;  ///< as the newest odometry that says it, m
  std::int64_t now_ns_ = 0;
  ControlView view_;
  log::TickRecord row_{};
  double compute_us_ = 0;
};

/// Where and how the control thread runs.
struct Scheduling {
  int priority = 0;        ///< SCHED_FIFO; 0: ordinary
  std::optional<int> cpu;  ///< processor that it is bound to; none: any
};

/// Thread body: ticks every 20 ms on the monotonic clock, and listens every 2 ms between ticks. It does not wait for
/// the port instead: poll() on a terminal waits for the same kernel worker as a read from an empty one
/// (SerialPort::read). Periods that an overrun has passed are skipped whole and counted; the phase is kept. Every
/// kAliveTicks ticks it tells `manager` that it lives: no other thread does, so a control thread that hangs is noticed.
void run_control(Channels& channels, ControlLoop& loop, const ServiceManager& manager = {});
inline constexpr std::uint64_t kAliveTicks = 10;

/// Gives every thread that starts from now on, the middleware's too, a stack of 512 KiB: locked memory is resident, and
/// the usual 8 MiB of each of 22 threads were half of what the daemon held. Large allocations get mappings of their
/// own, which return to the system when they end, and all threads have one heap: a world's remains do not stay.
/// What flies allocates nothing; what else allocates may wait for a thread of lower priority. Before other threads
/// start.
void limit_memory();

/// Locks the process's memory, what it has and what it will have. Where RLIMIT_MEMLOCK is finite (and CAP_IPC_LOCK is
/// not there to lift it) only what it has: with a limit on what it will have, the next large map would be refused its
/// memory in flight. Says in one warning what is not locked and which limit to raise.
void lock_memory();

/// Calls lock_memory(), touches the stack, binds the calling thread to its processor and asks for SCHED_FIFO; says in
/// one warning each what was not allowed, and goes on without it.
void make_real_time(const Scheduling& scheduling);

}  // namespace backwash::daemon
