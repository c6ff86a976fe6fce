// SPDX-License-Identifier: BSD-3-Clause
// ArduCopter 4.5.7 as measured in its simulator. Each figure names its source: a trace of tests/autopilots/traces with
// its lines, or `source` where it was read in ArduCopter's own code.
#include <algorithm>
#include <cmath>

#include "services/bench/emulation/firmware.hpp"

namespace backwash::bench {
namespace {

// clang-format off
const Behaviour kBehaviour{
    .autopilot = firmware_bridge::kArduPilot,
    .parameters = {                          // ardupilot-flight.csv:30–112; angles and RTL_ALT: source
        {"GUID_TIMEOUT", 3}, {"VISO_TYPE", 1}, {"EK3_SRC1_POSXY", 6}, {"EK3_SRC1_VELXY", 6}, {"EK3_SRC1_POSZ", 6},
        {"EK3_SRC1_VELZ", 6}, {"EK3_SRC1_YAW", 6}, {"PSC_POSXY_P", 1}, {"PSC_VELXY_P", 2}, {"PSC_VELXY_I", 1},
        {"PSC_VELXY_D", 0.5}, {"PSC_POSZ_P", 1}, {"PSC_VELZ_P", 5}, {"PSC_ACCZ_P", 0.5}, {"PSC_ACCZ_I", 1},
        {"PSC_JERK_XY", 5}, {"PSC_JERK_Z", 5}, {"WPNAV_SPEED", 1000}, {"WPNAV_ACCEL", 250}, {"WPNAV_ACCEL_Z", 100},
        {"WPNAV_SPEED_UP", 250}, {"WPNAV_SPEED_DN", 150}, {"ANGLE_MAX", 3000}, {"PSC_ANGLE_MAX", 0}, {"RTL_ALT", 1500},
        {"MOT_SPOOL_TIME", 0.5}, {"TKOFF_SLEW_TIME", 2},
        {"FS_GCS_ENABLE", 0}, {"FS_THR_ENABLE", 1}, {"FS_EKF_ACTION", 1}, {"FS_EKF_THRESH", 0.8}, {"FS_OPTIONS", 16},
        {"DISARM_DELAY", 10},
        {"FS_GCS_TIMEOUT", 5}, {"BATT_LOW_VOLT", 10.5}, {"BATT_LOW_TIMER", 10}, {"BATT_FS_LOW_ACT", 0},
        {"BATT_FS_CRT_ACT", 0}, {"VISO_DELAY_MS", 10},
        {"SIM_RC_FAIL", 0}, {"SIM_BATT_VOLTAGE", 12.6}},  // the simulator's own: ardupilot-rc, -battery
    .integers = {{"VISO_TYPE", 2}, {"EK3_SRC1_POSXY", 2}, {"EK3_SRC1_VELXY", 2}, {"EK3_SRC1_POSZ", 2}, {"EK3_SRC1_VELZ", 2},
                 {"EK3_SRC1_YAW", 2}, {"FS_GCS_ENABLE", 2}, {"FS_THR_ENABLE", 2}, {"FS_EKF_ACTION", 2},
                 {"FS_OPTIONS", 6}, {"DISARM_DELAY", 2}, {"ANGLE_MAX", 4}, {"RTL_ALT", 6},
                 {"BATT_LOW_TIMER", 2}, {"BATT_FS_LOW_ACT", 2}, {"BATT_FS_CRT_ACT", 2}, {"VISO_DELAY_MS", 4}, {"SIM_RC_FAIL", 2}},
    .parameter_period = 0.1,                 // ardupilot-flight.csv:30–88
    .intervals_ms = {},                      // HEARTBEAT alone until asked: ardupilot-flight.csv:1–33
    .drift = 0.005, .drift_rate = 0.0038, .drift_speed = 10,  // ardupilot-vio.csv:214–271: 0.04, 0.15, 0.49 m at 3, 5, 8 s
    .drift_way = {0.73, -0.68, 0},           // ardupilot-vio.csv:271, against the truth's way
    .fusion = 0.15,                          // right within 0.5 s: ardupilot-vio.csv:269–276
    .estimator_lost = 7.98,                  // ardupilot-vio.csv:214,265
    .estimator_found = 0.99,                 // ardupilot-vio.csv:269,277
    .landed_after = 1.56,                    // ardupilot-flight.csv:375,384; -loss0.3:316,326; -loss3:317,326; -modes:453,464
    .disarms_after = 0.45};                  // ardupilot-flight.csv:384,389; -loss0.3:326,330; -modes:464,466

constexpr double kGyrosSettle = 23.5;        // s after its start "Gyros inconsistent" ends: ardupilot-flight.csv:155,159
constexpr double kArmingDelay = 2.0;         // s, source: motors do nothing for so long after arming
constexpr double kHoverThrottle = 0.39;      // ardupilot-flight.csv:390
constexpr double kLiftedAt = 0.5;            // of WPNAV_ACCEL_Z, source: then it is no longer "landed"
constexpr double kReached = 0.9, kSlow = 0.1;  // source: the take-off is complete at 90 % of the height, below 10 % of the speed
constexpr double kLandSpeed = 0.5;           // m/s: ardupilot-flight.csv:358–375
constexpr double kLandPause = 4.2;           // s until a failsafe's landing descends: ardupilot-vio.csv:265,296
constexpr double kRadioLost = 0.99;          // s: ardupilot-rc.csv:354,366
constexpr double kBatteryNoticed = 0.17;     // s beyond BATT_LOW_TIMER: ardupilot-battery.csv:360,373
constexpr double kStationNoticed = 0.30;     // s beyond FS_GCS_TIMEOUT, of its last heartbeat: ardupilot-gcs.csv:356,373
constexpr double kReturnHeight = 2.0, kReturnPause = 0.5;  // m, s: RTL waits and climbs, ardupilot-modes.csv:363–387
constexpr AxisLimits kReturn{1.5, 0.47, 0.5, 1.0};         // ibid.
// clang-format on

enum CustomMode : std::uint32_t { stabilize = 0, alt_hold = 2, guided = 4, loiter = 5, rtl = 6, land = 9, brake = 17 };
constexpr std::uint16_t kTakeOff = 22, kLand = 21, kSetMode = 176, kArm = 400, kMessageInterval = 511;
constexpr std::uint8_t kAccepted = 0, kDenied = 2, kUnsupported = 3, kFailed = 4;
constexpr std::uint8_t kCritical = 2, kWarning = 4, kInfo = 6;  // severities

class ArduCopter : public Firmware {
 public:
  explicit ArduCopter(const Site& site) : Firmware(kBehaviour, site) {}
  const char* mode() const noexcept override { return mode_ == guided ? "guided" : mode_ == land ? "land" : "pilot"; }

