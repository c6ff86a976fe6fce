// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <string_view>
#include <variant>
#include <vector>

#include "core/types/law.hpp"

/// What the simulation alone knows (docs/model.md 6-10 to 6-17): battery, time, heading, sensors. Another kind: its
/// name in SimulationTerm::Kind, its line in kSimulationKinds and its line in docs/model.md; and where it is no push
/// or gust that follows from FlightInstant, the place in core/sim that computes it.
namespace backwash {

/// What an accepted cause of the study adds to the simulation: an entry of [[extension.term]].simulation of a model
/// file: a law of the air, or what the simulation alone knows. Field, reach and plan read ModelEffect instead: a plan
/// does not know battery, time or sensor.
struct SimulationTerm {
  enum class Kind {
    // The air.
    push_of_heading,        ///< x, y of the body's heading, m/s²
    ln_variance_with_time,  ///< B, τ s: ln Σ + B (1 − e^{−t/τ}), t since the flight's start
    variance_elsewhere,     ///< share, x, y m: ln Σ by that share as it is at the place moved by (x, y)
    kurtosis,               ///< K: bursts that raise ln kurtosis by K and leave Σ as it is
    // Thrust and commands.
    thrust_share,         ///< m: thrust per mass times (1 − m)
    thrust_slope,         ///< s: a change of the thrust about hover is worth (1 + s) of it
    thrust_with_voltage,  ///< s, V* V, V_m V, V_0 V, r V/s: thrust (1 − s (V* − V)/V_m); V_0 + r t where no log tells V
    thrust_lag,           ///< τ s: thrust follows its command with a first-order lag
    setpoint_delay,       ///< τ s: set-points act later by this
    attitude_lag,         ///< τ s: the attitude follows its command with a lag that is longer by this
    shift_decay,          ///< level, up 1/s: an integrator holds steady pushes off; their shifts decay at these rates
    // Sensors and rotors.
    sensor_drift_with_time,  ///< x, y, z m/s² per 100 s, and at t = 0: bias of the accelerometer along the heading's
                             ///< axes
    sensor_drift_with_temperature,  ///< x, y, z m/s² per 10 °C, at 25 °C x, y, z, T_0 °C, r °C/s: as V for the battery
    sensor_lines,  ///< rotors 1 … 4 m/s², floor m/s²: amplitudes along z at the rotors' rates, over noise of this size
    rotor_needs,    ///< rotors 1 … 4: ln of the thrust command that each needs, over the others'
    rotor_reading,  ///< rotors 1 … 4: ln of rpm² as it is read over what it is
    rotor_dropout,  ///< rotors 1 … 4: share of rpm readings that are missing
    count
  };
  std::variant<Law, Kind> kind = Law::push;
  std::vector<double> value;  ///< of a law: its values, and its scale if it has one

  bool is(Kind k) const noexcept { return kind == std::variant<Law, Kind>(k); }
};

/// Where and how a simulated vehicle flies.
struct FlightInstant {
  double t;        ///< s since the flight's start
  Vec3 p_W, v_W;   ///< m, m/s
  double yaw = 0;  ///< rad
};

/// The least and the most that a number of a term may be.
struct TermRange {
  double least, most;
};

namespace terms {

inline constexpr TermRange kPush{-10, 10};      // m/s², 1/s
inline constexpr TermRange kLn{-10, 10};        // of a factor
inline constexpr TermRange kScale{0.01, 10};    // m, exponents
inline constexpr TermRange kTime{0.1, 1000};    // s
inline constexpr TermRange kShare{-0.9, 0.9};   // of the thrust
inline constexpr TermRange kPart{0, 1};         // of readings
inline constexpr TermRange kLag{0, 1};          // s
inline constexpr TermRange kDecay{0, 1};        // 1/s
inline constexpr TermRange kDelay{-0.3, 0.3};   // s
inline constexpr TermRange kVolts{0.1, 1000};   // V
inline constexpr TermRange kCelsius{-50, 150};  // °C
inline constexpr TermRange kAmplitude{0, 100};  // m/s²
inline constexpr TermRange kOffset{-2, 2};      // m
inline constexpr TermRange kCourse{-1, 1};      // V/s, °C/s
inline constexpr TermRange kSag{-10, 10};       // relative thrust per relative voltage
inline constexpr TermRange kKurtosis{0, 3};     // ln
inline constexpr TermRange kShareOfMap{0, 2};   // of ln Σ

/// The numbers of a kind.
class Numbers {
 public:
  constexpr Numbers() = default;
  constexpr Numbers(std::initializer_list<TermRange> ranges) {
    for (const TermRange& r : ranges) ranges_[size_++] = r;
  }
  constexpr std::size_t size() const { return size_; }
  constexpr const TermRange* begin() const { return ranges_.data(); }
  constexpr const TermRange* end() const { return ranges_.data() + size_; }

