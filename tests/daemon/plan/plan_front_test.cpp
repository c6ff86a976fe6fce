// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/plan/plan_front.hpp"

#include <gtest/gtest.h>

namespace backwash::daemon {
namespace {

using Standing = PlanFront::Standing;
using Fate = PlanFront::Fate;

TEST(PlanFront, APlanIsWaitedForOnlyUntilItsOwnOrderAndNeverPastALapse) {
  PlanFront front;
  front.begin({.order = 7, .lapse = 3});
  const auto standing = [&](std::uint64_t order, std::uint64_t lapse) {
    ControlView view;
    view.epoch = {order, lapse};
    return front.standing(view);
  };
  EXPECT_EQ(standing(7, 3), Standing::current);
  EXPECT_EQ(standing(6, 3), Standing::early);
  EXPECT_EQ(standing(8, 3), Standing::ended);
  EXPECT_EQ(standing(7, 4), Standing::ended);
  EXPECT_EQ(standing(6, 4), Standing::ended) << "the mode ended it before its order was taken";
}

TEST(PlanFront, TheFateOfAnOfferIsThatOfTheSegmentStampedLast) {
  PlanFront front;
  front.begin({.order = 7, .lapse = 3});
  track::AcceptedSegment first, second;
  front.stamp(first);
  front.stamp(second);
  EXPECT_NE(first.id, second.id);
  EXPECT_EQ(second.epoch, (track::Epoch{7, 3}));
  ControlView view;
  view.segment = view.refused_segment = first.id;
  EXPECT_EQ(front.fate(view), Fate::open) << "that was the one before";
  view.refused_segment = second.id;
  EXPECT_EQ(front.fate(view), Fate::refused);
  view.segment = second.id;
  EXPECT_EQ(front.fate(view), Fate::accepted);
}

}  // namespace
}  // namespace backwash::daemon