 private:
  /// The motors stop, wherever the vehicle is.
  void disarm() noexcept {
    armed_ = take_off_ = climbing_ = false;
    land_complete_ = true;
    landed_state_ = on_ground;
    vehicle_.set_motors(false);
    heartbeat_due_ = true;
  }

  // Its HEARTBEAT follows a change of mode at once: ardupilot-flight.csv:128–130.
  void change(CustomMode mode, bool by_failsafe = false) noexcept {
    mode_ = mode;
    paused_ = by_failsafe;
    shaped_ = here();
    take_off_ = climbing_ = false;
    blind_ = lost_;
    changed_at_ = now_;
    heartbeat_due_ = true;
    if (!land_complete_) landed_state_ = mode == land ? landing : in_air;
  }

  using Firmware::on;
  void on(const mavlink::CommandLong& m, double t) override {
    switch (m.command) {
      case kSetMode:
        return set_mode(static_cast<std::uint32_t>(m.param2));
      case kArm:
        return arm(m.param1 == 1, t);
      case kTakeOff: {
        const bool can = armed_ && land_complete_ && mode_ == guided && m.param7 > 0;
        if (can) {
          take_off_ = true;
          take_off_at_ = t;
          height_ = m.param7;
        }
        return answer(kTakeOff, can ? kAccepted : kFailed);
      }
      case kLand:
        change(land);
        return answer(kLand, kAccepted);
      case kMessageInterval:
        return answer(kMessageInterval, set_interval(static_cast<std::uint32_t>(m.param1), m.param2));
      default:
        return answer(m.command, kUnsupported);
    }
  }
  void set_mode(std::uint32_t wanted) {
    constexpr std::array<std::uint32_t, 6> kMeasured{alt_hold, guided, loiter, rtl, land, brake};
    const bool known = std::ranges::find(kMeasured, wanted) != kMeasured.end();
    const bool possible = known && (has_position() || wanted == alt_hold || wanted == land);
    // The mode that it is in already does not begin anew (source).
    if (possible && wanted != mode_) change(static_cast<CustomMode>(wanted));
    answer(kSetMode, possible ? kAccepted : kFailed);
  }
  void arm(bool on, double t) {
    if (!on) {
      if (land_complete_) disarm();
      return answer(kArm, land_complete_ ? kAccepted : kFailed);
    }
    const bool settled = uptime_ + static_cast<double>(steps_) * kStep > kGyrosSettle;
    answer(kArm, settled ? kAccepted : kFailed);
    if (!settled) return say(kCritical, "Arm: Gyros inconsistent");
    say(kInfo, "Arming motors");
    armed_ = true;
    armed_at_ = t;
    armed_z_ = believed().p_W.z();
    vehicle_.set_motors(true);
  }
  // It denies what it has no message for, each time in words: ardupilot-flight.csv:25–28.
  std::uint8_t set_interval(std::uint32_t id, double us) override {
    if (id != mavlink::Odometry::kId && id != mavlink::HighresImu::kId) return Firmware::set_interval(id, us);
    say(kInfo, "No ap_message for mavlink id (" + std::to_string(id) + ")");
    return kDenied;
  }

