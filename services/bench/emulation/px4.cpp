// SPDX-License-Identifier: BSD-3-Clause
// PX4 1.16.1 (multicopter) as measured in its SIH simulator. Each figure names its source: a trace of
// tests/autopilots/traces with its lines, or `source` where it was read in PX4's own code.
#include <algorithm>
#include <cmath>

#include "services/bench/emulation/firmware.hpp"

namespace backwash::bench {
namespace {

// clang-format off
const Behaviour kBehaviour{
    .autopilot = firmware_bridge::kPx4,
    .parameters = {                          // px4-flight.csv:13–77; default COM_OBL_RC_ACT is 0; MPC_TILTMAX_AIR: source
        {"COM_OF_LOSS_T", 1}, {"COM_OBL_RC_ACT", 0}, {"COM_RC_IN_MODE", 4}, {"COM_RCL_EXCEPT", 4}, {"NAV_RCL_ACT", 0},
        {"NAV_DLL_ACT", 0}, {"COM_SPOOLUP_TIME", 1}, {"COM_DISARM_PRFLT", 10}, {"COM_DISARM_LAND", 2},
        {"COM_RC_OVERRIDE", 1}, {"COM_LOW_BAT_ACT", 0}, {"EKF2_EV_CTRL", 15}, {"EKF2_EV_DELAY", 0},
        {"EKF2_GPS_CTRL", 0}, {"EKF2_HGT_REF", 3}, {"EKF2_MAG_TYPE", 5}, {"EKF2_NOAID_TOUT", 5e6}, {"MPC_XY_P", 0.95},
        {"MPC_XY_VEL_P_ACC", 1.8}, {"MPC_XY_VEL_I_ACC", 0.4}, {"MPC_XY_VEL_D_ACC", 0.2}, {"MPC_Z_P", 1},
        {"MPC_Z_VEL_P_ACC", 4}, {"MPC_Z_VEL_I_ACC", 2}, {"MPC_Z_VEL_D_ACC", 0}, {"MPC_TKO_RAMP_T", 3},
        {"MPC_TKO_SPEED", 1.5}, {"MPC_Z_VEL_MAX_UP", 3}, {"MPC_Z_VEL_MAX_DN", 1.5}, {"MPC_Z_V_AUTO_UP", 3},
        {"MPC_THR_HOVER", 0.5}, {"MPC_LAND_SPEED", 0.7}, {"MPC_ACC_HOR", 3}, {"MPC_XY_VEL_MAX", 12},
        {"MPC_TILTMAX_LND", 12}, {"MPC_TILTMAX_AIR", 45}, {"COM_RC_LOSS_T", 0.5}, {"COM_DL_LOSS_T", 10}, {"CBRK_SUPPLY_CHK", 894281},
        {"BAT_CRIT_THR", 0.07}, {"SIM_BAT_DRAIN", 60}, {"SIM_BAT_MIN_PCT", 50}},
    .integers = {{"COM_OBL_RC_ACT", 6}, {"COM_RC_IN_MODE", 6}, {"COM_RCL_EXCEPT", 6}, {"NAV_RCL_ACT", 6},
                 {"NAV_DLL_ACT", 6}, {"COM_RC_OVERRIDE", 6}, {"COM_LOW_BAT_ACT", 6}, {"EKF2_EV_CTRL", 6},
                 {"EKF2_GPS_CTRL", 6}, {"EKF2_HGT_REF", 6}, {"EKF2_MAG_TYPE", 6}, {"EKF2_NOAID_TOUT", 6}, {"CBRK_SUPPLY_CHK", 6}},
    .parameter_period = 0.001,               // px4-flight.csv:13–75
    .intervals_ms = {{mavlink::AttitudeQuaternion::kId, 20}, {mavlink::LocalPositionNed::kId, 33},
                     {mavlink::ExtendedSysState::kId, 200}, {mavlink::BatteryStatus::kId, 2000},
                     {mavlink::Timesync::kId, 100}},  // px4-flight.csv:408–420
    .drift = 0.10, .drift_rate = 0, .drift_speed = 0.27,  // px4-vio.csv:190–235: 0.05, 0.23, 0.48, 1.02 m at 1, 2, 3, 5 s
    .drift_way = {0.75, 0.66, 0},            // px4-vio.csv:190–235, against the truth's way
    .fusion = 0.3,                           // right within 1 s: px4-vio.csv:244–252
    .estimator_lost = 4.4,                   // descends 4.6 s after, px4-vio.csv:190,222
    .estimator_found = 1.2,                  // px4-vio.csv:244,256
    .landed_after = 3.3,                     // px4-flight.csv:367,390; -loss0.3:247,266; -vio:235,258; -modes:431,456
    .disarms_after = 2.0};                   // COM_DISARM_LAND: px4-flight.csv:390,407

constexpr double kInAirAfterRamp = 0.83;     // s: px4-flight.csv:122,132 less COM_SPOOLUP_TIME; lift-off comes 1.15 s later
constexpr double kFresh = 1.0;               // s, source: a take-off wants a set-point that is not older
constexpr double kLossNoticed = 0.08;        // s beyond COM_OF_LOSS_T: px4-loss1.csv:215,224; -loss0.3:215,221
constexpr double kLandSpeed = 0.6, kCrawlSpeed = 0.3, kCrawlBelow = 0.75;  // m/s, m/s, m: px4-loss1.csv:228–245
constexpr double kSinkSpeed = 0.65;          // m/s: a failsafe's Position mode without RC: px4-loss0.3pos.csv:225–231
constexpr double kSinkDecay = 0.8;           // s, of the speed across, ibid.:219–231
constexpr double kSinkLanded = 1.05;         // s on the ground until "landed" there, ibid.:233,240
constexpr double kBrakingJerk = 4.0, kBrakingGain = 8.0;  // m/s³ (MPC_JERK_AUTO, source), 1/s: nearly time-optimal, -loss0.3:221–228
constexpr AxisLimits kAtOnce{12, 12, 3, 40, 13};  // a blind landing is not smoothed: px4-vio.csv:221–227
constexpr double kStood = 1.0, kStale = 1.05;  // s: what it finds older than that after a standstill is lost: px4-sigstop.csv:276–296
constexpr double kSetDown = 0.3;             // s on the ground until an offboard thrust is cut: px4-vio.csv:252–262
constexpr double kSticksLost = 0.10, kStationLost = 2.1;  // s beyond COM_RC_LOSS_T, COM_DL_LOSS_T: px4-rc.csv:304,311; -gcs:307,373
constexpr double kBatteryNoticed = 2.2;      // s after the charge is below BAT_CRIT_THR: px4-battery.csv:303,336
constexpr double kBatteryUnchecked = 894281;  // CBRK_SUPPLY_CHK, source: then it is not looked at
// clang-format on

enum CustomMode : std::uint32_t {
  position = 3U << 16,
  loiter = 4U << 16 | 3U << 24,
  rtl = 4U << 16 | 5U << 24,
  land = 4U << 16 | 6U << 24,
  offboard = 6U << 16
};
constexpr std::uint16_t kTakeOffLand = 21, kSetMode = 176, kArm = 400, kMessageInterval = 511;
constexpr std::uint8_t kAccepted = 0, kTemporarilyRejected = 1, kUnsupported = 3;

class Px4 : public Firmware {
 public:
  explicit Px4(const Site& site) : Firmware(kBehaviour, site) {}
  const char* mode() const noexcept override {
    return mode_ == offboard ? "offboard" : mode_ == land ? "land" : "pilot";
  }

