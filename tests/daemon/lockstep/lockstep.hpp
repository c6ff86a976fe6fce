// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "core/log/raw/raw_log.hpp"
#include "core/sim/vehicle/vio.hpp"
#include "firmware_bridge/mavlink/messages.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/control/control_loop.hpp"
#include "services/bench/emulation/autopilot.hpp"

namespace backwash::daemon::test {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< rad

/// Shared by the tests of one program.
std::shared_ptr<const plan::World> corridor();
Vehicle vehicle_5in();

using mavlink::CommandLong;
using mavlink::SetPositionTargetLocalNed;

/// What the flight controller received in one tick, decoded from the bytes on its end of the line.
struct Wire {
  std::vector<SetPositionTargetLocalNed> setpoints;
  std::vector<CommandLong> commands;
  std::vector<std::string> texts;
  int heartbeats = 0, odometry = 0;
  std::uint64_t odometry_us = 0;  ///< time of the last ODOMETRY
  std::size_t bytes = 0;
  bool commanded(std::uint16_t command) const;
  /// Nothing that moves the vehicle or keeps a failsafe of its controller from acting; odometry may go on.
  bool silent() const { return setpoints.empty() && commands.empty() && texts.empty() && heartbeats == 0; }
};

/// The emulated flight controller in a test's hands.
class HandledAutopilot : public bench::Autopilot {
 public:
  using bench::Autopilot::Autopilot;
  /// A pilot switches to manual: set-points are not followed any more. Said in a heartbeat at once.
  void take_over() noexcept {
    mode_ = Mode::manual;
    heartbeat_due_ = true;
  }
  /// The motors stop, wherever the vehicle is. Said in a heartbeat at once.
  void disarm() noexcept {
    armed_ = false;
    vehicle_.set_motors(false);
    heartbeat_due_ = true;
  }
  /// The estimator is reset: from now on its local frame lies elsewhere.
  void reset_estimator(const bench::LocalFrame& frame) noexcept { frame_ = frame; }
};

inline constexpr std::uint16_t kCommandLand = 21, kCommandMode = 176, kCommandArm = 400;

/// What the daemon's link runs over: a pseudo-terminal, or two UDP sockets on the loopback, where a byte that was
/// written has arrived and a tick takes a tenth of the time.
enum class Medium { serial, udp };

/// The daemon's control loop and link on a real port, the bench's emulated autopilot with its simulated vehicle at the
/// other end, and time that moves by 20 ms a tick: nothing depends on the machine's speed. Each tick is watched: it
/// must not allocate, lock, read the wall clock, or send anything that is not finite.
class Lockstep {
 public:
  explicit Lockstep(const bench::LocalFrame& frame = {0.7, Vec3(5, -3, 0.2)}, Medium medium = Medium::serial,
                    std::shared_ptr<const plan::World> world = corridor(), const OdometryTiming& timing = {});
  ~Lockstep();

  /// One control period: 20 steps of physics, then one tick of the daemon.
  const Wire& tick(int missed = 0);
  void ticks(int count);
  /// Ticks until the daemon is in this mode; how many it took, or −1 after `most`.
  int ticks_until(Mode mode, int most);

  /// Enable, follow, arm, take off to 1.2 m. Ends in tracking, the take-off's commands all sent.
  void take_off();
  /// Plans to the goal, offers it with its stops, and flies `seconds` of it.
  void start_route(double seconds);
  /// Offers these commands from where the vehicle is now, planned in the present epoch; returns the id. `arms`: as a
  /// take-off.
  std::uint64_t offer(std::vector<Setpoint> commands, bool with_stops = true, bool arms = false);
  AirFactors sets_of = kModelledAir;  ///< of what is offered
  /// Straight up from here to where routes start, and held there.
  std::vector<Setpoint> rise() const;
  /// Commands of the planned route.
  const std::vector<Setpoint>& route() const { return route_; }

