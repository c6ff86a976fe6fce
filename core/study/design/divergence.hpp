// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "core/study/inference/rivals.hpp"

namespace backwash::study {

/// How well a rival copies what a cause predicts. Columns of both: the cause's own first, then all that is fitted: the
/// rival's, free offsets, what was accepted beside it. XᵀV⁻¹X over the flights that were flown, and of one more.
struct Imitation {
  Eigen::MatrixXd flown, flight;  ///< p × p
  Eigen::VectorXd theta;          ///< of the cause's own columns

  /// Nats by which the best copy falls behind over the flown flights and `flights` more of the same kind:
  /// min_η ½ ‖X θ − Z η‖², in V⁻¹.
  double left(double flights) const;
  /// Of one more flight, the rival fitted to the flown ones: ½ ‖X θ − Z η̂‖². Its least upper bound on how `left` grows.
  double divergence() const;
};

/// P that a lead passes `needed` when it grows by N(growth, 2 growth), nats.
double passes(double lead, double growth, double needed);

/// One of the causes of a set.
struct Explanation {
  const Form* form;
  Scale scale;
  double behind;       ///< nats behind the one that is named
  double probability;  ///< ∝ e^−behind
};

/// What one more flight would tell of a set.
struct Outlook {
  double divergence = 0;          ///< Σ_{i<j} π_i π_j ½ (T_ij + T_ji), nats a flight
  std::vector<double> separated;  ///< P that the set is one name after 1, 2, … flights
  std::vector<double> of_pair;    ///< ½ (T_ij + T_ji) by Contest::pairs()
  /// The least number of flights with which P is at least `kDesignRules.design_separated`; none up to most_flights.
  std::optional<int> flights() const;
};

/// A named cause and its rivals, and what it takes to tell them apart. Keeps pointers to its arguments.
class Contest {
 public:
  /// `flown` is whitened by the accepted causes; `which`: the number of the cause among them; `threshold`: nats that
  /// the null exceeds at its level, StudyResult::threshold.
  Contest(const Evidence& flown, const std::vector<Accepted>& accepted, std::size_t which, double threshold);
  const std::vector<Explanation>& explanations() const noexcept { return all_; }
  /// Pairs i < j of explanations.
  std::vector<std::pair<std::size_t, std::size_t>> pairs() const;
  /// `next`: that evidence's next() of the flight's windows.
  Outlook after(const Evidence& next) const;

 private:
  /// The columns that stand beside a pair, on some flights.
  std::vector<DesignColumn> beside(const std::vector<DesignColumn>& both, bool constant,
                                   const Observations& seen) const;
  /// The cause's columns, the rival's, and what stands beside both; without a rival's form what stands beside the
  /// cause. Nothing if they are more than normal equations hold.
  std::vector<DesignColumn> joint(const Explanation& truth, const Form* rival, const Scale& scale,
                                  const Observations& seen) const;
  struct Copy {
    const Form* form;
    Scale scale;
    Eigen::MatrixXd flown;
  };
  /// What decides whether `truth` is told from `rival`.
  struct Duel {
    std::size_t truth, rival;
    double lead, error, gain;  // nats now; the gain is the truth's
    bool dynamic, never;       // a delay or a slope; motors alone
    Eigen::VectorXd theta;
    std::vector<Copy> copies;
    Eigen::MatrixXd alone;  // of the truth and what stands beside it, over the flown flights
  };
  Duel duel(std::size_t truth, std::size_t rival) const;
  void add_copies(Duel& duel) const;
  /// Of a duel after 1, 2, … flights: growth of the lead and of the truth's own gain, nats.
  struct Growth {
    std::vector<double> lead, gain;
    double divergence = 0;
  };
  Growth growth(const Duel& duel, const Evidence& next) const;
  /// P that the rival is out of the set.
  double chance(const Duel& duel, double lead_growth, double gain_growth) const;

  const Evidence* flown_;
  const std::vector<Accepted>* accepted_;
  std::size_t which_;
  double threshold_;
  std::vector<Explanation> all_;
  std::vector<Duel> duels_;  // ordered pairs
};

}  // namespace backwash::study
