// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/track/supervisor.hpp"

namespace backwash::track {

/// The operator's orders of one tick, brought to one: the newest of those that end the motion goes first, however many
/// there are. What was asked for before it is gone; an order to enable that came after it follows in the next tick.
/// Real-time: wait-free, no allocation.
class Orders {
 public:
  /// In the order in which they were given.
  void add(const Order& order) noexcept;
  /// The order of this tick, if any; its number is that of the newest that was added.
  Order next() noexcept;

 private:
  Order first_;                  // that ends something
  std::optional<Order> enable_;  // came after it
};

}  // namespace backwash::track
