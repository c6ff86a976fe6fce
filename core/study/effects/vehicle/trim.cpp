// SPDX-License-Identifier: BSD-3-Clause
#include <numbers>

#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// A push fixed to the body: an attitude estimate or a rotor plane that is not level.
Effect trim() {
  return {.name = "trim",
          .forms = {{.formula = "constant push fixed to the body",
                     .parameters = {"body_x_mps2", "body_y_mps2"},
                     .priors = {{kPriors.typical_push}, {kPriors.typical_push}},
                     .constant = true,
                     .floor = 0.02,
                     .needs = {Source::attitude},
                     .columns =
                         [](const Windows& ws, const Scale&) {
                           return std::vector{level(ws, [](auto& w) -> Vec3 { return w.body_axis(0); }),
                                              level(ws, [](auto& w) -> Vec3 { return w.body_axis(1); })};
                         },
                     .extend = unknown_push,
                     .simulate = simulates(SimulationTerm::Kind::push_of_heading)}},
          .axis = {"yaw, rad", false, [](auto& w) { return w.yaw(); }},
          .remedy = always(
              RemedyIn::craft,
              "Level the craft anew: calibrate the autopilot's level horizon, and look for a bent arm or motor."),
          .manoeuvres = {{"turn a full yaw turn on the spot, far from walls", [](WindowRow& w, double s) {
                            w.R_WB = Eigen::AngleAxisd(2 * std::numbers::pi * s, Vec3::UnitZ()).toRotationMatrix();
                            w.around.walls.clear();
                          }}}};
}

}  // namespace backwash::study