  // Any set-point ends the autopilot's own take-off, without a word, and moves nothing while landed:
  // ardupilot-cancel.csv.
  void on(const mavlink::SetPositionTargetLocalNed& m, double t) override {
    ++setpoints_;
    if (mode_ != guided) return;
    if (climbing_) landed_state_ = in_air;
    take_off_ = climbing_ = false;
    last_setpoint_ = t;
    target_ = target_of(m);
  }

  Vec3 control(double t) override {
    if (land_complete_) return lift(t);
    const AxisLimits across{parameter("WPNAV_SPEED") / 100, parameter("WPNAV_SPEED") / 100,
                            parameter("WPNAV_ACCEL") / 100, parameter("PSC_JERK_XY")};
    AxisLimits along{parameter("WPNAV_SPEED_DN") / 100, parameter("WPNAV_SPEED_UP") / 100,
                     parameter("WPNAV_ACCEL_Z") / 100, parameter("PSC_JERK_Z")};
    auto& [x, y, z] = shaped_;
    if (mode_ == guided && !climbing_ && last_setpoint_ > std::max(changed_at_, take_off_at_)) {
      move_target(t);
      for (int i = 0; i < 3; ++i) {
        AxisTarget& s = shaped_[static_cast<std::size_t>(i)];
        s = shaped(s, {target_.p_W[i], target_.v_W[i], target_.a_W[i]}, i == 2 ? along : across, kStep);
      }
    } else {
      x = shaped_velocity(x, 0, across, kStep);
      y = shaped_velocity(y, 0, across, kStep);
      if (mode_ == rtl) along = kReturn;
      if (climbing_ || (mode_ == rtl && t - changed_at_ > kReturnPause))
        z = shaped(z, {std::max(armed_z_ + (climbing_ ? height_ : kReturnHeight), climbing_ ? -1e9 : z.p), 0, 0}, along,
                   kStep);
      else
        z = shaped_velocity(z, mode_ == land && t - changed_at_ > (paused_ ? kLandPause : 0) ? -kLandSpeed : 0, along,
                            kStep);
    }
    if (climbing_ && z.p > armed_z_ + kReached * height_ && z.v < kSlow * along.speed_up) {
      climbing_ = false;
      landed_state_ = in_air;
    }
    const LoopGains horizontal{parameter("PSC_POSXY_P"), parameter("PSC_VELXY_P"), parameter("PSC_VELXY_I"),
                               parameter("PSC_VELXY_D"), true};
    Vec3 u = follow(shaped_, horizontal, {parameter("PSC_POSZ_P"), parameter("PSC_VELZ_P"), 0, 0}, kNoLimits.speed_down,
                    kNoLimits.speed_up);
    if (blind_ || mode_ == stabilize) u.x() = u.y() = 0;  // level: without a position it has nothing to hold
    return u;
  }
  /// Until GUID_TIMEOUT the target goes on by its last velocity and acceleration, then it stands (source).
  void move_target(double t) {
    if (since(last_setpoint_, t) > std::max(parameter("GUID_TIMEOUT"), 0.1)) target_.v_W = target_.a_W = Vec3::Zero();
    target_.p_W += kStep * target_.v_W;
    target_.v_W += kStep * target_.a_W;
  }
  /// On the ground: the throttle rises from the end of the spool-up until the vehicle moves.
  Vec3 lift(double t) {
    const double begun = std::max(armed_at_ + kArmingDelay + parameter("MOT_SPOOL_TIME"), take_off_at_);
    if (!take_off_ || t < begun) return rest();
    const double up = ((t - begun) / parameter("TKOFF_SLEW_TIME") / kHoverThrottle - 1) * kGravity;
    if (up > kLiftedAt * parameter("WPNAV_ACCEL_Z") / 100) {
      land_complete_ = take_off_ = false;
      climbing_ = true;
      landed_state_ = taking_off;
      shaped_ = here();
    }
    return {0, 0, up};
  }