 private:
  /// The motors stop, wherever the vehicle is.
  void disarm() noexcept {
    armed_ = false;
    landed_state_ = on_ground;
    phase_ = Phase::spooling;
    vehicle_.set_motors(false);
  }

  /// Of a take-off (source: TakeoffState).
  enum class Phase { spooling, ready, ramp, flight };

  void change(CustomMode mode, bool failsafe) noexcept {
    mode_ = mode;
    failsafe_ = failsafe;
    blind_ = lost();
    changed_at_ = now_;
    shaped_ = here();
    if (mode != offboard) {
      loops_[0].reset();
      loops_[1].reset();
    }  // brakes and swings back: px4-loss0.3.csv:221–231
    if (phase_ == Phase::flight) landed_state_ = mode == land && !blind_ ? landing : in_air;
  }
  bool streaming(double t) const { return since(last_setpoint_, t) < parameter("COM_OF_LOSS_T") + kLossNoticed; }

  using Firmware::on;
  void on(const mavlink::CommandLong& m, double t) override {
    switch (m.command) {
      case kSetMode:
        return set_mode(static_cast<std::uint32_t>(m.param2) << 16 | static_cast<std::uint32_t>(m.param3) << 24);
      case kArm: {
        const bool can = m.param1 == 1 ? has_position() : landed_state_ == on_ground;
        answer(kArm, can ? kAccepted : kTemporarilyRejected);
        if (can && m.param1 == 1) arm(t);
        if (can && m.param1 != 1) disarm();
        return;
      }
      case kTakeOffLand:
        change(land, false);
        return answer(kTakeOffLand, kAccepted);
      case kMessageInterval:
        return answer(kMessageInterval, set_interval(static_cast<std::uint32_t>(m.param1), m.param2));
      default:
        return answer(m.command, kUnsupported);
    }
  }
  // Two answers each, the second of which is true: px4-modes.csv:193–194,248–250,302–304,347–348,370–372. In the air
  // and without RC a pilot's mode is not taken; on the ground every mode is, offboard without set-points too:
  // px4-refused.csv.
  void set_mode(std::uint32_t wanted) {
    constexpr std::array<std::uint32_t, 5> kMeasured{position, loiter, rtl, land, offboard};
    const bool known = std::ranges::find(kMeasured, wanted) != kMeasured.end();
    const bool taken = known && (!armed_ || wanted == land || wanted == offboard);
    if (taken) change(static_cast<CustomMode>(wanted), false);
    answer(kSetMode, kAccepted);
    answer(kSetMode, taken ? kAccepted : kTemporarilyRejected);
  }
  void arm(double t) {
    if (!armed_) {
      armed_at_ = t;
      armed_z_ = believed().p_W.z();
      phase_ = Phase::spooling;
    }
    armed_ = true;
    vehicle_.set_motors(true);
  }

