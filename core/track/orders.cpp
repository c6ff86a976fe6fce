// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/orders.hpp"

#include <algorithm>
#include <utility>

namespace backwash::track {
namespace {

/// How much of the motion it ends: a hold slows down later, a disable acts on the ground.
int finality(Request request) noexcept {
  switch (request) {
    case Request::stop:
    case Request::land:
      return 3;
    case Request::disable:
      return 2;
    case Request::hold:
      return 1;
    default:
      return 0;
  }
}

}  // namespace

void Orders::add(const Order& order) noexcept {
  if (order.request == Request::enable) {
    enable_ = order;
    return;
  }
  enable_.reset();
  if (finality(order.request) >= finality(first_.request)) first_.request = order.request;
  first_.number = std::max(first_.number, order.number);
}

Order Orders::next() noexcept {
  if (first_.request != Request::none) return std::exchange(first_, Order{});
  return std::exchange(enable_, std::nullopt).value_or(Order{});
}

}  // namespace backwash::track
