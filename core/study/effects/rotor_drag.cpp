// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

/// The drag at the velocity that it leaves, and what its course along a window adds to the variance there. Both go by
/// the drag itself, scale.anchor: without it none.
std::vector<DesignColumn> against_velocity(const Windows& ws, const Scale& scale) {
  const double k = scale.anchor.empty() ? 0 : scale.anchor[0];
  DesignColumn column = level(ws, [&](auto& w) -> Vec3 { return -(w.v_W - k * w.slowed); });
  for (std::size_t a = 0; a < 2 && k > 0; ++a)
    column.parts.push_back({kVariances[a], values(ws, [&](auto& w) {
                              const auto axis = static_cast<Eigen::Index>(a);
                              return std::log1p(k * k * w.varied2[axis] / w.sigma[axis]) / k;
                            })});
  return {column};
}

}  // namespace

/// Rotors in a level flow drag, linearly in the speed.
Effect rotor_drag() {
  return {.name = "rotor_drag",
          .forms = {{.formula = "push -k v, level",
                     .parameters = {"k_per_s"},
                     .possible = {{-0.1, 2, "drag brakes; with 2 1/s a craft would stop within half a second"}},
                     .reference = Reference{1, "m/s", [](auto& w) { return w.speed; }},
                     .by_speed = true,
                     .floor = 0.01,
                     .columns = against_velocity,
                     .extend = extends(Law::push_against_velocity),
                     .simulate = simulates(Law::push_against_velocity)}},
          .axis = {"velocity along x, m/s", false, [](auto& w) { return w.v_W.x(); }}};
}

}  // namespace backwash::study
