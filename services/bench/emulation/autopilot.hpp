// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/sim/airflow_truth.hpp"
#include "core/sim/vehicle/quadrotor.hpp"
#include "firmware_bridge/mavlink/frame.hpp"
#include "firmware_bridge/mavlink/messages.hpp"
#include "firmware_bridge/parameters.hpp"

namespace backwash::bench {

/// Where the controller's own local frame lies: p_local = R_z(yaw) p_map + origin.
struct LocalFrame {
  double yaw = 0;              ///< rad
  Vec3 origin = Vec3::Zero();  ///< m
};

/// The gains of `parameters`, by whichever of the autopilot's names they have, become the vehicle file's.
void take_gains(const firmware_bridge::AutopilotProfile& autopilot, const Vehicle& vehicle,
                std::map<std::string, double>& parameters);

/// An emulated PX4-like flight controller: MAVLink on one side, the simulated vehicle in the airflow truth on the
/// other. It flies on the odometry it is sent (its own inertial sensors bridge the time since the sample's stamp),
/// answers commands, follows offboard set-points only while they stream, and lands by itself when they stop for 0.5 s.
class Autopilot {
 public:
  static constexpr double kOffboardTimeout =
      0.5;                                 ///< s without a set-point until the failsafe lands, as late as PX4's may
  static constexpr double kDescent = 0.5;  ///< m/s

  /// Stands disarmed at `ground_W` (the vehicle's centre, map frame). `airflow`: factor on the variance of the air; 0
  /// is calm.
  Autopilot(const map::OccupancyGrid& grid, const Vehicle& vehicle, const Vec3& ground_W, const LocalFrame& frame,
            std::uint64_t seed, std::uint8_t system, double airflow = 1);
  virtual ~Autopilot() = default;

  /// Frames from the companion computer, received at `t` (s, monotonic).
  void receive(std::span<const std::uint8_t> bytes, double t);
  /// One step of 1 ms that ends at `t`; the bytes to send are appended to `out`.
  virtual void step(double t, std::vector<std::uint8_t>& out);

  virtual const State& truth() const noexcept { return vehicle_.state(); }
  virtual Eigen::Quaterniond attitude() const { return vehicle_.attitude(); }
  virtual const Vec3& acceleration() const noexcept { return vehicle_.acceleration(); }
  virtual double thrust() const noexcept { return armed_ ? vehicle_.thrust() : 0; }
  bool armed() const noexcept { return armed_; }
  bool landed() const noexcept { return landed_; }
  virtual const char* mode() const noexcept;
  std::uint64_t setpoints() const noexcept { return setpoints_; }

  /// While true no telemetry is sent (heartbeat lost, docs/faults.md row 21).
  bool mute = false;
  /// While true the position, or the attitude, is not reported, and everything else goes on (row 42).
  bool silent_pose = false, silent_attitude = false;
  /// The estimator takes its heading from the odometry too; otherwise from its own sensors, which are right.
  bool follows_yaw = false;
  /// What PARAM_REQUEST_READ is answered from: safe indoors and the vehicle's gains until changed. Those whose name
  /// ends in _T or _DELAY or begins with MPC_ are floats.
  std::map<std::string, double> parameters{{"COM_OF_LOSS_T", 0.39}, {"COM_OBL_RC_ACT", 4},   {"COM_RC_OVERRIDE", 3},
                                           {"NAV_DLL_ACT", 3},      {"NAV_RCL_ACT", 3},      {"EKF2_EV_DELAY", 0},
                                           {"COM_LOW_BAT_ACT", 2},  {"EKF2_EV_CTRL", 15},    {"EKF2_HGT_REF", 3},
                                           {"MPC_XY_VEL_MAX", 12},  {"MPC_Z_VEL_MAX_UP", 3}, {"MPC_Z_VEL_MAX_DN", 3},
                                           {"MPC_TILTMAX_AIR", 45}, {"MPC_XY_P", 0},         {"MPC_XY_VEL_P_ACC", 0},
                                           {"MPC_Z_P", 0},          {"MPC_Z_VEL_P_ACC", 0}};
  /// Remaining share that BATTERY_STATUS says, once a second; not set: that of a battery which flying drains
  /// (charge()).
  std::optional<double> battery;
  /// Writes a row for each frame of the companion computer: time, id, sequence, type mask, position; of a command
  /// its number and parameters 1, 2 and 7. False: the file cannot be made.
  bool log_wire(const std::string& path);

