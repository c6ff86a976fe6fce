// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/adapt/group_law.hpp"
#include "core/types/air_class.hpp"
#include "core/types/geometry.hpp"

namespace backwash::adapt {

/// What calibration measured of the gusts and of the sensor.
struct Gusts {
  double tau_low_s = 0.15, tau_high_s = 0.15;     ///< interval of the correlation time
  std::optional<GustForm> form{};                 ///< the likeliest, if it was told
  double mean_horizontal = 0, mean_vertical = 0;  ///< largest steady push, m/s² (BoundModel)
  Vec3 noise = Vec3::Zero();                      ///< variance of the sensor per sample and axis, (m/s²)²
  bool differences = false;  ///< of a velocity, over the samples' intervals: a group's noise is that of its two ends
};

/// The disturbance at one tick.
struct AirSample {
  double t_s = 0;             ///< rising
  Vec3 w_W = Vec3::Zero();    ///< m/s²
  Vec3 sigma = Vec3::Zero();  ///< modelled variance along x, y, z of W, (m/s²)²
  AirClass air = AirClass::none;
  Vec3 noise = Vec3::Zero();  ///< of this sample beside Gusts::noise, (m/s²)²
};

/// What a group of samples says beyond the group before it. Vectors per axis of W; all per unit of the modelled Σ.
struct Innovation {
  AirClass air = AirClass::none;
  double seconds = 0;          ///< of the group
  Vec3 square = Vec3::Zero();  ///< (ȳ_k − ρ ȳ_{k−1})²
  Vec3 beside = Vec3::Zero();  ///< what sensor and steady push add to its expectation at most
  double block_s = 0;          ///< so long at least are the means that are bet on
  double most = 0, least = 0;  ///< the gusts' part, per unit of the factor (GroupLaw)
};

/// Samples into innovations (docs/model.md 7-2, 7-3): y = w/σ, means ȳ over groups of 0.4 τ, each less what the one
/// before foretells. Or pairs of means of 4 τ, no sample in two of them (7-8). Samples come at any rate; dt is what it
/// was.
class Innovations {
 public:
  static constexpr double kGap = 3;                ///< of the last interval: after a longer one nothing is foretold
  static constexpr double kLongestInterval = 0.5;  ///< s, the same at once
  explicit Innovations(const Gusts& gusts, MeansOf means = MeansOf::groups)
      : gusts_(gusts), means_(means), law_(gusts.tau_low_s, gusts.tau_high_s, gusts.form, means) {}

  /// The next sample; an innovation where it ends a group. None after a gap, in a group of two classes, or for a
  /// sample that is refused: one that is not finite, without Σ, or not later than the one before. Real-time:
  /// wait-free, no allocation.
  std::optional<Innovation> add(const AirSample& sample) noexcept;
  std::uint64_t refused() const noexcept { return refused_; }
  const GroupLaw& law() const noexcept { return law_; }

 private:
  struct Group {
    int samples = 0;
    double seconds = 0;
    Vec3 y = Vec3::Zero(), inverse = Vec3::Zero(), noise = Vec3::Zero();  // sums of w/σ, 1/σ, noise/σ²
    AirClass air = AirClass::none;
    bool mixed = false;
  };
  std::optional<Innovation> ended() noexcept;

  Gusts gusts_;
  MeansOf means_;
  GroupLaw law_;
  std::optional<double> last_t_;
  double interval_ = 0;
  Group group_;
  std::optional<Group> before_;  // means
  std::uint64_t refused_ = 0;
};

}  // namespace backwash::adapt
