// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "core/study/inference/levels/two_levels.hpp"
#include "core/study/inference/search.hpp"

/// What each window and each flight says of a form's parameters.
namespace backwash::study {

/// A form at a scale and its normal equations per window and per unit (a flight, or the flights of a day): A = XᵀV⁻¹X,
/// b = XᵀV⁻¹y with the noise within flights alone, y what the other causes leave.
class Amplitudes {
 public:
  /// `rest`: Evidence::residual of the other causes. Real-time status: offline.
  Amplitudes(const Evidence& evidence, const Form& form, const Scale& scale, const DesignColumn& rest);

  const Form& form() const { return *form_; }
  const Scale& scale() const { return scale_; }
  const std::vector<DesignColumn>& columns() const { return columns_; }
  std::size_t units() const { return units_->size(); }
  /// Whether the unit's windows tell every parameter.
  bool told(std::size_t unit) const;
  /// Parameters and their inverse covariance from windows [begin, end).
  SmallVector theta(std::size_t begin, std::size_t end) const;
  SmallMatrix information(std::size_t begin, std::size_t end) const;
  std::size_t begin(std::size_t unit) const { return units_->first[unit]; }
  std::size_t end(std::size_t unit) const { return units_->first[unit + 1]; }
  /// The unit's windows along a direction of the parameters, |direction| = 1.
  AmplitudeCourse course(std::size_t unit, const SmallVector& direction) const;
  /// Whether a difference of parameters is an effect at all (SearchCandidate::effect).
  bool effect(const SmallVector& difference) const;

 private:
  const Form* form_;
  Scale scale_;
  const Units* units_;
  std::vector<DesignColumn> columns_;
  /// Of one window.
  SmallMatrix A(std::size_t window) const;
  SmallVector b(std::size_t window) const { return b_.col(static_cast<Eigen::Index>(window)); }

  Eigen::MatrixXd A_, b_;  // a window a column: a SmallMatrix has room for many parameters, and windows are many
  SmallMatrix size_;
};

}  // namespace backwash::study
