// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/linear_support.hpp"

#include <stdexcept>
#include <unsupported/Eigen/MatrixFunctions>

namespace backwash::reach {

std::vector<OutputRange> output_range(const LinearSystem& system, const Box& initial, const Box& input, InputKind kind,
                                      double h, std::size_t steps) {
  const Eigen::Index n = system.A.rows(), m = system.B.cols();
  if (system.A.cols() != n || system.B.rows() != n || system.c.size() != n || initial.centre.size() != n ||
      initial.half.size() != n || input.centre.size() != m || input.half.size() != m)
    throw std::invalid_argument("output_range: the sizes of A, B, c and the boxes do not fit");

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