  const ControlView& view() const { return loop_->view(); }
  Mode mode() const { return loop_->view().mode; }
  Reason reason() const { return loop_->view().reason; }
  const Wire& wire() const { return wire_; }
  const plan::World& world() const { return *world_; }
  const firmware_bridge::AutopilotLink& link() const { return *link_; }
  std::int64_t now_ns() const { return now_ns_; }
  /// A set-point in the map frame, by the controller's true frame.
  Setpoint in_map(const SetPositionTargetLocalNed& m) const;

  /// Bytes that the flight controller sends beside its own telemetry in the next tick.
  template <typename Message>
  void say(const Message& message) {
    const auto frame = mavlink::encode_frame({1, 1, sequence_++}, message);
    inject_.insert(inject_.end(), frame.view().begin(), frame.view().end());
  }

  /// From now on the flight controller gets what the daemon sends at this rate, 8N1, however much waits. `thinned`: the
  /// daemon knows it.
  void slow_line(double baud, bool thinned);

  std::optional<adapt::InFlightConstants> air;  ///< of the next restart(): it learns of its air
  MapSettings map_settings;                     ///< of the next restart()

  bool vio_on = true;
  int vio_age_steps = 0;                       ///< ms between a sample's reception and the tick that sees it
  std::function<void(OdometrySample&)> spoil;  ///< changes each sample
  /// What the DDS reader makes of a sample; nothing: it is refused there.
  std::function<std::optional<OdometrySample>(const OdometrySample&)> reader;
  std::function<void(std::vector<std::uint8_t>&)> noise;  ///< changes what the flight controller sends
  bool recorded = true;                                   ///< the control thread's records are taken out of their ring
  bool unread = false;                                    ///< the flight controller does not read
  void hang_up();                                         ///< the line is unplugged
  void plug_in();                                         ///< a new line, handed over as the link watch does
  void restart(bool with_map = true);                     ///< the daemon is killed and started anew

  std::vector<std::uint8_t> inject_;
  bench::LocalFrame local_frame;  ///< the controller's true one
  std::shared_ptr<const plan::World> world_;
  std::unique_ptr<bench::Autopilot> autopilot;  ///< a HandledAutopilot, unless a test sets a profile's
  HandledAutopilot& in_hand() { return dynamic_cast<HandledAutopilot&>(*autopilot); }
  /// In shared memory, so that forget_pages() loses nothing.
  struct Unmap {
    void operator()(Channels* c) const;
  };
  std::unique_ptr<Channels, Unmap> channels;
  /// The next touch of the channels' memory takes a page fault.
  void forget_pages();
  std::vector<log::RawRecord> log;  ///< everything recorded so far
  long page_faults_in_flight = 0;

  /// Writes `log` as a raw log.
  void save(const std::string& path) const;

 private:
  struct Line;
  struct Serial;
  struct Datagrams;
  std::unique_ptr<Line> make_line() const;
  void hand_over(const std::vector<std::uint8_t>& bytes);
  void drain_log();
  void read_wire(std::size_t expected);
  void carry(std::vector<std::uint8_t>& bytes);

  Vehicle vehicle_;
  sim::EmulatedVio vio_;
  Medium medium_;
  OdometryTiming timing_;
  std::unique_ptr<Line> line_;
  std::unique_ptr<firmware_bridge::AutopilotLink> link_;
  std::unique_ptr<ControlLoop> loop_;
  std::int64_t now_ns_ = 1'000'000'000'000;
  std::uint8_t sequence_ = 0;
  std::uint64_t last_segment_ = 0;
  std::vector<Setpoint> route_;
  Wire wire_;
  double baud_ = 0, credit_ = 0;  // of a slow line; bits that it may still carry
  std::deque<std::uint8_t> under_way_;
  mavlink::Parser parser_;
};

/// A rig that has flown `seconds` of its route.
struct InFlight : Lockstep {
  explicit InFlight(double seconds = 2) {
    take_off();
    start_route(seconds);
  }
};

}  // namespace backwash::daemon::test
