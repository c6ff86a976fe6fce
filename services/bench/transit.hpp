// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <utility>

namespace backwash::bench {

/// When an emulated estimator says something, and how long that is on its way.
struct Pace {
  double rate = 100;               ///< samples a second, at most 1000
  double latency = 0, jitter = 0;  ///< s from a sample to its message: the latency, and at random up to the jitter more
};

/// Samples on their way, in order. `Item` is what was sampled.
template <class Item>
class Transit {
 public:
  Transit(const Pace& pace, std::uint64_t seed) : pace_(pace), random_(seed) {}

  /// Whether a sample is due at step n of 1 ms.
  bool due(long n) const { return n == 0 || whole(n) != whole(n - 1); }
  void send(Item item, double t) {
    const double more = std::uniform_real_distribution<double>(0, 1)(random_) * pace_.jitter;
    last_ = std::max(last_, t + pace_.latency + more);
    held_.emplace_back(last_, std::move(item));
  }
  /// The next that has arrived at t (s), or nothing.
  std::optional<Item> arrived(double t) {
    if (held_.empty() || held_.front().first > t) return std::nullopt;
    Item item = std::move(held_.front().second);
    held_.pop_front();
    return item;
  }

 private:
  double whole(long n) const { return std::floor(static_cast<double>(n) * pace_.rate / 1000); }

  Pace pace_;
  std::mt19937_64 random_;
  double last_ = 0;
  std::deque<std::pair<double, Item>> held_;
};

}  // namespace backwash::bench
