// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/field/lateral/lateral_columns.hpp"
#include "core/field/lateral/lateral_kernels.hpp"

namespace backwash::field {

/// Sums of the corner and wall terms in a column of targets. The wall's are sums of multiples of 2⁻⁴⁸ and so exact:
/// neither their order nor the way to them moves a bit.
class LateralSums {
 public:
  using Tensor = LateralColumns::Tensor;

  /// `radius`: elements are no farther above or below than that; `step`: exp(−k_w2 a² n²), for n ≤ radius + 1.
  LateralSums(int radius, const std::vector<double>& step);
  /// Adds decay · tensor · step[n] at the heights n above the elements from … to, first ≤ n < beyond.
  void add_wall(int from, int to, int first, int beyond, double decay, const Tensor& tensor) noexcept;
  /// The same at the bits of `heights`, not 0, above one element.
  void add_wall(int z, std::uint64_t heights, double decay, const Tensor& tensor) noexcept;
  /// As the kernel.
  void add_corner(const CornerTerms& terms, std::uint64_t heights, const float* count) noexcept {
    field::add_corner(terms, heights, count, corner_);
  }
  /// The sums at the bits of `targets`, and none of them any more.
  void close(std::uint64_t targets, LateralColumns::Sums& sums) noexcept;

 private:
  int radius_, width_;
  const double* step_;
  int first_, last_;
  std::vector<Four> walls_, row_;
  std::array<Four, LateralColumns::kLayers> wall_{};
  CornerSums corner_{};
};

}  // namespace backwash::field