  void watch(double t) override {
    now_ = t;
    if (lost_ != was_lost_ && armed_ && !land_complete_) {
      if (lost_) {
        say(kCritical, "EKF variance");
        say(kCritical, "EKF Failsafe: changed to LAND Mode");
        change(land, true);
      }
      if (!lost_) say(kCritical, "EKF Failsafe Cleared");
    }
    was_lost_ = lost_;
    other_failsafes(t);
    if (!armed_) return;
    const double still = on_ground_for(t);
    if (!land_complete_ && mode_ == land && still > kBehaviour.landed_after) {
      land_complete_ = true;
      landed_state_ = on_ground;
    }
    const bool landed_by_itself = mode_ == land && still > kBehaviour.landed_after + kBehaviour.disarms_after;
    const bool idle = !take_off_ && t - armed_at_ > parameter("DISARM_DELAY");
    if (land_complete_ && (landed_by_itself || (idle && still > parameter("DISARM_DELAY")))) {
      disarm();
      heartbeat_due_ = false;  // told a second later at most: ardupilot-flight.csv:389–391
      say(kInfo, "Disarming motors");
    }
  }

  /// Of remote control, ground station and battery those that land, as measured; each once.
  void other_failsafes(double t) {
    const bool low = parameter("SIM_BATT_VOLTAGE") < parameter("BATT_LOW_VOLT"), deaf = parameter("SIM_RC_FAIL") == 1;
    if (!low) battery_good_at_ = t;
    if (!deaf) radio_good_at_ = t;
    const std::array<bool, 3> now{
        parameter("FS_THR_ENABLE") == 3 && t - radio_good_at_ > kRadioLost,
        parameter("FS_GCS_ENABLE") == 5 && station_silent(t, parameter("FS_GCS_TIMEOUT") + kStationNoticed),
        parameter("BATT_FS_LOW_ACT") == 1 && t - battery_good_at_ > parameter("BATT_LOW_TIMER") + kBatteryNoticed};
    constexpr std::array<std::string_view, 3> kSaid{"Radio Failsafe", "GCS Failsafe", "Battery Failsafe"};
    for (std::size_t n = 0; n < now.size(); ++n) {
      if (!now[n]) failed_[n] = false;
      if (!now[n] || failed_[n] || !armed_ || land_complete_) continue;
      failed_[n] = true;
      change(land, true);
      say(kWarning, kSaid[n]);
    }
  }

  bool failed() const { return std::ranges::find(failed_, true) != failed_.end(); }
  mavlink::Heartbeat heartbeat() const override {  // ardupilot-modes.csv:129–540
    const bool by_position = mode_ == guided || mode_ == loiter || mode_ == rtl || mode_ == brake;
    return {.custom_mode = mode_,
            .type = 2,
            .autopilot = kBehaviour.autopilot.number,
            .base_mode = static_cast<std::uint8_t>(81 | (by_position ? 8 : 0) | (armed_ ? 128 : 0)),
            .system_status = static_cast<std::uint8_t>((lost_ && armed_) || failed() ? 5
                                                       : armed_ && !land_complete_   ? 4
                                                                                     : 3),
            .mavlink_version = 3};
  }

  CustomMode mode_ = stabilize;
  bool land_complete_ = true, take_off_ = false, climbing_ = false, blind_ = false, paused_ = false, was_lost_ = false;
  std::array<bool, 3> failed_{};  // radio, ground station, battery
  double radio_good_at_ = 0, battery_good_at_ = 0;
  double take_off_at_ = 0, height_ = 0, changed_at_ = 0, now_ = 0;
  std::array<AxisTarget, 3> shaped_;  // where the loops shall be now, in the map
};

}  // namespace

std::unique_ptr<Autopilot> make_arducopter(const Site& site) { return std::make_unique<ArduCopter>(site); }

}  // namespace backwash::bench
