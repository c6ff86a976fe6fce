// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/effects/columns.hpp"
#include "core/study/effects/on_the_model.hpp"

namespace backwash::study {
namespace {

/// The drag at the velocity that it leaves, and what its course along a window adds to the variance there. Both go by
/// the drag itself, scale.anchor: without it none. `per_speed`: how the drag per speed goes with the speed, a mean over
/// the way: a window holds a start or a stop.
template <typename F>
std::vector<DesignColumn> against(const Windows& ws, const Scale& scale, F per_speed) {
  const double k = scale.anchor.empty() ? 0 : scale.anchor[0];
  DesignColumn column = level(ws, [&](auto& w) -> Vec3 {
    const Vec3 v = w.led ? Vec3(w.v_W - k * w.led->slowed) : w.v_W;
    const double told = w.v_W.template head<2>().norm(), speed = v.template head<2>().norm();
    double way = 0, dragged = 0;
    for (std::size_t i = 0; i < kPoints && told > 0; ++i) {
      const double level2 = w.speeds[i] * w.speeds[i] - w.climbs[i] * w.climbs[i];
      const double along = speed / told * std::sqrt(std::max(0.0, level2));
      way += along;
      dragged += along * per_speed(along);
    }
    return -v * (way > 0 ? dragged / way : per_speed(speed));
  });
  // The loop meets a drag by its feedback, and is earlier against it: no delay of the set-points.
  column.parts.push_back({kCommandDelayH, values(ws, [](auto& w) { return w.drag_gain; }), true});
  for (std::size_t a = 0; a < 2 && k > 0; ++a)
    column.parts.push_back({kVariances[a], values(ws, [&](auto& w) {
                              const auto axis = static_cast<Eigen::Index>(a);
                              return std::log1p(k * k * w.varied2[axis] / w.sigma[axis]) / k;
                            })});
  return {column};
}

std::vector<DesignColumn> against_velocity(const Windows& ws, const Scale& scale) {
  return against(ws, scale, [](double) { return 1; });
}

/// The body's own drag beside the rotors': it grows with the square of the speed and is as large at `even`, m/s.
std::vector<DesignColumn> with_body(const Windows& ws, const Scale& even) {
  return against(ws, even, [&even](double v) { return (1 + v / even.value) / (1 + 1 / even.value); });
}

}  // namespace

/// Rotors in a level flow drag, linearly in the speed.
Effect rotor_drag() {
  return {.name = "rotor_drag",
          .forms = {{.formula = "push -k v, level",
                     .parameters = {"k_per_s"},
                     .priors = {{kPriors.typical_rate, 0, HUGE_VAL, "drag brakes"}},
                     .reference = Reference{1, "m/s", [](auto& w) { return w.speed; }},
                     .by_size = true,
                     .floor = 0.01,
                     .needs = {Source::attitude, Source::thrust},  // a loop that is late looks like it
                     .columns = against_velocity,
                     .shapes = {{.formula = "push -k v (1 + v/u)/(1 + 1 m/s/u), level: the body's drag beside it",
                                 .parameters = {},
                                 .scale_name = "u_mps",
                                 .scales = scales_of({1, 3, 10}),
                                 .columns = with_body}},
                     .extend = extends(Law::push_against_velocity),
                     .simulate = simulates(Law::push_against_velocity)}},
          .axis = {"velocity along x, m/s", false, [](auto& w) { return w.v_W.x(); }}};
}

}  // namespace backwash::study
