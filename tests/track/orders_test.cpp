// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/orders.hpp"

#include <gtest/gtest.h>

#include "core/track/supervisor.hpp"
#include "tests/track/flown/healthy.hpp"

namespace backwash::track {
namespace {

Order next_of(std::initializer_list<Order> given) {
  Orders orders;
  for (const Order& order : given) orders.add(order);
  return orders.next();
}

TEST(Orders, TheOneThatEndsTheMotionIsNotDelayedByWhatCameWithIt) {
  for (const Request end : {Request::stop, Request::land}) {
    for (const Request other : {Request::enable, Request::disable, Request::hold}) {
      EXPECT_EQ(next_of({{other, 1}, {end, 2}}).request, end);
      EXPECT_EQ(next_of({{end, 1}, {other, 2}}).request, end);
    }
  }
  EXPECT_EQ(next_of({{Request::stop, 1}, {Request::land, 2}}).request, Request::land);
  EXPECT_EQ(next_of({{Request::land, 1}, {Request::stop, 2}}).request, Request::stop);
  EXPECT_EQ(next_of({{Request::hold, 1}, {Request::disable, 2}}).request, Request::disable);
}

TEST(Orders, TheNumberIsThatOfTheNewest) {
  EXPECT_EQ(next_of({{Request::stop, 3}, {Request::hold, 4}}).number, 4u);
  EXPECT_EQ(next_of({}).number, 0u);
  EXPECT_EQ(next_of({}).request, Request::none);
}

TEST(Orders, AnEnableBeforeAnEndIsGoneAndOneAfterItFollows) {
  Orders orders;
  orders.add({Request::enable, 1});
  orders.add({Request::stop, 2});
  EXPECT_EQ(orders.next().request, Request::stop);
  EXPECT_EQ(orders.next().request, Request::none);
  orders.add({Request::stop, 3});
  orders.add({Request::enable, 4});
  EXPECT_EQ(orders.next().request, Request::stop);
  const Order enable = orders.next();
  EXPECT_EQ(enable.request, Request::enable);
  EXPECT_EQ(enable.number, 4u);
  EXPECT_EQ(orders.next().request, Request::none);
}

// A daemon that died, or went quiet, in flight: the autopilot may hover in our mode for ever.
TEST(Orders, AnOperatorLandsAnArmedVehicleInOurModeThatNobodyCommands) {
  for (const Request request : {Request::land, Request::stop}) {
    for (const bool ours : {true, false}) {
      Supervisor s;
      SupervisorInput in = healthy();
      in.armed = true;
      in.offboard = ours;
      EXPECT_FALSE(s.step(in).send_heartbeat) << "it belongs to somebody else until an operator says so";
      in.request = request;
      auto out = s.step(in);
      in.request = Request::none;
      EXPECT_EQ(out.mode, ours ? Mode::land : Mode::passive);
      bool asked = false;
      for (int n = 0; n < 10; ++n) {
        asked = asked || out.request_land;
        out = s.step(in);
      }
      EXPECT_EQ(asked, ours);
    }
  }
}

}  // namespace
}  // namespace backwash::track
