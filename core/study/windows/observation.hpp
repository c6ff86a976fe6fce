// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/study/windows/gates/gate.hpp"
#include "core/study/windows/gates/window_rules.hpp"
#include "core/study/windows/signals/signals.hpp"
#include "core/study/windows/surroundings.hpp"

namespace backwash::study {

/// What is measured on every 2 s window: each channel has one number per window and a weight (0: not measured).
enum Channel : std::size_t {
  kMeanX,  ///< mean of a − a_sim along W, m/s²
  kMeanY,
  kMeanZ,
  kVarX,  ///< ln of measured (less the accelerometer's noise) over modelled variance of a − a_sim, its bias removed
  kVarY,
  kVarZ,
  kTail,           ///< ln kurtosis of a − a_sim over a Gaussian's, `tails`
  kThrustDelay,    ///< Σ z (a − a_sim)·b_z/√Σz², z the set-points' own thrust rate: how late the thrust comes
  kThrustSlope,    ///< the same with the set-points' own vertical acceleration: how steep the thrust curve is
  kCommandDelayH,  ///< Σ x (a − a_nominal)/√Σx², x = −ȧ_nominal of the closed loop that hears set-points alone
  kCommandDelayZ,
  kTiltDelay,  ///< Σ x (a_tilt − r)/√Σx², level, in hover: r the loop's answer to the logged state, x = −ṙ
  kLine1,      ///< ln power of the rotors' line over that of its neighbours, expectation without a line removed
  kLine2,
  kLine3,
  kLine4,
  kMotor1,  ///< ln thrust commanded of a rotor, less the mean of the four
  kMotor2,
  kMotor3,
  kMotor4,
  kRpm1,  ///< ln rpm² over commanded thrust of a rotor, less the mean of the four; of rpm² where no flight has commands
  kRpm2,
  kRpm3,
  kRpm4,
  kDropout1,  ///< share of samples whose rpm reading is stuck or below `dropout` of its median
  kDropout2,
  kDropout3,
  kDropout4,
  kChannels
};
const char* channel_name(Channel c);

/// Value of a channel in one window.
struct ChannelValue {
  std::size_t channel;
  double value, weight;
};

/// What flights must hold for an effect to be tested: a map, or something above said by map or log; columns of the log.
enum class Source : std::size_t {
  map,
  ceiling,
  battery,
  temperature,
  attitude,
  thrust,
  setpoints,
  rpm,
  motors,
  acceleration
};

/// Level offsets of the map at which Σ is looked up: a square of so many points.
inline constexpr auto kOffsetsAside = static_cast<std::size_t>(kWindowRules.offsets_aside);
inline constexpr double kOffsetStep = kWindowRules.offset_step;  ///< m between them

/// Places along a window: a moving vehicle crosses different air at different speeds.
inline constexpr auto kPoints = static_cast<std::size_t>(kWindowRules.points_along);

/// One window: where and how it was flown, and what the catalogue's columns are made of.
struct WindowRow {
  std::size_t flight;
  std::optional<int> segment;  ///< none in transit or unknown
  double t;                    ///< s since the flight's first row, middle of the window
  double duration;             ///< s
  Vec3 p_W, v_W;  ///< m, m/s, means; where the set-points alone lead, if there are any (a gust moves the measured)
  double speed;   ///< m/s, mean of the norm
  std::array<double, kPoints> speeds{}, shares{};  ///< m/s, along the window; of the modelled variance, sum 1
  std::optional<Mat3> R_WB;  ///< mean rotation by the heading alone (not orthonormal); nothing without attitude
  double thrust_acc;         ///< T/m of the logged command, m/s²; g without thrust
  double voltage;            ///< V, the flight's slow course: the momentary one answers the thrust, hence the gusts
  double temperature;
  PlaceAround around;             ///< of p_W
  std::vector<PlaceAround> path;  ///< of points along the window; empty where it is one place
  /// Of a window whose p_W and v_W are those of the loop that hears set-points alone.
  struct Led {
    Vec3 give = Vec3::Zero();    ///< how far a steady push moves the craft off p_W, 1/k_p, s²
    Vec3 slowed = Vec3::Zero();  ///< m: what a drag of 1 1/s takes off v_W, by the loop's answer
    /// Its acceleration, m/s²: the mean and, along the window, the variance, the trend taken out.
    Vec3 asked_W = Vec3::Zero(), asked2 = Vec3::Zero();
    Vec3 off_W = Vec3::Zero();  ///< measured place less p_W, m
  };
  std::optional<Led> led;       ///< nothing where p_W and v_W are measured
  bool held_off = false;        ///< an integrator holds a steady push off: it moves the craft for some seconds only
  Vec3 varied2 = Vec3::Zero();  ///< (m/s)², variance of the velocity along the window, its trend taken out
  Vec3 sigma;                   ///< modelled variance per axis, (m/s²)²
  /// ln of Σ per axis with the window moved by each offset (x slowest), less that where it is; within ±offset_limit.
  std::array<Vec3, kOffsetsAside * kOffsetsAside> ln_sigma_moved;
  /// Design of kThrustDelay and kThrustSlope, of (delay, slope); 0 where nothing was excited.
  std::array<double, 2> delay_gain{}, slope_gain{};
  std::array<double, 2> mean_gain{};  ///< of (delay, slope) in kMeanZ: what was asked for on the mean of the window
  /// What values at the points along the window, joined by lines, add to kThrustDelay and kThrustSlope.
  std::array<double, kPoints> delay_at{}, slope_at{};
  std::array<double, kPoints> climbs{};   ///< m/s, v_z along the window
  std::array<double, 2> command_gain{};   ///< design of kCommandDelayH, kCommandDelayZ
  std::array<double, 2> lag_gain{};       ///< the same of a longer lag of the attitude
  double drag_gain = 0;                   ///< and of a level drag, in kCommandDelayH: the loop is earlier against it
  double tilt_gain = 0;                   ///< design of kTiltDelay
  Vec3 measured_variance = Vec3::Zero();  ///< (m/s²)²
  std::array<std::optional<RotorLine>, 4>
      lines{};  ///< of the rotors along z, none that cannot be told, the gusts' share taken out of floor2, (m/s²)²
  /// ln_sigma_moved at a level offset, bilinear; as at the edge beyond the square.
  Vec3 ln_sigma_at(const Vec3& offset_W) const;
  /// Axis of the body in W, by the heading; zero where the attitude is not known: what is fixed to the body is not
  /// told.
  Vec3 body_axis(int i) const { return R_WB ? Vec3(R_WB->col(i)) : Vec3(Vec3::Zero()); }
  double yaw() const { return std::atan2(body_axis(0).y(), body_axis(0).x()); }  ///< rad
};

/// What is left out, flipped and scattered together: one flight, or the flights of one day. first[k]: the window at
/// which unit k begins; one more at the end.
struct Units {
  std::vector<std::size_t> first{0};
  std::size_t size() const { return first.size() - 1; }
};

/// By what the contrasts of a sound craft's rotors (twist, two pairs; ln commands) differ from what is known of it: a
/// Student's t each.
struct SoundScatter {
  Eigen::Array3d scale;
  double degrees;
};

/// All flights of a study as rows of windows, in flight order.
struct Observations {
  std::size_t flights = 0;
  std::vector<WindowRow> windows;
  std::vector<std::size_t> first;                        ///< window at which each flight begins; one more at the end
  Units units;                                           ///< flights, or what groups them
  double row_period = 0;                                 ///< s, longest of the flights' mean
  std::array<std::vector<double>, kChannels> y, weight;  ///< value, and inverse of its relative variance
  std::map<Gate, std::size_t, ByName> gated_out;         ///< windows by reason
  std::map<Source, std::string> missing;                 ///< what no flight had, and why: "no battery_v column"
  std::optional<SoundScatter> sound_rotors;              ///< of reference flights; they are taken out of y
  bool has(Source what) const { return !missing.contains(what); }
  bool measured(Channel c) const;
  /// Units of neighbouring flights with the same value, one a flight.
  void group(const std::vector<double>& by_flight);
};

}  // namespace backwash::study
