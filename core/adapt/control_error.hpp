// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/reach/response/coloured_error.hpp"
#include "core/types/air_class.hpp"

namespace backwash::adapt {

/// What calibration measured of the gusts.
struct Gusts {
  double tau_low_s = 0.15, tau_high_s = 0.15;     ///< interval of the correlation time
  double mean_horizontal = 0, mean_vertical = 0;  ///< largest steady push, m/s² (BoundModel)
};

/// What one tick adds: the set-point that it sent, the newest good odometry if it is a new one, and the model there.
struct AirTick {
  std::int64_t now_ns = 0;        ///< of the tick
  std::optional<double> age_s{};  ///< of the odometry's state at the tick; none: no new one
  std::uint64_t frame = 0;        ///< another one: state and set-point are of a frame that moved meanwhile
  State state;                    ///< as measured
  Setpoint command;               ///< sent in this tick
  Vec3 sigma = Vec3::Zero();      ///< modelled variance along x, y, z of W, (m/s²)²; 0: the map has none there
  AirClass air = AirClass::none;
  bool rests = false;  ///< at the end of a verified way or stop, and measured to be at rest: sets may shrink
};

/// The control error at one tick, and what was promised of it. Vectors per axis of W.
struct ErrorSample {
  std::optional<AirClass> air{};  ///< none: there were several since the sample before
  double seconds = 0;             ///< since that one
  Vec3 e_W = Vec3::Zero();        ///< measured position less the predicted centre, m
  Vec3 promised = Vec3::Zero();   ///< σ_e², m²
  Vec3 noise = Vec3::Zero();      ///< variance of the measured position, m²
  /// Answer of the loop to the predicted centre's velocity times k_p, m/s, its first and its second derivative: what a
  /// late or weak loop adds to the error is made of them.
  std::array<Vec3, 3> motion;
};

/// The error e of a flight and its modelled deviation σ_e (docs/model.md 7-2 to 7-4), one sample each time that the
/// loop has forgotten the one before.
class ControlError {
 public:
  /// Of e with itself, from one sample to the next, at most; and of what a flight begins with, when the first is taken.
  static constexpr double kForgotten = 0.2, kSettled = 0.02;
  static constexpr std::int64_t kMostMissed = 5;  ///< ticks, also of an odometry's age: after more it all begins anew

  /// Errors: those of reach::CentrePredictor; throws std::invalid_argument for τ ≤ 0. 10 ms.
  ControlError(const Vehicle& vehicle, const Gusts& gusts);

  /// The next tick; a sample where one is due. Begins anew, and takes none until the loop has settled, after a gap, a
  /// clock that is set back, in another frame. A tick that is not finite has no odometry, one without Σ the one before.
  /// Real-time: wait-free, no allocation.
  std::optional<ErrorSample> add(const AirTick& tick) noexcept;
  /// Begins anew, the noise of the position too. Real-time: wait-free, no allocation.
  void forget() noexcept {
    last_.reset();
    squares_.setZero();
    differences_ = 0;
  }
  std::uint64_t refused() const noexcept { return refused_; }  ///< ticks that had no Σ, or no number in it
  double spacing_s() const noexcept { return static_cast<double>(spacing_) * kControlPeriod; }
  Vec3 noise() const noexcept { return squares_ / std::max(1, differences_); }  ///< variance of the position, m²
  const Vec3& kp() const noexcept { return kp_; }
  const Vec3& steady() const noexcept { return steady_; }  ///< most that the largest steady push shifts e by, m
  /// Smallest attitude lag beside the vehicle file's, in steps of 0.05 s, with which gusts alone make v times the
  /// modelled variance of an error; 1 s at most.
  double lag_of(double v) const noexcept;
  double least() const noexcept { return least_; }  ///< σ_e² at the lowest τ over that at the highest

 private:
  struct Moment {
    Vec3 p, v, a;
    Vec3 before(double s) const noexcept { return p - s * v + s * s / 2 * a; }
  };
  struct Measured {
    double t;
    Vec3 e_W;
  };
  std::array<reach::ErrorCovariance, 3> unknown() const noexcept;
  void begin(const AirTick& tick) noexcept;
  void step(const AirTick& before) noexcept;
  void measure(const AirTick& tick) noexcept;

  Vehicle vehicle_;
  Vec3 kp_;
  struct Steps {
    reach::ColouredStep horizontal, vertical;
  };
  std::unique_ptr<const Steps> steps_;  // the covariances point to it
  std::array<reach::ErrorCovariance, 3> covariance_;
  reach::CentrePredictor centre_, answer_;
  int spacing_ = 0, settled_ = 0;  // ticks
  Vec3 steady_;
  double least_ = 1;
  static constexpr double kLagStep = 0.05;  // s
  std::array<double, 20> grown_{};          // variance with 1, 2, … steps of lag over the modelled one
  std::optional<AirTick> last_;
  std::array<Moment, kMostMissed + 1> centres_;  // of the last ticks, newest first
  int ticks_ = 0, since_ = 0;                    // since it began, since the sample before
  bool mixed_ = false;
  std::array<std::optional<Measured>, 3> errors_;  // newest first
  Vec3 squares_ = Vec3::Zero();                    // of second differences, per unit of noise
  int differences_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace backwash::adapt
