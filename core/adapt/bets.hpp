// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/adapt/innovations.hpp"

namespace backwash::adapt {

/// Of one flight: "the air is rougher than v" is wrong in some class at some time with at most this probability, if
/// nothing else is configured.
inline constexpr double kAlpha = 0.01;
/// s: the mean time to the first false "it became rougher in flight", of all classes together.
inline constexpr double kRunLength = 36000;
/// s: the same of "it is rougher than the calmer air that sets were shrunk to", which costs less to say wrongly.
inline constexpr double kReturnLength = 120;
/// s of a class's own data, below which nothing is said to be calmer.
inline constexpr double kLeastCalm = 60;
/// A squared innovation counts so much at most, in its expectation.
inline constexpr double kMostSquare = 16;

/// A product of many positive factors, its logarithm kept so that it neither vanishes nor overflows.
class Wealth {
 public:
  void times(double factor) noexcept {
    product_ *= factor;
    if (product_ > 1e-100 && product_ < 1e100) return;
    ln_ += std::log(product_), product_ = 1, scale_ = std::exp(ln_);
  }
  /// 0 or infinite where a double holds no more; ln() knows it then too.
  double value() const noexcept { return scale_ * product_; }
  double ln() const noexcept { return ln_ + std::log(product_); }

 private:
  double ln_ = 0, product_ = 1, scale_ = 1;
};

/// Bets on one class of air (docs/model.md 7-4 to 7-7). Each adds an innovation in under a microsecond. Real-time:
/// wait-free, no allocation.
class Bets {
 public:
  /// Factors v of the variance that may be refuted, from 1 in steps of 2^{1/4}; and of calmer air.
  static constexpr std::array kRougher{1.0,    1.1892, 1.4142, 1.6818, 2.0,    2.3784, 2.8284,
                                       3.3636, 4.0,    4.7568, 5.6569, 6.7272, 8.0};
  static constexpr std::array kCalmer{1.0,    0.8409, 0.7071, 0.5946, 0.5,    0.4204,
                                      0.3536, 0.25,   0.2102, 0.1768, 0.1487, 0.125};
  /// Stakes of the bets on rougher and, in shares of the largest that keeps the factor positive, on calmer air.
  static constexpr std::array kStakes{0.15, 0.4, 0.8}, kCalmStakes{0.15, 0.45, 0.9};
  /// On the calmer side a square counts so much at most, and of the variance of a pair's difference this share at most
  /// lies beyond that: 0.142 of a Gaussian's. A smaller cap lets stakes be larger.
  static constexpr double kMostCalm = 3, kBeyond = 0.2;

  /// `alpha`: of all classes together, in (0, 1).
  explicit Bets(double alpha = kAlpha) : refuted_(static_cast<double>(kAirClasses) / alpha) {}

  void add(const Innovation& innovation) noexcept;
  /// A pair of long means (MeansOf::pairs): the bets that the air is calmer. Whether below() may have changed.
  bool add_pair(const Innovation& pair) noexcept;
  /// From now on it is watched whether the variance is more than v > 0 times the model's (7-13).
  void watch(double v) noexcept { watched_ = v, rose_ = false, watch_ = pair_watch_ = {}, watched_square_ = 0; }
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

 private:
  using Detector = std::array<double, kStakes.size()>;  // Shiryaev–Roberts, s
  static double detect(Detector& since, double x, double seconds) noexcept;
  void bet_rougher(const Innovation& innovation, bool ends) noexcept;
  void bet_watched(const Innovation& innovation, bool ends) noexcept;

  double refuted_;  // a martingale that reaches it; the classes share α
  std::array<std::array<Wealth, kStakes.size()>, kRougher.size()> rougher_;
  std::array<Detector, kRougher.size()> since_{};
  std::array<std::array<Wealth, kCalmStakes.size()>, kCalmer.size()> calmer_;
  std::array<double, kRougher.size()> square_{};  // sums over the block so far
  Detector watch_{}, pair_watch_{};               // of calmer air, by groups and by pairs
  double watched_ = 0, watched_square_ = 0;
  bool rose_ = false;
  double calm_from_ = 0;  // of seconds_: what that it is calmer is shown by
  double in_block_ = 0;   // innovations
  double block_s_ = 0;
  std::size_t above_ = 0, below_ = 0;  // of the grids, how many are refuted
  double seconds_ = 0, highest_ = 1, highest_change_ = 0;
};

}  // namespace backwash::adapt
