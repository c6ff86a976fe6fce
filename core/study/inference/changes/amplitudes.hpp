// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/study/inference/search.hpp"

/// What each flight says by itself of a form's parameters.
namespace backwash::study {

/// A form at a scale, and XᵀV⁻¹X of each window, X the free offsets of a flight (none of a constant form), the form's
/// columns and last y; V the noise of windows within flights alone. What the flights scatter by is asked afterwards.
class Amplitudes {
 public:
  /// `rest`: Evidence::residual of the other causes. Real-time status: offline.
  Amplitudes(const Evidence& evidence, const Form& form, const Scale& scale, const DesignColumn& rest);

  const Form& form() const { return *form_; }
  const Scale& scale() const { return scale_; }
  const std::vector<DesignColumn>& columns() const { return columns_; }
  std::size_t units() const { return units_->size(); }
  std::size_t begin(std::size_t unit) const { return units_->first[unit]; }
  std::size_t end(std::size_t unit) const { return units_->first[unit + 1]; }

  /// Parameters of a flight, and the mean square error of each by the windows' noise.
  struct Told {
    SmallVector theta, error2;
  };
  /// Nothing where the flight does not tell every parameter.
  std::optional<Told> level(std::size_t unit) const;
  /// What they are from window `at` on less what they are before it.
  std::optional<Told> step(std::size_t unit, std::size_t at) const;
  /// Whether a difference of parameters is an effect at all (SearchCandidate::effect).
  bool effect(const SmallVector& difference) const;

 private:
  Eigen::MatrixXd gram(std::size_t begin, std::size_t end) const;
  std::optional<Told> solved(const Eigen::MatrixXd& gram) const;

  const Form* form_;
  Scale scale_;
  const Units* units_;
  std::vector<DesignColumn> columns_;
  Eigen::Index offsets_ = 0;
  Eigen::MatrixXd grams_;  // a window a column
  SmallMatrix size_;
};

}  // namespace backwash::study
