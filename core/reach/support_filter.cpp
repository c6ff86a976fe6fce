// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/support_filter.hpp"

#include "core/types/clones.hpp"

namespace backwash::reach {
namespace {

// Several partial sums: one would wait for every addition.
template <std::size_t Lanes, std::size_t Sums>
[[gnu::always_inline]] inline void add_up(const double* taps, const double* rows, std::size_t count, double* result) {
  double sums[Sums][Lanes] = {};
  std::size_t age = 0;
  for (; age + Sums <= count; age += Sums)
    for (std::size_t s = 0; s < Sums; ++s)
      for (std::size_t lane = 0; lane < Lanes; ++lane) sums[s][lane] += taps[age + s] * rows[(age + s) * Lanes + lane];
  for (; age < count; ++age)
    for (std::size_t lane = 0; lane < Lanes; ++lane) sums[0][lane] += taps[age] * rows[age * Lanes + lane];
  for (std::size_t s = 1; s < Sums; ++s)
    for (std::size_t lane = 0; lane < Lanes; ++lane) sums[0][lane] += sums[s][lane];
  for (std::size_t lane = 0; lane < Lanes; ++lane) result[lane] = sums[0][lane];
}

BACKWASH_CLONES
void of_four(const double* taps, const double* rows, std::size_t count, double* result) {
  add_up<4, 2>(taps, rows, count, result);
}
BACKWASH_CLONES
void of_one(const double* taps, const double* rows, std::size_t count, double* result) {
  add_up<1, 8>(taps, rows, count, result);
}

}  // namespace

template <>
std::array<double, 4> convolution(const double* taps, const std::array<double, 4>* rows, std::size_t count) noexcept {
  std::array<double, 4> sum;
  of_four(taps, rows->data(), count, sum.data());
  return sum;
}
template <>
std::array<double, 1> convolution(const double* taps, const std::array<double, 1>* rows, std::size_t count) noexcept {
  std::array<double, 1> sum;
  of_one(taps, rows->data(), count, sum.data());
  return sum;
}

}  // namespace backwash::reach
