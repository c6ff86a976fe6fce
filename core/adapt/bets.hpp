// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include "core/types/air_class.hpp"
#include "core/types/normal.hpp"

namespace backwash::adapt {

/// Of one flight: "errors are more than v times the variance promised" is wrong in some class at some time with at most
/// this probability, if nothing else is configured.
inline constexpr double kAlpha = 0.01;
/// Bets that share it: on the errors as they are and on what is left of them, in each class.
inline constexpr double kBets = 2 * kAirClasses;
/// s: the mean time to the first false "it became rougher in flight", of all classes together, is half of it.
inline constexpr double kRunLength = 72000;
/// s: the same of "it is rougher than the calmer air that sets were shrunk to", which costs less to say wrongly.
inline constexpr double kReturnLength = 120;
/// s of a class's own data, below which nothing is said to be calmer.
inline constexpr double kLeastCalm = 60;
/// A square counts so much at most, in its expectation.
inline constexpr double kMostSquare = 16;
/// An error lies beyond this many deviations with probability kBeyondLevel, as modelled.
inline constexpr double kLevel = normal::k995, kBeyondLevel = 0.01;

/// A square of the control error, per axis of W, m².
struct ErrorSquare {
  double seconds = 0;            ///< since the one before
  Vec3 square = Vec3::Zero();    ///< e²
  Vec3 promised = Vec3::Zero();  ///< σ_e², as modelled
  Vec3 noise = Vec3::Zero();     ///< of the measured position, granted beside it
  Vec3 granted = Vec3::Zero();   ///< what the largest steady push and the error before add at most
  double least = 1;              ///< of `promised`, at the lowest correlation time that calibration leaves possible
};

/// Mean over the axes of the square over its largest expectation under the factor v, each at most kMostSquare.
double excess(const ErrorSquare& error, double v) noexcept;

/// A product of many positive factors, its logarithm kept so that it neither vanishes nor overflows.
class Wealth {
 public:
  void times(double factor) noexcept {
    product_ *= factor;
    if (product_ > 1e-100 && product_ < 1e100) return;
    ln_ += std::log(product_);
    product_ = 1;
    scale_ = std::exp(ln_);
  }
  /// 0 or infinite where a double holds no more; ln() knows it then too.
  double value() const noexcept { return scale_ * product_; }
  double ln() const noexcept { return ln_ + std::log(product_); }

 private:
  double ln_ = 0, product_ = 1, scale_ = 1;
};

/// Bets on the errors in one class of air (docs/model.md 7-5 to 7-9). Each adds a square in some microseconds.
/// Real-time: wait-free, no allocation.
class Bets {
 public:
  /// Factors v of the variance that may be refuted, from 1 in steps of 2^{1/4} up to 64; and of calmer air.
  static constexpr std::size_t kFactors = 25;
  static constexpr std::array<double, kFactors> kRougher = [] {
    std::array<double, kFactors> v{1, 1.189207115002721, 1.4142135623730951, 1.681792830507429};
    for (std::size_t k = 4; k < kFactors; ++k) v[k] = 2 * v[k - 4];
    return v;
  }();
  static constexpr std::array kCalmer{1.0,    0.8409, 0.7071, 0.5946, 0.5,    0.4204,
                                      0.3536, 0.25,   0.2102, 0.1768, 0.1487, 0.125};
  /// Stakes of the bets on rougher and, in shares of the largest that keeps the factor positive, on calmer air.
  static constexpr std::array kStakes{0.15, 0.4, 0.8}, kCalmStakes{0.15, 0.45, 0.9};
  /// On the calmer side a square counts so much at most, and of the variance this share at most lies beyond that: 0.142
  /// of a Gaussian's. A smaller cap lets stakes be larger.
  static constexpr double kMostCalm = 3, kBeyond = 0.2;

  /// `alpha`: of all kBets together, in (0, 1).
  explicit Bets(double alpha = kAlpha) : refuted_(kBets / alpha) {}

  /// Whether above(), below() or rose() may have changed.
  bool add(const ErrorSquare& error) noexcept;
  /// From now on it is watched whether the variance is more than v > 0 times the model's (7-9).
  void watch(double v) noexcept {
    watched_ = v;
    rose_ = false;
    watch_ = {};
  }
  bool rose() const noexcept { return rose_; }  ///< what is watched was refuted
  /// That it is calmer is shown anew, from data of now on, and nothing is watched.
  void forget_calmer() noexcept;
  double seconds() const noexcept { return seconds_; }  ///< of data
  /// The largest v of the grid that was refuted: the variance is more than v times the model's. Nothing: none was.
  std::optional<double> above() const noexcept;
  /// The smallest v of the grid that was refuted from the other side, after kLeastCalm of data.
  std::optional<double> below() const noexcept;
  /// ln of the largest evidence so far that it is rougher than modelled: of the martingale, and of the detector over
  /// kRunLength. Real-time: wait-free, no allocation.
  double ln_evidence() const noexcept { return std::log(highest_); }
  double ln_changed() const noexcept { return std::log(std::max(1e-9, highest_change_ / kRunLength)); }
  /// Errors, of three axes, beyond kLevel, and how many were promised.
  int beyond() const noexcept { return beyond_; }
  double promised_beyond() const noexcept { return 3 * count_ * kBeyondLevel; }

 private:
  using Detector = std::array<double, kStakes.size()>;  // Shiryaev–Roberts, s
  static double detect(Detector& since, double x, double seconds) noexcept;
  void bet_rougher(const ErrorSquare& error) noexcept;
  void bet_calmer(const ErrorSquare& error) noexcept;

  double refuted_;  // a martingale that reaches it; all bets share α
  std::array<std::array<Wealth, kStakes.size()>, kFactors> rougher_;
  std::array<Detector, kFactors> since_{};
  std::array<std::array<Wealth, kCalmStakes.size()>, kCalmer.size()> calmer_;
  Detector watch_{};  // of calmer air
  double watched_ = 0;
  bool rose_ = false;
  double calm_from_ = 0;               // of seconds_: what that it is calmer is shown by
  std::size_t above_ = 0, below_ = 0;  // of the grids, how many are refuted
  double seconds_ = 0, highest_ = 1, highest_change_ = 0;
  int count_ = 0, beyond_ = 0;
};

}  // namespace backwash::adapt
