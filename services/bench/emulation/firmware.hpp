// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>

#include "services/bench/emulation/autopilot.hpp"
#include "services/bench/emulation/position_loop.hpp"

namespace backwash::bench {

/// What was measured of a real firmware and does not depend on what it is doing. The figures with their sources are in
/// arducopter.cpp and px4.cpp.
struct Behaviour {
  const firmware_bridge::AutopilotProfile& autopilot;
  std::map<std::string, double> parameters;
  std::map<std::string, std::uint8_t>
      integers;                               ///< of these parameters, with their MAV_PARAM_TYPE; the others are floats
  double parameter_period = 0;                ///< s: answers leave at multiples of this
  std::map<std::uint32_t, int> intervals_ms;  ///< of messages that are sent unasked
  // Without ODOMETRY the estimate runs away: acceleration `drift + drift_rate·t` up to `drift_speed`, along drift_way.
  double drift = 0, drift_rate = 0, drift_speed = 0;  ///< m/s², m/s³, m/s
  Vec3 drift_way = Vec3::UnitX();                     ///< unit vector
  double fusion = 0;                                  ///< s, first order: how fast ODOMETRY mends the estimate
  double estimator_lost = 0;                          ///< s without ODOMETRY until the failsafe
  double estimator_found = 0;                         ///< s with ODOMETRY until it is over
  double landed_after = 0, disarms_after = 0;         ///< s on the ground until "landed", from then until disarmed
};

/// Where and what an emulated controller flies; see Autopilot.
struct Site {
  const map::OccupancyGrid& grid;
  Vehicle vehicle{};
  Vec3 ground_W = Vec3::Zero();
  LocalFrame frame{};
  std::uint64_t seed = 1;
  std::uint8_t system = 1;
  double airflow = 1;
  double drag = 0;    ///< 1/s: the air takes this share of the velocity
  double uptime = 0;  ///< s since it was switched on
};

/// An emulated flight controller that behaves as a real firmware was measured to (docs/autopilots.md): estimator fed by
/// ODOMETRY, position loop with its gains as parameters, parameter protocol, rates. A derived class has the modes, the
/// take-off and the failsafes. Its vehicle has the mass, thrust and attitude lag of the vehicle file, not its gains.
class Firmware : public Autopilot {
 public:
  Firmware(const Behaviour& behaviour, const Site& site);

 protected:
  enum LandedState : std::uint8_t { on_ground = 1, in_air = 2, taking_off = 3, landing = 4 };

  void on(const mavlink::Odometry& m, double t) override;
  void on(const mavlink::ParamRequestRead& m, double t) override;
  void on(const mavlink::ParamSet& m, double t) override;
  void on(const mavlink::Timesync& m, double t) override;
  void on(const mavlink::Heartbeat& m, double t) override;
  void on(const mavlink::ManualControl&, double t) override { sticks_at_ = t; }
  void fly(double t) final;
  void telemetry(double t, std::vector<std::uint8_t>& out) final;

  /// Acceleration that the rotors shall produce at t, in the frame in which the estimator believes, m/s². Called each
  /// step while armed.
  virtual Vec3 control(double t) = 0;
  /// Each step, armed or not: failsafes, landing, disarming.
  virtual void watch(double t) = 0;
  virtual mavlink::Heartbeat heartbeat() const = 0;
  /// SET_MESSAGE_INTERVAL; the result of its COMMAND_ACK.
  virtual std::uint8_t set_interval(std::uint32_t id, double us);

  void answer(std::uint16_t command, std::uint8_t result) { acks_.push_back({.command = command, .result = result}); }
  void say(std::uint8_t severity, std::string_view text);
  double parameter(const char* name) const { return parameters.at(name); }
  /// Neither moves nor wants to: rotors at their least.
  static Vec3 rest() { return {0, 0, -kGravity}; }
  /// The loops' answer to targets.
  Vec3 follow(const std::array<AxisTarget, 3>& targets, const LoopGains& horizontal, const LoopGains& vertical,
              double speed_down, double speed_up);
  /// The believed state as targets: from where a movement begins.
  std::array<AxisTarget, 3> here() const;
  bool has_position() const { return local_position_ && !lost_; }
  bool grounded() const { return vehicle_.on_ground(); }
  /// A ground station, or its sticks, that were heard and are not any more: for longer than `limit`, s.
  bool station_silent(double t, double limit) const { return station_at_ && t - *station_at_ > limit; }
  bool sticks_silent(double t, double limit) const { return sticks_at_ && t - *sticks_at_ > limit; }
  double on_ground_for(double t) const { return grounded() ? t - lifted_ : 0; }

  static constexpr double kStep = sim::Quadrotor::kStep;
  static constexpr AxisLimits kNoLimits{1e3, 1e3, 1e3, 1e5};

  LandedState landed_state_ = on_ground;
  double armed_at_ = 0, armed_z_ = 0, uptime_;
  bool lost_ = false;  ///< the estimator's failsafe
  std::array<CascadeLoop, 3> loops_;

 private:
  void estimate(double t);

  /// Its clock, which stamps its poses too.
  std::int64_t since_boot_ns() const noexcept { return steps_ * 1'000'000; }
  Behaviour behaviour_;
  double drag_;
  struct Pending {
    double due;
    std::string name;
  };
  std::deque<Pending> asked_;  // parameters
  std::vector<mavlink::Statustext> texts_;
  std::vector<mavlink::Timesync> syncs_;
  std::optional<double> station_at_, sticks_at_, odometry_at_;  // s, when last heard
  std::optional<double> odometry_since_;                        // s, without a gap
  double lifted_ = 0;
  State measured_;    // error of the newest ODOMETRY
  double drift_ = 0;  // m/s
};

std::unique_ptr<Autopilot> make_arducopter(const Site& site);  ///< ArduCopter 4.5.7
std::unique_ptr<Autopilot> make_px4(const Site& site);         ///< PX4 1.16.1, multicopter

}  // namespace backwash::bench