  void on(const mavlink::SetPositionTargetLocalNed& m, double t) override {
    ++setpoints_;
    last_setpoint_ = t;
    target_ = target_of(m);
  }

  Vec3 control(double t) override {
    if (phase_ == Phase::spooling && t - armed_at_ > parameter("COM_SPOOLUP_TIME")) phase_ = Phase::ready;
    if (phase_ == Phase::ready && mode_ == offboard && wants_up(t)) {
      phase_ = Phase::ramp;
      ramp_at_ = t;
      for (auto& loop : loops_) loop.reset();
    }
    const double ramp = t - ramp_at_, full = parameter("MPC_TKO_RAMP_T");
    if (phase_ == Phase::ramp && ramp > kInAirAfterRamp) landed_state_ = in_air;
    if (phase_ == Phase::ramp && ramp > full) phase_ = Phase::flight;
    if (phase_ < Phase::ramp || (phase_ == Phase::flight && mode_ == offboard && on_ground_for(t) > kSetDown))
      return rest();
    // The limit on the speed upwards rises through zero: only then is there thrust enough to lift (source).
    const double most = parameter("MPC_Z_VEL_MAX_UP"), least = -kGravity / parameter("MPC_Z_VEL_P_ACC");
    const double up = phase_ == Phase::ramp ? least + ramp / full * (most - least) : most;
    const LoopGains horizontal{parameter("MPC_XY_P"), parameter("MPC_XY_VEL_P_ACC"), parameter("MPC_XY_VEL_I_ACC"),
                               parameter("MPC_XY_VEL_D_ACC")};
    const LoopGains vertical{parameter("MPC_Z_P"), parameter("MPC_Z_VEL_P_ACC"), parameter("MPC_Z_VEL_I_ACC"),
                             parameter("MPC_Z_VEL_D_ACC")};
    Vec3 u = follow(targets(), horizontal, vertical, std::max(parameter("MPC_Z_VEL_MAX_DN"), -up), up);
    if (blind_) u.x() = u.y() = 0;  // level: without a position it has nothing to hold
    return u;
  }
  /// A take-off begins by any wish upwards; the estimate's noise decides about a set-point at the present height
  /// (source).
  bool wants_up(double t) const {
    return since(last_setpoint_, t) < kFresh &&
           (target_.p_W.z() > believed().p_W.z() || target_.v_W.z() > 0 || target_.a_W.z() > 0);
  }
  std::array<AxisTarget, 3> targets() {
    if (mode_ == offboard) {
      std::array<AxisTarget, 3> t;
      for (int i = 0; i < 3; ++i)
        t[static_cast<std::size_t>(i)] = {target_.p_W[i], target_.v_W[i],
                                          phase_ == Phase::ramp && i == 2 ? 0 : target_.a_W[i]};
      return t;
    }
    const AxisLimits limits{12, 12, parameter("MPC_ACC_HOR"), kBrakingJerk, kBrakingGain};
    auto& [x, y, z] = shaped_;
    if (mode_ == position && failsafe_) {
      for (AxisTarget* s : {&x, &y}) *s = {s->p + s->v * kStep, s->v * std::exp(-kStep / kSinkDecay), 0};
    } else {
      x = shaped_velocity(x, 0, limits, kStep);
      y = shaped_velocity(y, 0, limits, kStep);
    }
    const bool low = z.p - armed_z_ < kCrawlBelow && !blind_;
    const double down = mode_ == land ? (low ? kCrawlSpeed : kLandSpeed) : failsafe_ ? kSinkSpeed : 0;
    z = shaped_velocity(z, -down, blind_ ? kAtOnce : limits, kStep);
    return shaped_;
  }