 protected:
  /// Of what is armed for some time: a tenth goes in the first 2.3 min, then ever less, and 0.3 stays. So a flight ends
  /// by its battery only where `battery` says so.
  double charge() const noexcept;
  // What a profile of a real firmware (firmware.hpp) does in its own way.
  virtual void on(const mavlink::SetPositionTargetLocalNed& m, double t);
  virtual void on(const mavlink::Odometry& m, double t);
  virtual void on(const mavlink::CommandLong& m, double t);
  virtual void on(const mavlink::ParamRequestRead& m, double t);
  virtual void on(const mavlink::ParamSet&, double) {}
  virtual void on(const mavlink::SetGpsGlobalOrigin&, double) {}
  virtual void on(const mavlink::Timesync&, double) {}
  virtual void on(const mavlink::Heartbeat&, double) {}
  virtual void on(const mavlink::ManualControl&, double) {}
  virtual void fly(double t);
  virtual void telemetry(double t, std::vector<std::uint8_t>& out);

  /// What an ODOMETRY has wrong, against the truth at its stamp; nothing when the stamp is none of the last second's.
  struct OdometryError {
    State error;
    double yaw;  ///< rad
  };
  std::optional<OdometryError> error_of(const mavlink::Odometry& m) const;
  /// The set-point of a message, in the map as the controller believes it to lie.
  Setpoint target_of(const mavlink::SetPositionTargetLocalNed& m) const;
  State believed() const;
  State felt() const;
  /// s from `then` to t; infinite when it has not been yet.
  static double since(const std::optional<double>& then, double t) {
    return then ? t - *then : std::numeric_limits<double>::infinity();
  }
  void send_attitude(std::vector<std::uint8_t>& out);
  void send_position(std::vector<std::uint8_t>& out);
  void send_battery(std::vector<std::uint8_t>& out);
  template <typename Message>
  void send(const Message& message, std::vector<std::uint8_t>& out) {
    const auto frame = mavlink::encode_frame({system_, 1, sequence_++}, message);
    out.insert(out.end(), frame.view().begin(), frame.view().end());
  }

  sim::Quadrotor vehicle_;
  sim::AirflowTruth air_;
  LocalFrame frame_;
  long armed_steps_ = 0;
  bool armed_ = false, landed_ = true, local_position_ = false, heartbeat_due_ = false;
  std::optional<double> last_setpoint_;  // s, when it came
  double landed_since_ = 0;
  long steps_ = 0;
  std::uint64_t setpoints_ = 0;
  Setpoint target_;  // in the map as the estimator believes it to lie
  // What the estimator has wrong: believed = R_z(yaw_error_) truth + error_.
  State error_;
  double yaw_error_ = 0;  // 0 unless the heading is followed
  std::vector<mavlink::CommandAck> acks_;
  std::vector<mavlink::ParamValue> values_;  // asked for and not yet sent

  enum class Mode { manual, offboard, land };
  Mode mode_ = Mode::manual;

 private:
  template <typename Other>
  void on(const Other&, double) {}
  void steer();
  Vec3 body_rates();

  std::uint8_t system_, sequence_ = 0;
  mavlink::Parser parser_;
  struct Truth {
    double t;
    State state;
    Eigen::Quaterniond attitude;
  };
  std::deque<Truth> history_;                // of the last second
  Eigen::Quaterniond reported_{1, 0, 0, 0};  // true attitude of the report before
  long reported_steps_ = 0;
  std::ofstream wire_;
};

}  // namespace backwash::bench
