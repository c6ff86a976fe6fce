// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

namespace backwash::reach {

/// An oracle of the FIR of docs/model.md section 5.2, for any linear system ẋ = A x + B u, y = c x: exact supports of
/// one output.
struct LinearSystem {
  Eigen::MatrixXd A;     ///< n × n
  Eigen::MatrixXd B;     ///< n × m
  Eigen::RowVectorXd c;  ///< 1 × n
};

/// {x : |x_i − centre_i| ≤ half_i}.
struct Box {
  Eigen::VectorXd centre, half;
};

enum class InputKind {
  varying,   ///< any measurable function into the box
  constant,  ///< one unknown value of the box for all time
};

struct OutputRange {
  double t, low, high;  ///< exact range of c x(t), t in s
};

/// Ranges of y at t = 0, h, …, steps·h from the boxes of initial states and inputs, by the adjoint ψ(t) = e^{Aᵀt} cᵀ:
///   y(t) ∈ ψᵀx_0 + ∫₀ᵗ ψ(τ)ᵀ B u dτ,  half width Σ_i |ψ_i| half_i + Σ_j half_j ∫₀ᵗ |ψᵀb_j| (constant: |∫₀ᵗ ψᵀb_j|).
/// The integrals of ψᵀb_j over each step are exact (matrix exponential); varying inputs are held for h, so that a
/// change of sign inside a step is missed: O(h²) each. Between grid points the range needs bloating. One exponential of
/// an (n + m) × (n + m) matrix and one product with it per step. Precondition: the sizes fit.
inline std::vector<OutputRange> output_range(const LinearSystem& system, const Box& initial, const Box& input,
                                             InputKind kind, double h, std::size_t steps) {
  const Eigen::Index n = system.A.rows(), m = system.B.cols();
  // d/dt (ψ, z) = (Aᵀψ, Bᵀψ): z is the integral of ψᵀB.
  Eigen::MatrixXd generator = Eigen::MatrixXd::Zero(n + m, n + m);
  generator.topLeftCorner(n, n) = system.A.transpose();
  generator.bottomLeftCorner(m, n) = system.B.transpose();
  const Eigen::MatrixXd step = (generator * h).exp().leftCols(n);

  Eigen::VectorXd psi = system.c.transpose();
  Eigen::VectorXd integral = Eigen::VectorXd::Zero(m), absolute = Eigen::VectorXd::Zero(m);
  std::vector<OutputRange> ranges;
  for (std::size_t k = 0; k <= steps; ++k) {
    const double centre = psi.dot(initial.centre) + integral.dot(input.centre);
    const double half = psi.cwiseAbs().dot(initial.half) +
                        (kind == InputKind::constant ? integral.cwiseAbs() : absolute).dot(input.half);
    ranges.push_back({static_cast<double>(k) * h, centre - half, centre + half});
    const Eigen::VectorXd next = step * psi;
    psi = next.head(n);
    integral += next.tail(m);
    absolute += next.tail(m).cwiseAbs();
  }
  return ranges;
}

}  // namespace backwash::reach