  // Of seven standstills as many ended so as in a termination (docs/autopilots.md); one did nothing.
  bool lost() const { return lost_ || (stale_until_ && now_ < *stale_until_); }

  void watch(double t) override {
    if (now_ > 0 && t - now_ > kStood) stale_until_ = t + kStale;
    now_ = t;
    const bool flying = armed_ && landed_state_ != on_ground;
    if (flying && lost() && !was_lost_) change(land, true);
    was_lost_ = lost();
    const bool bereft = failed(t);
    if (flying && bereft && mode_ == offboard) change(land, true);
    // 5, hold, lands too: without a global position there is no AUTO.LOITER, px4-loss0.3hold.csv.
    const double without = parameter("COM_OBL_RC_ACT");
    if (flying && mode_ == offboard && !streaming(t)) change(without == 4 || without == 5 ? land : position, true);
    // What was lost is back: it goes back to offboard by itself, and may take off again: px4-vio.csv:244–276.
    if (armed_ && failsafe_ && !lost() && !bereft && streaming(t)) change(offboard, false);
    settle(t);
  }
  /// Of remote control, ground station and battery those that land, as measured.
  bool failed(double t) {
    const double least = parameter("SIM_BAT_MIN_PCT") / 100;
    charge_ = armed_ ? std::max(charge_ - kStep / parameter("SIM_BAT_DRAIN"), least) : 1;
    if (charge_ > parameter("BAT_CRIT_THR")) charged_at_ = t;
    const bool sticks = parameter("NAV_RCL_ACT") == 3 && parameter("COM_RC_IN_MODE") == 1 &&
                        (static_cast<int>(parameter("COM_RCL_EXCEPT")) & 4) == 0;
    return (sticks && sticks_silent(t, parameter("COM_RC_LOSS_T") + kSticksLost)) ||
           (parameter("NAV_DLL_ACT") == 3 && station_silent(t, parameter("COM_DL_LOSS_T") + kStationLost)) ||
           (parameter("COM_LOW_BAT_ACT") == 2 && parameter("CBRK_SUPPLY_CHK") != kBatteryUnchecked &&
            t - charged_at_ > kBatteryNoticed);
  }
  /// Landed, and after a while disarmed.
  void settle(double t) {
    if (!armed_) return;
    if (phase_ == Phase::flight && on_ground_for(t) > (mode_ == position ? kSinkLanded : kBehaviour.landed_after)) {
      phase_ = Phase::ready;
      landed_state_ = on_ground;
      landed_at_ = t;
    }
    const bool landed_long =
        phase_ == Phase::ready && landed_at_ > armed_at_ && since(landed_at_, t) > kBehaviour.disarms_after;
    const bool idle = phase_ == Phase::ready && (!landed_at_ || *landed_at_ < armed_at_) &&
                      t - armed_at_ > parameter("COM_DISARM_PRFLT") + parameter("COM_SPOOLUP_TIME");  // -refused
    if (!landed_long && !idle) return;
    disarm();
    change(offboard, false);  // px4-flight.csv:407
  }

  mavlink::Heartbeat heartbeat() const override {
    const bool fresh = since(last_setpoint_, now_) < kFresh;
    const bool watched =
        parameter("NAV_DLL_ACT") == 0 || !station_silent(now_, parameter("COM_DL_LOSS_T") + kStationLost);
    const bool ready = mode_ == offboard && has_position() && fresh && watched;
    // px4-flight.csv:5,119,407; -loss0.3pos:223; -refused
    const int base = mode_ == offboard ? (last_setpoint_ ? 17 : 1) : mode_ == position ? 81 : 29;
    return {.custom_mode = mode_,
            .type = 2,
            .autopilot = kBehaviour.autopilot.number,
            .base_mode = static_cast<std::uint8_t>(base | (armed_ ? 128 : 0)),
            .system_status = static_cast<std::uint8_t>(!armed_     ? (ready ? 3 : 0)
                                                       : failsafe_ ? 5
                                                                   : 4),
            .mavlink_version = 3};
  }

  CustomMode mode_ = loiter;
  Phase phase_ = Phase::spooling;
  bool failsafe_ = false, blind_ = false, was_lost_ = false;
  double charge_ = 1, charged_at_ = 0;  // of the battery, its share; s
  double ramp_at_ = 0, changed_at_ = 0, now_ = 0;
  std::optional<double> landed_at_, stale_until_;
  std::array<AxisTarget, 3> shaped_;  // where the loops shall be now, in the map
};

}  // namespace

std::unique_ptr<Autopilot> make_px4(const Site& site) { return std::make_unique<Px4>(site); }

}  // namespace backwash::bench
