// SPDX-License-Identifier: BSD-3-Clause
// What held set-points charge the integrator of a loop that has neither delay nor lag: its own integration is the
// oracle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/reach/response/integrator.hpp"

namespace backwash::reach {
namespace {

TEST(HeldCommands, ChargeALoopWithoutDelayByNoMoreThanIsSaid) {
  // Their place and velocity lag the acceleration by 10 ms on the mean.
  constexpr double kStep = 2.5e-4;  // s
  constexpr int kHeld = 80;         // steps of 20 ms
  const AxisLoop axis{7, 4.5, 0, 0, 4};
  double largest = 0;
  for (const int half : {25, 50, 100, 200}) {  // set-points for which the acceleration keeps its sign
    double p_cmd = 0, v_cmd = 0, p = 0, v = 0, held = 0;
    for (int k = 0; k < 1000; ++k) {
      const double a_cmd = k / half % 2 == 0 ? 1 : -1;
      for (int i = 0; i < kHeld; ++i) {
        const double off = axis.kp * (p_cmd - p) + axis.kd * (v_cmd - v);
        const double a = a_cmd + off + held;
        held += kStep * axis.velocity_integrator / axis.kd * off;
        p += kStep * (v + kStep / 2 * a);
        v += kStep * a;
        largest = std::max(largest, std::abs(held));
      }
      p_cmd += 0.02 * v_cmd + 0.0002 * a_cmd;
      v_cmd += 0.02 * a_cmd;
    }
  }
  const double said = integrator_response(axis).manoeuvre;
  EXPECT_LE(largest, said);
  EXPECT_GT(largest, 0.4 * said);
}

}  // namespace
}  // namespace backwash::reach
