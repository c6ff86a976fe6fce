// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {

/// Rotors in a level flow drag, linearly in the speed.
Effect rotor_drag() {
  return {
      .name = "rotor_drag",
      .forms = {{.formula = "push -k v, level",
                 .parameters = {"k_per_s"},
                 .floor = 0.01,
                 .columns = [](const Windows& ws,
                               const Scale&) { return std::vector{level(ws, [](auto& w) -> Vec3 { return -w.v_W; })}; },
                 .extend = extends(ModelEffect::Kind::push_against_velocity),
                 .simulate = simulates(SimulationTerm::Kind::push_against_velocity)}},
      .axis = {"velocity along x, m/s", false, [](auto& w) { return w.v_W.x(); }}};
}

}  // namespace backwash::study
