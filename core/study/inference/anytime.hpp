// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/study/inference/sound_rotors.hpp"

namespace backwash::study {

/// Flights' scores b_f = A_f θ + noise of one form, N(0, κ A_f) with κ unknown, looked at after every flight. The
/// Bayes factor of θ ~ N(θ₀, κ Λ⁻¹) against θ₀, κ by its scale-invariant prior in both: its supremum over all looks is
/// above 1/α with probability α at most if θ₀ is true, whatever κ (Ville's inequality; Lindon, Ham, Tingley and Bojinov
/// 2022). Against a set of θ₀ the least over the set (Wasserman, Ramdas and Balakrishnan 2020).
class FlightScores {
 public:
  /// A flight; the first one with information sets Λ = prior_flights · A.
  void add(const SmallMatrix& A, const SmallVector& b);
  bool empty() const noexcept { return dims_ == 0; }
  SmallVector fit() const;
  const SmallMatrix& information() const noexcept { return M_; }
  /// ln of the Bayes factor, `off` = fit() − θ₀.
  double log_bayes_factor(const SmallVector& off) const;

 private:
  SmallMatrix prior_, M_;  // Λ, ΣA
  SmallVector S_;          // Σb
  double Q_ = 0;           // Σ bᵀA⁻¹b
  double dims_ = 0;        // Σ rank A
};

/// θ̂ − θ₀ for the θ₀ nearest to θ̂ (in the metric `information`) that is no effect of the form: its first parameter
/// below `least` or of an impossible sign, or a root mean square below `floor` (`size` as of SearchCandidate). Zero if
/// θ̂ is none itself.
SmallVector off_no_effect(const Form& form, const SmallVector& theta, const SmallMatrix& information,
                          const SmallMatrix& size);

/// f(p) = (1 − p + p ln p)/(p ln² p) at p = exp(−log_e): an e-value again, though the look was chosen (Vovk and Wang
/// 2021). ln of it; grows with log_e; ln ½ at log_e ≤ 0.
double log_calibrated(double log_e);

/// Evidence that flights hold an effect of the catalogue, told after every flight: "is there anything?" may be asked
/// every day. Each form at each scale bets for itself (FlightScores) against everything below its effect floor; each
/// one's highest Bayes factor so far is calibrated, and the mean over causes, forms and scales is an e-value at any
/// number of flights: above 1/α with probability α at most in worlds without an effect. Rotors of a sound craft differ:
/// they are judged against `sound` flights, or, without these, against the first ones looked at.
class Anytime {
 public:
  explicit Anytime(std::optional<SoundRotors> sound = {}) : sound_(sound) {}

  /// Observations up to and with a new flight (or unit of flights). Below first_look flights nothing is bet; the
  /// scatter of a flight's channels is that of the flights before it, of the first ones their own.
  void look(const Observations& seen);

  /// ln e-value after each look.
  const std::vector<double>& log_e() const noexcept { return log_e_; }
  /// ln of each cause's part of the last e-value.
  const std::map<std::string, double>& causes() const noexcept { return causes_; }

 private:
  struct Bet {
    FlightScores scores;
    SmallMatrix size;  // summed over flights
    double flights = 0;
    std::vector<double> anchor;
    double highest = 0;  // ln
  };
  void add(const Evidence& scatter, const Observations& seen, std::size_t unit);
  static double highest(const Form& form, Bet& bet);  // calibrated, ln

  std::optional<SoundRotors> sound_;
  std::vector<Bet> bets_;  // by form and scale
  std::size_t units_ = 0;  // taken in
  std::vector<double> log_e_;
  std::map<std::string, double> causes_;
};

}  // namespace backwash::study
