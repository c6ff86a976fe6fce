// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/lateral/lateral_sums.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace backwash::field {
namespace {

constexpr double kSteps = 24;  // x + 24 is a multiple of 2⁻⁴⁸

}  // namespace

LateralSums::LateralSums(int radius, const std::vector<double>& step)
    : radius_(radius),
      width_(radius + 2),
      step_(step.data()),
      first_(std::numeric_limits<int>::max()),
      last_(std::numeric_limits<int>::min()),
      walls_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(LateralColumns::kLayers + 2 * radius + 2)),
      row_(static_cast<std::size_t>(width_)) {}

void LateralSums::add_wall(int from, int to, int first, int beyond, double decay, const Tensor& tensor) noexcept {
  const auto rounded = [&](double x) { return (decay * x + kSteps) - kSteps; };
  const Four number{rounded(tensor.xx), rounded(tensor.xy), rounded(tensor.yy), rounded(tensor.zz)};
  Four* row = walls_.data() + static_cast<std::ptrdiff_t>(from + radius_) * width_;
  Four* end = row + static_cast<std::ptrdiff_t>(to - from + 1) * width_;
  row[first] += number;
  row[beyond] -= number;
  end[first] -= number;
  end[beyond] += number;
  first_ = std::min(first_, from);
  last_ = std::max(last_, to + 1);
}

void LateralSums::add_wall(int z, std::uint64_t heights, double decay, const Tensor& tensor) noexcept {
  do {
    const int first = std::countr_zero(heights);
    const std::uint64_t beyond = heights + (std::uint64_t{1} << first);  // the run is carried away
    add_wall(z, z, first, std::countr_zero(beyond), decay, tensor);
    heights &= beyond;
  } while (heights);
}

void LateralSums::close(std::uint64_t targets, LateralColumns::Sums& sums) noexcept {
  wall_.fill({});
  if (first_ <= last_)
    sum_walls({walls_.data() + static_cast<std::ptrdiff_t>(radius_) * width_, width_, step_}, first_, last_,
              LateralColumns::kLayers, row_.data(), wall_.data());
  for (; targets; targets &= targets - 1) {
    const auto n = static_cast<std::size_t>(std::countr_zero(targets));
    const Four& wall = wall_[n];
    sums.xx[n] = wall.xx + corner_.xx[n];
    sums.xy[n] = wall.xy + corner_.xy[n];
    sums.yy[n] = wall.yy + corner_.yy[n];
    sums.zz[n] = wall.zz + corner_.zz[n];
  }
  corner_ = {};
  first_ = std::numeric_limits<int>::max();
  last_ = std::numeric_limits<int>::min();
}

}  // namespace backwash::field
