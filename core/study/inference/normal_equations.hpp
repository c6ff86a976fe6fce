// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "core/study/inference/rules.hpp"

namespace backwash::study {

inline constexpr int kMostColumns = static_cast<int>(kRules.most_columns);
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostColumns, kMostColumns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostColumns, 1>;

/// Normal equations of some columns per flight, with nuisance columns projected out of them and of the data:
/// A_f = X̃ᵀV⁻¹X̃, b_f = X̃ᵀV⁻¹ỹ over the windows of flight f.
struct NormalEquations {
  std::vector<SmallMatrix> A;
  std::vector<SmallVector> b;
  std::vector<SmallMatrix> left_out;  ///< (ΣA − A_f)⁻¹
  SmallMatrix total;                  ///< ΣA
  bool excited = false;               ///< no column is one that the nuisance explains
  bool solvable = false;              ///< excited, and every flight may be left out

  /// θ = (ΣA)⁻¹ Σ s_f b_f.
  SmallVector fit(const std::vector<int>& signs = {}) const;
  /// θ₋f.
  SmallVector fit_without(std::size_t flight) const;
  /// Held-out gain in nats: Σ_f θ₋fᵀ s_f b_f − ½ θ₋fᵀ A_f θ₋f, flights' residuals multiplied by signs ±1.
  double gain(const std::vector<int>& signs = {}) const;
  std::vector<double> gain_per_flight() const;
};

/// Of `columns` columns among flights' XᵀV⁻¹X, X as many of the nuisance (some perhaps spanned by others), these and
/// last y.
NormalEquations normal_equations(std::span<const Eigen::MatrixXd> grams, std::size_t nuisance, std::size_t columns);

}  // namespace backwash::study
