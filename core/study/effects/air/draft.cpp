// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

std::vector<ModelEffect> as_told(const FittedForm& fitted, const Observations&) {
  const auto &x = fitted.parameters[0], &y = fitted.parameters[1];
  return {{Law::push, Vec3(x.value, y.value, 0), Vec3(half_width(x), half_width(y), 0), 0}};
}

std::vector<SimulationTerm> in_the_plane(const FittedForm& fitted, const Observations&) {
  return {{Law::push, {fitted.theta[0], fitted.theta[1], 0}}};
}

}  // namespace

/// A steady wind, or anything else that pushes to one side of the world.
Effect draft() {
  return {.name = "draft",
          .forms = {{.formula = "constant level push fixed to the world",
                     .parameters = {"x_mps2", "y_mps2"},
                     .priors = {{kPriors.typical_push}, {kPriors.typical_push}},
                     .constant = true,
                     .floor = 0.02,
                     .columns =
                         [](const Windows& ws, const Scale&) {
                           return std::vector{level(ws, [](auto&) -> Vec3 { return Vec3::UnitX(); }),
                                              level(ws, [](auto&) -> Vec3 { return Vec3::UnitY(); })};
                         },
                     .extend = as_told,
                     .simulate = in_the_plane}},
          .axis = {"yaw, rad", false, [](auto& w) { return w.yaw(); }},
          .remedy = always(RemedyIn::place, "Find what moves the air: a fan, a vent, a window or a door.")};
}

}  // namespace backwash::study
