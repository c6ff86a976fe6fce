// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

namespace backwash::adapt {

/// Forms that gusts of one correlation time τ = ∫₀ ρ dt may have: those that calibration tells apart
/// (docs/model.md 3-3b).
enum class GustForm { karman, first_order, second_order };
inline constexpr std::array kGustForms{GustForm::karman, GustForm::first_order, GustForm::second_order};

/// ρ(lag), 1: of a form with the correlation time tau_s > 0. Not real-time.
double correlation(GustForm form, double lag_s, double tau_s);

/// What two means in a row are compared for.
enum class MeansOf {
  groups,  ///< short ones, each less what the one before foretells: what is new in the gusts, soon
  pairs    ///< long ones, each less its neighbour: their variance is that of any form of gusts, steady push cancels
};

/// What means over short groups of samples say of a group from the one before it (docs/model.md 7-3): tables by count
/// and duration, made once.
class GroupLaw {
 public:
  /// A group is so long, in correlation times: long enough that its mean says the same of all forms within a quarter,
  /// short enough that a doubled variance shows within seconds.
  static constexpr double kGroup = 0.4;
  /// The means that are bet on are so long, in correlation times: a burst is in one of them or two. So are groups of
  /// gusts that are told to be of second order: shorter ones would leave something of each innovation in the next.
  static constexpr double kBlock = 0.7;
  /// Each mean of a pair is so long, in correlation times: longer than gusts are told apart, or velocities are noisy.
  static constexpr double kPaired = 4;
  /// tau_low, tau_high: the calibrated interval of τ, s; 0 < tau_low ≤ tau_high. `form`: the likeliest one as
  /// calibrated; without it whichever is worst. 10 ms of a processor.
  GroupLaw(double tau_low_s, double tau_high_s, std::optional<GustForm> form = {}, MeansOf means = MeansOf::groups);

  /// Of ȳ_k − ρ ȳ_{k−1}, per unit of the gusts' variance.
  struct Innovation {
    double rho;    ///< of the form at tau_low; not knowing it, of the first-order one; of pairs 1
    double most;   ///< largest variance with τ ≥ tau_low
    double least;  ///< smallest with τ in the interval
  };
  /// Of groups of `samples` ≥ 1 over `seconds` > 0. Beyond the tables as at their ends. Real-time: wait-free, no
  /// allocation.
  Innovation at(int samples, double seconds) const noexcept;
  double group_s() const noexcept { return group_s_; }
  double block_s() const noexcept { return block_s_; }

 private:
  static constexpr int kSamples = 12, kLengths = 25;
  static constexpr double kLnShortest = -0.7, kLnLongest = 2.1;  // ln of a duration over group_s
  double group_s_, block_s_;
  std::array<std::array<Innovation, kLengths>, kSamples> table_;
};

}  // namespace backwash::adapt
