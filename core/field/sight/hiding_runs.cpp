// SPDX-License-Identifier: BSD-3-Clause
#include "core/field/sight/hiding_runs.hpp"

#include <bit>

namespace backwash::field {

void HidingRuns::reserve(std::size_t most) {
  if (words_.size() >= most) return;
  for (auto* numbers : {&element_, &line_}) numbers->resize(2 * most);
  for (auto* numbers : {&x_, &y_, &low_, &high_}) numbers->resize(2 * most);
  words_.resize(2 * most);
}

void HidingRuns::list(const Source& source, const std::uint64_t* inside, std::uint64_t some) {
  reserve(count_ + 64 + kEight);
  std::size_t count = count_;
  for (; some; some &= some - 1) {
    const auto n = static_cast<std::size_t>(std::countr_zero(some));
    const std::uint64_t word = inside[n] & source.below[source.left[n]] & source.above[source.left[n]];
    element_[count] = source.element;
    line_[count] = source.line;
    x_[count] = source.crossings[n].x;
    y_[count] = source.crossings[n].y;
    words_[count] = word;
    count += word != 0 ? 1 : 0;
  }
  count_ = count;
}

/// Makes each entry one run of voxels; what is above it in its column becomes an entry of its own.
void HidingRuns::split() {
  for (std::size_t n = 0; n < count_; ++n) {
    reserve(count_ + 2 * kEight);
    const std::uint64_t inside = words_[n], beyond = inside + (inside & -inside);  // the lowest run is carried away
    low_[n] = std::countr_zero(inside) - kCentre;
    high_[n] = std::countr_zero(beyond) - 1 - kCentre;
    element_[count_] = element_[n];
    line_[count_] = line_[n];
    x_[count_] = x_[n];
    y_[count_] = y_[n];
    words_[count_] = inside & beyond;
    count_ += (inside & beyond) != 0 ? 1 : 0;
  }
}

void HidingRuns::hide(const LineFromAbove* lines, std::uint64_t* hidden) {
  split();
  for (std::size_t n = count_; n < padded(count_); ++n) line_[n] = 0;
  field::hide(lines, {line_.data(), x_.data(), y_.data(), low_.data(), high_.data(), words_.data()}, padded(count_));
  for (std::size_t n = 0; n < count_; ++n) hidden[element_[n]] |= words_[n];
  count_ = 0;
}

}  // namespace backwash::field