 private:
  std::array<TermRange, 8> ranges_{};
  std::size_t size_ = 0;
};

inline void push_of_heading(const std::vector<double>& x, const FlightInstant& now, Air& air) {
  const double c = std::cos(now.yaw), s = std::sin(now.yaw);
  air.push_W = {x[0] * c - x[1] * s, x[0] * s + x[1] * c, 0};
}
inline void ln_variance_with_time(const std::vector<double>& x, const FlightInstant& now, Air& air) {
  air.ln_variance = x[0] * (1 - std::exp(-now.t / x[1]));
}

}  // namespace terms

/// All that other code knows of a kind. `air`: what it makes of the air; null where core/sim computes it.
struct SimulationKind {
  SimulationTerm::Kind kind;
  std::string_view name;  ///< `kind` in a model file
  terms::Numbers numbers;
  void (*air)(const std::vector<double>& value, const FlightInstant& now, Air& air) = nullptr;
};

/// In the order of SimulationTerm::Kind.
inline constexpr auto kSimulationKinds = [] {
  using namespace terms;
  using Kind = SimulationTerm::Kind;
  return std::array<SimulationKind, static_cast<std::size_t>(Kind::count)>{{
      {Kind::push_of_heading, "push_of_heading", {kPush, kPush}, push_of_heading},
      {Kind::ln_variance_with_time, "ln_variance_with_time", {kLn, kTime}, ln_variance_with_time},
      {Kind::variance_elsewhere, "variance_elsewhere", {kShareOfMap, kOffset, kOffset}},
      {Kind::kurtosis, "kurtosis", {kKurtosis}},
      {Kind::thrust_share, "thrust_share", {kShare}},
      {Kind::thrust_slope, "thrust_slope", {kShare}},
      {Kind::thrust_with_voltage, "thrust_with_voltage", {kSag, kVolts, kVolts, kVolts, kCourse}},
      {Kind::thrust_lag, "thrust_lag", {kLag}},
      {Kind::setpoint_delay, "setpoint_delay", {kDelay}},
      {Kind::attitude_lag, "attitude_lag", {kDelay}},
      {Kind::shift_decay, "shift_decay", {kDecay, kDecay}},
      {Kind::sensor_drift_with_time, "sensor_drift_with_time", {kPush, kPush, kPush, kPush, kPush, kPush}},
      {Kind::sensor_drift_with_temperature,
       "sensor_drift_with_temperature",
       {kPush, kPush, kPush, kPush, kPush, kPush, kCelsius, kCourse}},
      {Kind::sensor_lines, "sensor_lines", {kAmplitude, kAmplitude, kAmplitude, kAmplitude, kAmplitude}},
      {Kind::rotor_needs, "rotor_needs", {kLn, kLn, kLn, kLn}},
      {Kind::rotor_reading, "rotor_reading", {kLn, kLn, kLn, kLn}},
      {Kind::rotor_dropout, "rotor_dropout", {kPart, kPart, kPart, kPart}},
  }};
}();

constexpr const SimulationKind& entry(SimulationTerm::Kind kind) noexcept {
  return kSimulationKinds[static_cast<std::size_t>(kind)];
}

static_assert(
    [] {
      for (const SimulationKind& k : kSimulationKinds)
        if (&entry(k.kind) != &k || k.name.empty() || k.numbers.size() == 0) return false;
      return true;
    }(),
    "kSimulationKinds holds each SimulationTerm::Kind once, in their order, with its name and numbers");

}  // namespace backwash
