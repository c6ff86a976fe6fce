// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control/doubts.hpp"

#include <spdlog/fmt/fmt.h>

#include "firmware_bridge/line_budget.hpp"
#include "services/backwashd/text.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

Doubts doubts_of(const ControlView& view, const Vehicle& vehicle) {
  constexpr double kMostOdometryLost = 0.5;  // chosen: a VIO of 30 Hz comes as one of 15 Hz
  Doubts doubts;
  const double allowed = firmware_bridge::line_allowed(vehicle, view.untold_delay);
  if (view.round_trip > allowed)
    doubts.emplace_back("line",
                        fmt::format("{:.3f} s there and back, the sets allow for {:.3f} s: a faster line, or larger "
                                    "controller.latency and feedback_delay in the vehicle file",
                                    *view.round_trip, allowed));
  if (view.loss && view.loss->odometry > kMostOdometryLost)
    doubts.emplace_back(
        "line",
        fmt::format("it loses {:.1f} % of the autopilot's frames, {:.1f} % of our short ones "
                    "and so {:.0f} % of ODOMETRY at least, of which {:.0f} % may be lost: a better "
                    "cable or radio, or another baud rate",
                    100 * view.loss->in, 100 * view.loss->out, 100 * view.loss->odometry, 100 * kMostOdometryLost));
  if (view.estimator_follows == false)
    doubts.emplace_back("estimator", "it takes its position from no sensor: it does not follow the VIO");
  if (view.offboard && !view.armed && view.would_arm == false)  // by its checks for this mode
    doubts.emplace_back(dds::kArming,
                        "the autopilot would refuse it" +
                            (view.warning ? ": " + printable(view.warning->value.text.data()) : std::string()));
  return doubts;
}

}  // namespace backwash::daemon
