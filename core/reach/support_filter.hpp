// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "core/reach/response/error_dynamics.hpp"

namespace backwash::reach {

/// The last rows of a sequence, newest first and contiguous, so that they lie beside the taps of a filter.
template <typename Row>
class NewestFirst {
 public:
  explicit NewestFirst(std::size_t capacity) : capacity_(capacity), rows_(2 * capacity), begin_(2 * capacity) {}
  /// Constant cost on average. Real-time: wait-free, no allocation.
  void push(const Row& row) noexcept {
    if (begin_ == 0) {
      std::copy_backward(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(capacity_) - 1, rows_.end());
      begin_ = capacity_ + 1;
    }
    rows_[--begin_] = row;
    size_ = std::min(size_ + 1, capacity_);
  }
  std::size_t size() const noexcept { return size_; }
  bool full() const noexcept { return size_ == capacity_; }
  const Row& oldest() const noexcept { return rows_[begin_ + size_ - 1]; }
  const Row& operator[](std::size_t age) const noexcept { return rows_[begin_ + age]; }

 private:
  std::size_t capacity_;
  std::vector<Row> rows_;
  std::size_t begin_, size_ = 0;
};

/// Σ_j taps[j]·rows[j] over `count` rows, of 1 or 4 lanes. Real-time: wait-free, no allocation.
template <std::size_t Lanes>
std::array<double, Lanes> convolution(const double* taps, const std::array<double, Lanes>* rows,
                                      std::size_t count) noexcept;
template <>
std::array<double, 1> convolution(const double* taps, const std::array<double, 1>* rows, std::size_t count) noexcept;
template <>
std::array<double, 4> convolution(const double* taps, const std::array<double, 4>* rows, std::size_t count) noexcept;

/// The convolution Σ_j w̄_{k−1−j} G_j of docs/model.md section 5.2 for `Lanes` sequences that share a response: by the
/// delay recursion where the response has one, else by the FIR. The response must outlive it.
template <std::size_t Lanes>
class SupportFilter {
 public:
  using Row = std::array<double, Lanes>;

  explicit SupportFilter(const AxisResponse& response)
      : response_(&response),
        bounds_(response.delay ? 1 : response.G.size() - 1),  // the step in progress is the N-th
        motions_(response.delay ? response.delay->memory : 1) {}

  /// Enters the bounds of a step; returns what all steps entered so far add at the end of the next one, without the
  /// tail. FIR: min(k, N) multiplications per lane; delay recursion: 7 + 3 M.
  /// Real-time: wait-free, no allocation.
  Row push(const Row& w) noexcept { return response_->delay ? echoed(w) : convolved(w); }
  /// What the tail may add to that.
  Row tail() const noexcept {
    Row tail;
    const double share = response_->delay ? response_->delay->tail : response_->tail;
    for (std::size_t lane = 0; lane < Lanes; ++lane) tail[lane] = share * largest_dropped_[lane];
    return tail;
  }

 private:
  struct Motion {  // y and ẏ at a step's start, and the step's bound
    Row y{}, v{}, w{};
  };

  void drop(const Row& w) noexcept {
    for (std::size_t lane = 0; lane < Lanes; ++lane) largest_dropped_[lane] = std::max(largest_dropped_[lane], w[lane]);
  }

  Row convolved(const Row& w) noexcept {
    if (bounds_.full()) drop(bounds_.oldest());
    bounds_.push(w);
    return convolution(response_->G.data() + 1, &bounds_[0], bounds_.size());
  }

  Row echoed(const Row& w) noexcept {
    const DelayRecursion& r = *response_->delay;
    if (motions_.full()) drop(motions_.oldest().w);
    motions_.push({y_, v_, w});
    Row sum{};
    for (std::size_t lane = 0; lane < Lanes; ++lane) {
      const double y = y_[lane], v = v_[lane];
      y_[lane] = r.E(0, 0) * y + r.E(0, 1) * v + r.F[0] * w[lane];
      v_[lane] = r.E(1, 0) * y + r.E(1, 1) * v + r.F[1] * w[lane];
      sum[lane] = r.E(0, 0) * y_[lane] + r.E(0, 1) * v_[lane];
    }
    // Of the sample after the next step, `back` steps ago is age back − 2.
    for (const DelayRecursion::Echo& echo : r.echoes) {
      if (echo.back - 2 >= motions_.size()) break;
      const Motion& past = motions_[echo.back - 2];
      for (std::size_t lane = 0; lane < Lanes; ++lane)
        sum[lane] += echo.y * past.y[lane] + echo.v * past.v[lane] + echo.w * past.w[lane];
    }
    return sum;
  }

  const AxisResponse* response_;
  NewestFirst<Row> bounds_;      // FIR only
  NewestFirst<Motion> motions_;  // delay recursion only
  Row y_{}, v_{};
  Row largest_dropped_{};  // of the steps that only the tail covers
};

}  // namespace backwash::reach
